// Derivatives by every parameter of small scenes against central differences with common random numbers: z-scores of
// all of them together must look normal. In the suite some of the scenes; `test_transport "[.differences]"` takes all,
// with more samples, and prints the table of README.md.
#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cstdio>
#include <functional>

#include "../support/z_test.h"
#include "itn/parameters.h"
#include "runtime/render/derivative/difference.h"
#include "samples.h"

using namespace itn;
using namespace itn::test;

namespace {

struct Case {
  std::string
      name;  // of a scene in scenes/test/mitsuba, or ours/ and one in scenes/test/ours, and what is changed in it
  bool in_suite;
  Operator op = Operator::full;
  std::function<void(Scene&)> edit{};
  bool roulette = false;
};

// The constant colour instead of the texture of the first textured surface.
std::function<void(Scene&)> painted(const Rgb& colour) {
  return [colour](Scene& scene) {
    const auto floor = std::find_if(scene.bsdfs.begin(), scene.bsdfs.end(),
                                    [](const Bsdf& bsdf) { return bsdf.model && bsdf.values[0].bitmap; });
    floor->value("reflectance") = {};
    floor->value("reflectance").value = colour;
  };
}

// Draine's phase function in every medium, once forward, once backward.
void dusty(Scene& scene) {
  double g = 0.5;
  for (Medium& medium : scene.media) {
    medium.phase.become(*find_model(phase_models(), "draine"));
    medium.phase.set("g", g);
    medium.phase.set("alpha", 3);
    g = -g;
  }
}

std::vector<Case> cases() {
  return {
      {"null_constant", true, Operator::full, {}, true},
      {"null_constant, operator single", false, Operator::single},
      {"null_envmap", false},  // with a scale
      {"rough_ggx", false},
      {"rough_beckmann", false},
      {"rough_shading_normals", false},
      {"rayleigh, Draine's phase function", true, Operator::full, dusty},
      {"rgb_albedo", false},
      {"rgb_sigma_t", false},
      {"rgb_sigma_t_null, grey floor", true, Operator::full, painted({0.5, 0.5, 0.5})},
      {"sunsky_null_floor, red floor", false, Operator::full, painted({0.7, 0.3, 0.2})},
      {"sunsky_rough_floor, red floor", true, Operator::full, painted({0.7, 0.3, 0.2})},
      {"sunsky_rough_floor, operator single", false, Operator::single},
      {"nested", false},
      {"camera_inside", false},
      {"checkerboard", false},
      {"ours/coefficients", true},
      {"ours/dictionary", true},
      {"ours/surfaces", false},
      {"grid_null", true},
      {"grid_rough", false},
      {"grid_rgb", false},
      {"grid_inside", false},
      {"opaque_neighbours", false},
      {"orthographic", false},
      {"max_depth", false},
      {"hide_emitters", false},
      {"dielectric_constant", false},
      {"lights_medium", true},
      {"lights_rough", false},
      {"lights_surfaces", false},
      {"mirrors", false},
      {"mixtures", true},
      {"plastics", false},
      {"rough_textures", false},
  };
}

// Distance of the inner points; the outer ones are twice as far. Fourth order leaves a relative error of about the
// fourth power of step / distance to the next singularity. Contributions of fixed paths are powers of albedo and
// reflectance, so that differences of common random numbers have next to no noise: there the step is small, for no
// error. By the others paths change for good (other flights, other sides of a boundary): the noise falls as the step
// grows.
double step(const Scene& scene, const Parameter& p) {
  const double x = p.value;
  if (p.is(Owner::medium, "albedo") || p.is(Owner::bsdf, "reflectance") || p.owner == Owner::texture)
    return std::min(0.01 * x, 0.2 * (1 - x));
  // inner and outer points between the same whole numbers, where the sky has kinks
  if (p.is(Owner::environment, "turbidity")) return 0.4 * std::abs(x - std::round(x));
  if (p.is(Owner::phase, "weight")) return 0.25 * std::min(x, 1 - x);
  if (p.is(Owner::phase, "g")) return 0.15 * (1 - std::abs(x));
  if (p.member == "int_ior" || p.member == "ext_ior") {
    const Bsdf& bsdf = scene.bsdfs[static_cast<std::size_t>(p.indices.front())];
    return 0.1 * std::abs(bsdf.number("int_ior") - bsdf.number("ext_ior"));
  }
  return 0.15 * x;
}

struct Comparison {
  Estimate derivative, difference, second_order;  // second_order: what it would be from the two inner points alone
  Estimate disagreement;                          // derivative - difference, sample by sample
  double rounding = 0;                            // of the difference, from single precision
  double other_channels = 0;                      // largest |derivative| in channels that the parameter does not touch
};

// Compares the mean over the pixels and over the channels that the parameter touches.
std::vector<Comparison> compare(const Scene& scene, const std::vector<Parameter>& parameters, Operator op,
                                int samples_a_pixel) {
  std::vector<Scene> scenes{scene};
  std::vector<std::string> names;
  for (const Parameter& p : parameters) {
    names.push_back(p.name);
    for (const int k : {-2, -1, 1, 2}) scenes.push_back(moved_scene(scene, p, k * step(scene, p)));
  }
  SampledScenes sampled(scenes, names, op, std::vector<std::uint64_t>(scenes.size(), 21), Shapes::of_the_first);
  const std::size_t channels = sampled.channels(), images = sampled.images();

  std::vector<Comparison> result(parameters.size());
  int first = 0;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const Parameter& p = parameters[i];
    const double h = step(scene, p);
    Moments value, derivative, difference, second_order, disagreement;
    const int at = 1 + 4 * static_cast<int>(i);
    // Samples of its own for each parameter, so that the z-scores are independent.
    constexpr int run = 16;
    const int count = is_of_light(p) ? run : samples_a_pixel;  // by the light there is no noise
    for (int done = 0; done < count; done += run, first += run) {
      const std::vector<float> samples = sampled.trace({0, at, at + 1, at + 2, at + 3}, first, run);
      const std::size_t scene_size = samples.size() / 5, sample_size = images * channels;
      for (std::size_t s = 0; s < scene_size; s += sample_size) {
        const auto mean = [&](std::size_t which, std::size_t image) {
          double sum = 0;
          for (std::size_t c = 0; c < channels; ++c) {
            const double x = static_cast<double>(samples[which * scene_size + s + image * channels + c]);
            if (p.component < 0)
              sum += x / static_cast<double>(channels);
            else if (static_cast<int>(c) == p.component)
              sum += x;
            else if (image > 0)
              result[i].other_channels = std::max(result[i].other_channels, std::abs(x));
          }
          return sum;
        };
        const double inner = (mean(3, 0) - mean(2, 0)) / (2 * h), outer = (mean(4, 0) - mean(1, 0)) / (4 * h);
        const double fourth_order = (4 * inner - outer) / 3, d = mean(0, 1 + i);
        value.add(mean(0, 0));
        derivative.add(d);
        difference.add(fourth_order);
        second_order.add(inner);
        disagreement.add(d - fourth_order);
      }
    }
    result[i].derivative = derivative.estimate();
    result[i].difference = difference.estimate();
    result[i].second_order = second_order.estimate();
    result[i].disagreement = disagreement.estimate();
    // Rounding of float products whose factor is moved by a millionth part of the value: it shows without noise.
    result[i].rounding = 1e-6 * value.estimate().value / h;
  }
  return result;
}

