// Inversions whose state is in a folder.
#include "runtime/inverse/gauss_newton/stored_inversion.h"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <utility>

#include "itn/error.h"
#include "itn/file.h"
#include "runtime/base/statistics.h"
#include "tests/inversion/small_scene.h"
#include "tests/support/temporary_folder.h"

using namespace itn;
using namespace itn::test;

namespace {

const StoredRun::Json request{{"seed", 5}};

struct Small {
  std::vector<TargetImage> targets{rendered_target(test::device(), fog_ball(4, 0.5, 0.5), 16, 7)};
  ForwardModel model{test::device(), fog_ball(2, 0.7, 0.5), {"fog.sigma_t", "fog.albedo"}, {0}, RenderOptions()};
  Inversion inversion;

  explicit Small(InversionOptions::Method method) : inversion(model, targets, few(method)) {}

  static InversionOptions few(InversionOptions::Method method) {
    InversionOptions how;
    how.method = method;
    how.spp = 16;
    how.iterations = 3;
    return how;
  }

  StoredInversion open(const std::string& folder) {
    return {folder, request, inversion, model.coordinates(),
            inversion_starts(model.coordinates(), model.start(), 2, 1)};
  }
};

// A state without its checksum, which would be what is refused otherwise.
nlohmann::json unsealed(const std::string& file) {
  auto state = nlohmann::json::parse(read_file(file));
  state.erase("checksum");
  return state;
}

}  // namespace

TEST_CASE("inversions from two starts, stopped after any iteration, end with the same bytes") {
  const auto method = GENERATE(InversionOptions::Method::adam, InversionOptions::Method::gauss_newton);
  const TemporaryFolder folder;
  Small small(method);
  std::size_t iterations = 0;
  {
    StoredInversion whole = small.open(folder / "whole");
    for (; !whole.finished(); ++iterations) whole.advance();
    CHECK(whole.started().size() == 2);
    CHECK(whole.fraction(3) == 1);
  }
  for (std::size_t i = 0; i < iterations; ++i) small.open(folder / "parts").advance();
  CHECK(small.open(folder / "parts").finished());
  for (const char* name : {"state.json", "iterations.jsonl"})
    CHECK(read_file(folder / ("parts/" + std::string(name))) == read_file(folder / ("whole/" + std::string(name))));
}

TEST_CASE("a state that is damaged inside is refused by name") {
  const TemporaryFolder folder;
  Small small(InversionOptions::Method::adam);
  small.open(folder / "fit").advance();
  auto state = unsealed(folder / "fit/state.json");
  state["runs"][0]["state"].erase("damping");
  write_file(folder / "fit/state.json", state.dump());
  CHECK_THROWS_AS(small.open(folder / "fit"), InputError);
  CHECK_THROWS_WITH(small.open(folder / "fit"), Catch::Contains("state.json: not an inversion"));
}

TEST_CASE("a state of numbers that no inversion has is refused") {
  const TemporaryFolder folder;
  Small small(InversionOptions::Method::gauss_newton);
  small.open(folder / "fit").advance();
  const std::string whole = read_file(folder / "fit/state.json");
  for (const auto& [key, value] : std::vector<std::pair<std::string, nlohmann::json>>{{"x", nlohmann::json::array()},
                                                                                      {"x", {1, 2, 3}},
                                                                                      {"spp", 0},
                                                                                      {"spp", -1},
                                                                                      {"spp", 4294967312},
                                                                                      {"spp", 16.5},
                                                                                      {"iteration", 1e300},
                                                                                      {"next_sample", -1},
                                                                                      {"iteration", -7},
                                                                                      {"pool", {1}},
                                                                                      {"reference_x", {1}},
                                                                                      {"damping", 0},
                                                                                      {"x", nullptr},
                                                                                      {"spp", "many"}}) {
    CAPTURE(key, value.dump());
    auto state = unsealed(folder / "fit/state.json");
    state["runs"][0]["state"][key] = value;
    write_file(folder / "fit/state.json", state.dump());
    CHECK_THROWS_WITH(small.open(folder / "fit"), Catch::Contains("state.json: not an inversion"));
    write_file(folder / "fit/state.json", whole);
  }
  auto state = unsealed(folder / "fit/state.json");
  for (int i = 0; i < 5; ++i) state["runs"].push_back(state["runs"][0]);
  write_file(folder / "fit/state.json", state.dump());
  CHECK_THROWS_WITH(small.open(folder / "fit"), Catch::Contains("state.json: not an inversion"));
  write_file(folder / "fit/state.json", whole);
  CHECK_FALSE(small.open(folder / "fit").finished());
}

TEST_CASE("a state of which a digit has changed is refused") {
  const TemporaryFolder folder;
  Small small(InversionOptions::Method::gauss_newton);
  small.open(folder / "fit").advance();
  std::string state = read_file(folder / "fit/state.json");
  char& digit = state[state.find_first_of("0123456789", state.find("\"accepted_loss\"")) + 3];
  digit = digit == '5' ? '6' : '5';
  write_file(folder / "fit/state.json", state);
  CHECK_THROWS_WITH(small.open(folder / "fit"), Catch::Contains("state.json: has changed since it was written"));
}

