// Analysis by synthesis: from the truth it goes nowhere, from elsewhere it comes nearer, and stopped it goes on.
#include "network/evaluation/synthesis.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/support/egg_set.h"

using namespace itn;

namespace {

const Device& device() {
  static const Device the_device;
  return the_device;
}

// Two images of an egg, under two lights.
struct Eggs : EggSet {
  std::vector<SynthesisTarget> targets;
  std::vector<DatasetMaterial> truth{{8, 0.9, 0.5}, {4, 0.7, 0.2}};

  Eggs() {
    RenderedLoss renderer(device(), set, folder / "", Operator::full, nullptr);
    for (int i = 0; i < 2; ++i) {
      Manifest::Image image;
      image.light = i;
      const DatasetMaterial& m = truth[static_cast<std::size_t>(i)];
      Rendering rendering = renderer.render({{&image, m, 1, nullptr}}, 1024).front();
      targets.push_back({image, {rendering.mean, rendering.stderr_}});
    }
  }
};

double logit(double share) { return std::log(share / (1 - share)); }

SynthesisOptions options(int iterations) {
  SynthesisOptions o;
  o.iterations = iterations;
  o.record_every = iterations;
  o.recorded_spp = 256;
  return o;
}

Synthesis::Record end_of(Synthesis& synthesis) {
  while (!synthesis.finished()) synthesis.advance();
  return synthesis.records().back();
}

}  // namespace

TEST_CASE("from the truth, analysis by synthesis wanders with the noise but goes nowhere") {
  const Eggs eggs;
  RenderedLoss renderer(device(), eggs.set, eggs.folder / "", Operator::full, nullptr);
  SynthesisOptions how = options(100);
  how.learning_rate = 0.01;
  Synthesis synthesis(renderer, eggs.set, eggs.folder / "", eggs.targets, eggs.truth, how);
  const Synthesis::Record end = end_of(synthesis);
  REQUIRE(synthesis.records().size() == 2);
  CHECK(synthesis.records()[0].material[0].sigma_t == Approx(8));
  // 100 steps in one direction, as of a gradient with a bias, would be 0.5 in every coordinate; of random sign, 0.07.
  for (std::size_t i = 0; i < 2; ++i) {
    const DatasetMaterial &found = end.material[i], &truth = eggs.truth[i];
    CAPTURE(i, found.sigma_t, found.albedo, found.g, end.loss[i]);
    CHECK(std::abs(std::log(found.sigma_t / truth.sigma_t)) < 0.25);
    CHECK(std::abs(logit(found.albedo) - logit(truth.albedo)) < 0.25);
    CHECK(std::abs(logit((1 + found.g) / 2) - logit((1 + truth.g) / 2)) < 0.25);
  }
}

TEST_CASE("from another albedo it comes nearer, and the image loss falls by more than a factor of 20") {
  const Eggs eggs;
  RenderedLoss renderer(device(), eggs.set, eggs.folder / "", Operator::full, nullptr);
  const std::vector<DatasetMaterial> starts{{8, 0.7, 0.5}, {4, 0.9, 0.2}};
  Synthesis synthesis(renderer, eggs.set, eggs.folder / "", eggs.targets, starts, options(100));
  const Synthesis::Record end = end_of(synthesis), start = synthesis.records().front();
  for (std::size_t i = 0; i < 2; ++i) {
    CAPTURE(i, end.material[i].sigma_t, end.material[i].albedo, end.material[i].g, start.loss[i], end.loss[i]);
    CHECK(start.loss[i] > 0);
    CHECK(end.loss[i] < 0.05 * start.loss[i]);
    // Not to the truth: sigma_t and g go along, and the image hardly tells some combinations of the three apart.
    CHECK(std::abs(end.material[i].albedo - eggs.truth[i].albedo) < std::abs(starts[i].albedo - eggs.truth[i].albedo));
  }
}

TEST_CASE("stopped at any iteration and gone on from its state, it has the same numbers") {
  const Eggs eggs;
  RenderedLoss renderer(device(), eggs.set, eggs.folder / "", Operator::full, nullptr);
  const std::vector<DatasetMaterial> starts{{5, 0.75, 0.3}, {6, 0.85, 0.5}};
  SynthesisOptions how = options(6);
  how.record_every = 2;
  how.recorded_spp = 4;
  how.spp = 4;
  const auto make = [&] { return Synthesis(renderer, eggs.set, eggs.folder / "", eggs.targets, starts, how); };
  Synthesis whole = make();
  const nlohmann::json wanted = [&] {
    end_of(whole);
    return whole.state();
  }();
  CHECK(whole.records().size() == 4);
  for (int stop = 0; stop < 10; ++stop) {
    Synthesis first = make(), second = make();
    for (int k = 0; k < stop; ++k) first.advance();
    second.restore(nlohmann::json::parse(first.state().dump()));
    end_of(second);
    CHECK(second.state() == wanted);
  }
  Synthesis other = make();
  nlohmann::json damaged = wanted;
  damaged["x"].erase(0);
  CHECK_THROWS(other.restore(damaged));
  const nlohmann::json none = nlohmann::json::array();
  for (const auto& [place, value] : std::vector<std::pair<const char*, nlohmann::json>>{{"/x/0", none},
                                                                                        {"/x/1/2", nullptr},
                                                                                        {"/moments/0/first", {1}},
                                                                                        {"/iteration", -1},
                                                                                        {"/iteration", 7},
                                                                                        {"/iteration", 1.5},
                                                                                        {"/records/0/material", none},
                                                                                        {"/records/0/loss", none}}) {
    CAPTURE(place, value.dump());
    damaged = wanted;
    damaged[nlohmann::json::json_pointer(place)] = value;
    CHECK_THROWS(other.restore(damaged));
  }
}