void check(bool all, int samples_a_pixel) {
  std::printf("\n| scene | parameter | derivative | central difference (second order) | standard error | z |\n");
  std::printf("|---|---|---|---|---|---|\n");
  std::vector<double> z;
  for (const Case& c : cases()) {
    if (!all && !c.in_suite) continue;
    INFO(c.name);
    const std::string file = c.name.substr(0, c.name.find(',')) + ".xml";
    Scene scene = load_scene(test_scene(file.starts_with("ours/") ? file : "mitsuba/" + file));
    if (c.edit) c.edit(scene);
    if (scene.environment->type() == "sunsky")
      scene.environment->set("turbidity", scene.environment->number("turbidity") + 0.4);
    // Roulette decides otherwise once in thousands of paths as its parameters move: too rare for a standard error to be
    // known, and many in one scene.
    if (!c.roulette) scene.integrator.rr_depth = 1 << 20;
    std::vector<Parameter> parameters;
    for (const Parameter& p : list_parameters(scene))
      if (p.not_differentiable.empty()) parameters.push_back(p);
    const std::vector<Comparison> compared = compare(scene, parameters, c.op, samples_a_pixel);
    for (std::size_t i = 0; i < compared.size(); ++i) {
      const Comparison& r = compared[i];
      INFO(parameters[i].name);
      CHECK(r.other_channels == 0);
      // Nothing of the scene that light meets may stay untested.
      CHECK(r.derivative.stderr_ > 0);
      const double error = std::hypot(r.disagreement.stderr_, r.rounding);
      const double score = r.disagreement.value / error;
      if (r.rounding < 0.1 * r.disagreement.stderr_)
        z.push_back(score);
      else  // the same paths on both sides: no noise to speak of, but equality
        CHECK(std::abs(score) < 3);
      std::printf("| %s | %s | %.5f ± %.5f | %.5f (%.5f) | %.5f | %.2f |\n", c.name.c_str(), parameters[i].name.c_str(),
                  r.derivative.value, r.derivative.stderr_, r.difference.value, r.second_order.value, error, score);
      std::fflush(stdout);
    }
  }
  double largest = 0, sum = 0;
  for (const double value : z) {
    largest = std::max(largest, std::abs(value));
    sum += value * value;
  }
  const double p = chi_square_tail(sum, static_cast<int>(z.size()));
  const ZHistogram histogram = z_histogram(z, 5);
  std::printf("%zu parameters with noise: largest |z| %.2f, sum of z^2 %.1f (p = %.3g), histogram p = %.3g\n", z.size(),
              largest, sum, p, histogram.p_value);
  CHECK(largest < largest_z_bound(z.size(), 0.0027));
  CHECK(p > 1e-3);
  CHECK(1 - p > 1e-3);
  CHECK(histogram.p_value > 1e-3);
}

}  // namespace

TEST_CASE("derivatives by every parameter are those of central differences", "[transport][stat]") { check(false, 48); }

TEST_CASE("derivatives by every parameter of all scenes are those of central differences", "[.differences]") {
  check(true, 128);
}