TEST_CASE("two inversions into one folder: the second is refused") {
  const TemporaryFolder folder;
  Small small(InversionOptions::Method::adam);
  const StoredInversion first = small.open(folder / "fit");
  CHECK_THROWS_WITH(small.open(folder / "fit"), Catch::Contains("another process is writing into it"));
}

TEST_CASE("random starts are what the seed says, the first is the given one, and all lie in the parameters' ranges") {
  const ForwardModel model(test::device(), fog_ball(2, 0.7, 0.5), {"fog.sigma_t", "fog.albedo"}, {0}, RenderOptions());
  const std::vector<double> first = model.start();
  const auto starts = inversion_starts(model.coordinates(), first, 20, 3);
  REQUIRE(starts.size() == 20);
  CHECK(starts[0] == first);
  CHECK(starts == inversion_starts(model.coordinates(), first, 20, 3));
  CHECK(starts[1] != inversion_starts(model.coordinates(), first, 2, 4)[1]);
  for (std::size_t k = 1; k < starts.size(); ++k) {
    CHECK(starts[k] != starts[k - 1]);
    for (std::size_t p = 0; p < 2; ++p)
      CHECK(model.coordinates()[p].parameter().contains(model.coordinates()[p].value(starts[k][p])));
  }
}

TEST_CASE("starts lie in the range that was given, the first in its middle where it lay outside") {
  const ForwardModel model(test::device(), fog_ball(2, 0.7, 0.5), {"fog.sigma_t", "fog.albedo"}, {0}, RenderOptions());
  const Coordinate &sigma_t = model.coordinates()[0], &albedo = model.coordinates()[1];
  const std::vector<double> first = model.start();
  const auto starts = inversion_starts(model.coordinates(), first, 20, 3, {{"fog.sigma_t", {10, 40}}});
  REQUIRE(starts.size() == 20);
  CHECK(sigma_t.value(starts[0][0]) == Approx(20));  // of its logarithm
  CHECK(starts[0][1] == first[1]);
  double least = 40, most = 10;
  for (const std::vector<double>& start : starts) {
    least = std::min(least, sigma_t.value(start[0]));
    most = std::max(most, sigma_t.value(start[0]));
    CHECK(albedo.parameter().contains(albedo.value(start[1])));
  }
  CHECK(least >= 10);
  CHECK(least < 15);
  CHECK(most > 28);
  CHECK(most <= 40);
  CHECK(inversion_starts(model.coordinates(), first, 1, 3, {{"fog.sigma_t", {1, 40}}})[0] == first);
}

TEST_CASE("a prior's interval holds 95 % of its normal distribution, and other parameters stay unknown") {
  const ForwardModel model(test::device(), fog_ball(2, 0.7, 0.5), {"fog.sigma_t", "fog.albedo"}, {0}, RenderOptions());
  Prior prior;
  prior.add_interval(model.coordinates(), 1, 0.4, 0.8);
  const double deviation = 1 / std::sqrt(prior.precision(1, 1));
  for (const auto& [value, share] : {std::pair{0.4, 0.025}, {0.8, 0.975}})
    CHECK(normal_cdf((model.coordinates()[1].of(value) - prior.mean[1]) / deviation) == Approx(share));
  CHECK(prior.precision(0, 0) == 0);
}

TEST_CASE("a prior of samples has their mean and covariance in the coordinates, and leaves other parameters unknown") {
  const ForwardModel model(test::device(), fog_ball(2, 0.7, 0.5), {"fog.sigma_t", "fog.albedo"}, {0}, RenderOptions());
  // Four corners of a slanted square in the coordinates (first, second).
  const std::vector<Coordinate>& c = model.coordinates();
  std::vector<std::vector<double>> samples;
  for (const auto& [a, b] : {std::pair{1.0, 0.5}, {-1.0, -0.5}, {0.2, -0.4}, {-0.2, 0.4}})
    samples.push_back({c[1].value(0.3 + b), c[0].value(0.1 + a)});
  Prior prior;
  prior.add_samples(c, {1, 0}, samples);
  CHECK(prior.mean[0] == Approx(0.1));
  CHECK(prior.mean[1] == Approx(0.3));
  Eigen::Matrix2d covariance;  // sums of squares and products over three
  covariance << 2.08, 0.84, 0.84, 0.82;
  covariance /= 3;
  CHECK((prior.precision * covariance - Eigen::Matrix2d::Identity()).norm() < 1e-9);

  Prior one;
  one.add_samples(c, {1}, {{0.4}, {0.6}, {0.7}});
  CHECK(one.precision(1, 1) > 0);
  CHECK((one.precision(0, 0) == 0 && one.precision(0, 1) == 0));
}
