// Baselines (kernels/derivative/baseline.h) take off something of mean zero, and with it noise.
#include "runtime/render/wavefront/baseline.h"

#include <bit>
#include <catch2/catch.hpp>

#include "../support/z_test.h"
#include "itn/parameters.h"
#include "transport.h"

using namespace itn;
using namespace itn::test;

namespace {

// Matched and rough boundaries, colours by sigma_t and by albedo, a sun through both kinds of boundary, floors, a
// camera inside of a medium, paths that max_depth ends.
const std::vector<std::string> scenes{"rough_ggx",     "rgb_sigma_t", "sunsky_rough_floor",
                                      "camera_inside", "max_depth",   "grid_rgb"};
// As in the suite, in other company.
const std::vector<std::string> more_scenes{"null_constant", "rough_beckmann", "sunsky_null_floor", "rgb_albedo",
                                           "grid_null"};
constexpr double significance = 1e-4;

std::vector<std::string> quiet_parameters(const Scene& scene) {
  std::vector<std::string> names;
  for (const Parameter& p : list_parameters(scene)) {
    const bool random_decision = p.member == "sigma_t" || p.is(Owner::medium, "scale") || p.member == "albedo" ||
                                 p.member == "g" || p.member == "alpha" || p.member == "int_ior";
    if (p.not_differentiable.empty() && random_decision) names.push_back(p.name);
  }
  return names;
}

RenderOptions with(const std::vector<std::string>& parameters, Baselines baselines, std::uint64_t seed) {
  RenderOptions options = one_lane();
  options.derivatives = parameters;
  options.baselines = baselines;
  options.seed = seed;
  options.spp = 64;
  return options;
}

void check_mean_zero(const std::string& name, Operator op) {
  // With one seed the paths are the same: the difference is what was taken off, independent from pixel to pixel.
  const Scene scene = load_scene(test_scene("mitsuba/" + name + ".xml"));
  const std::vector<std::string> parameters = quiet_parameters(scene);
  RenderOptions plain = with(parameters, Baselines::off, 3), quiet = with(parameters, Baselines::on, 3);
  plain.op = quiet.op = op;
  const Rendering a = render(device(), scene, plain), b = render(device(), scene, quiet);
  CHECK(a.mean == b.mean);
  for (std::size_t i = 0; i < parameters.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c) {
      double sum = 0, square = 0;
      for (std::size_t at = c; at < a.mean.size(); at += 3) {
        const double off =
            static_cast<double>(a.derivatives[i].mean[at]) - static_cast<double>(b.derivatives[i].mean[at]);
        sum += off;
        square += off * off;
      }
      INFO(name << ", " << parameters[i] << ", channel " << c << ": z " << sum / std::sqrt(square));
      if (square == 0) continue;  // a channel that does not depend on the parameter
      constexpr std::size_t tests = 200;
      CHECK(std::abs(sum) < largest_z_bound(tests, significance) * std::sqrt(square));
    }
}

}  // namespace

TEST_CASE("what baselines take off a derivative has mean zero (z-test)", "[derivative][stat]") {
  check_mean_zero("sunsky_rough_floor", Operator::single);
  for (const std::string& name : scenes) check_mean_zero(name, Operator::full);
}

TEST_CASE("what baselines take off a derivative has mean zero in more scenes (z-test)", "[.baselines]") {
  for (const std::string& name : more_scenes) check_mean_zero(name, Operator::full);
}

TEST_CASE("baselines change no mean of derivatives, with independent seeds (z-test)", "[derivative][stat]") {
  for (const char* name : {"null_constant", "rough_ggx"}) {
    const Scene scene = load_scene(test_scene("mitsuba/" + std::string(name) + ".xml"));
    const std::vector<std::string> parameters = quiet_parameters(scene);
    const Rendering plain = render(device(), scene, with(parameters, Baselines::off, 4)),
                    quiet = render(device(), scene, with(parameters, Baselines::on, 5));
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      const Image &a = plain.derivatives[i], &b = quiet.derivatives[i];
      INFO(name << ", " << parameters[i]);
      constexpr std::size_t tests = 10;
      CHECK(std::abs(a.mean_of_image[1] - b.mean_of_image[1]) <
            largest_z_bound(tests, significance) * std::hypot(a.stderr_of_mean[1], b.stderr_of_mean[1]));
    }
  }
}

TEST_CASE("baselines lower the variance of derivatives where paths scatter often", "[derivative][stat]") {
  struct Case {
    const char* scene;
    double sigma_t, least;
  };
  for (const auto& [name, sigma_t, least] : {Case{"null_constant", 20, 1.6}, Case{"rough_ggx", 10, 1.1}}) {
    Scene scene = load_scene(test_scene("mitsuba/" + std::string(name) + ".xml"));
    scene.media[0].set("sigma_t", sigma_t);
    scene.media[0].set("albedo", 0.95);
    const std::vector<std::string> parameters = quiet_parameters(scene);
    const Rendering plain = render(device(), scene, with(parameters, Baselines::off, 6)),
                    quiet = render(device(), scene, with(parameters, Baselines::on, 6));
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      const double ratio = std::pow(plain.derivatives[i].stderr_of_mean[0] / quiet.derivatives[i].stderr_of_mean[0], 2);
      INFO(name << ", " << parameters[i] << ": variance " << ratio << " times lower");
      // No density that is used depends on the others: they gain from roulette alone.
      const std::string kind = find_parameter(list_parameters(scene), parameters[i]).member;
      const bool sampled = kind == "sigma_t" || kind == "g" || kind == "alpha";
      CHECK(ratio > (sampled ? least : 1.0));
    }
  }
}

TEST_CASE("a renderer given another material renders the bits of a new one, derivatives too", "[derivative]") {
  Scene scene = load_scene(test_scene("mitsuba/rough_ggx.xml"));
  const RenderOptions options = with(quiet_parameters(scene), Baselines::automatic, 7);
  Renderer renderer(device(), scene, options);
  renderer.render(0, 2);
  scene.media[0].set("sigma_t", 12);
  scene.media[0].set("albedo", 0.97);
  renderer.replace(scene);
  const Rendering replaced = renderer.render(2, 2), anew = Renderer(device(), scene, options).render(2, 2);
  CHECK(replaced.mean == anew.mean);
  for (std::size_t i = 0; i < options.derivatives.size(); ++i) {
    INFO(options.derivatives[i]);
    CHECK(replaced.derivatives[i].mean == anew.derivatives[i].mean);
  }
}

TEST_CASE("a table of expected futures learns what paths gather from a state on") {
  // Two throughput channels stand for two of radiance; a path of weight w gathers 3 w and 5 w after cell 1, which it
  // visits having gathered 1 and 2.
  BaselineTable table(2, 3, 3);
  for (const float w : {0.5F, 2.0F}) {
    const std::vector<float> sample{1 + 3 * w, 2 + 5 * w, 0, /* a derivative */ 9, 9, 9};
    std::vector<float> visits(BASELINE_VISITS * BASELINE_VISIT_SIZE(3, 3));
    const std::vector<float> visit{std::bit_cast<float>(2), w, w, w, 1, 2, 0};
    std::copy(visit.begin(), visit.end(), visits.begin() + 4 * static_cast<int>(visit.size()));
    table.add(sample, 6, visits);
  }
  CHECK(table.futures() == std::vector<float>{0, 0, 0, 3, 5, 0});
}
