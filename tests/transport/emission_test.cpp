// Derivatives by the light: radiance is linear in them, which gives identities between images of the same paths.
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <tuple>

#include "../support/z_test.h"
#include "itn/parameters.h"
#include "transport.h"

using namespace itn;
using namespace itn::test;

namespace {

// Numbers of the light, in the order of the list.
std::vector<Parameter> light_parameters(const Scene& scene) {
  std::vector<Parameter> result;
  for (const Parameter& p : list_parameters(scene))
    if (is_of_light(p) && !p.has_values()) result.push_back(p);
  return result;
}

Rendering differentiated(const Scene& scene, const std::vector<Parameter>& by, Operator op = Operator::full,
                         int width = 1) {
  RenderOptions options;
  options.spp = 32;
  options.seed = 3;
  options.op = op;
  options.width = width;
  for (const Parameter& p : by) options.derivatives.push_back(p.name);
  return render(device(), scene, options);
}

bool is_scale(const Parameter& p) { return p.member == "scale" || p.member == "sun_scale" || p.member == "sky_scale"; }

// The sum of value * derivative over those of the parameters is the image, pixel by pixel.
void check_linear(
    const Rendering& image, const std::vector<Parameter>& parameters,
    const std::function<bool(const Parameter&)>& taken = [](const Parameter&) { return true; }) {
  double largest = 0, off = 0;
  for (std::size_t i = 0; i < image.mean.size(); ++i) {
    double sum = 0, size = 0;
    for (std::size_t k = 0; k < parameters.size(); ++k) {
      if (!taken(parameters[k])) continue;
      const double term = parameters[k].value * static_cast<double>(image.derivatives[k].mean[i]);
      sum += term;
      size += std::abs(term);
    }
    largest = std::max(largest, size);
    off = std::max(off, std::abs(sum - static_cast<double>(image.mean[i])) / (size + 1e-3));
  }
  CHECK(largest > 0.01);
  CHECK(off < 1e-5);  // single precision
}

Scene scene_of(const std::string& name) { return load_scene(test_scene("mitsuba/" + name + ".xml")); }

}  // namespace

TEST_CASE("radiance times the derivative by it is the image of a constant light", "[transport]") {
  for (const auto& [name, op, luminance] : {std::tuple{"null_constant", Operator::full, false},
                                            {"null_constant", Operator::single, true},
                                            {"nested", Operator::full, true}}) {
    INFO(name);
    Scene scene = scene_of(name);
    scene.sensors[0].luminance = luminance;
    check_linear(differentiated(scene, light_parameters(scene), op), light_parameters(scene));
    if (op == Operator::single) continue;
    scene.environment->set("radiance", 0.3);  // one parameter, and one channel where the scene is grey
    REQUIRE(light_parameters(scene).size() == 1);
    check_linear(differentiated(scene, light_parameters(scene), op), light_parameters(scene));
  }
}

TEST_CASE("colours times the derivatives by them add up to the image of several lights", "[transport]") {
  for (const char* name : {"lights_medium", "lights_surfaces", "lights_rough", "lights_textured"}) {
    INFO(name);
    const Scene scene = scene_of(name);
    std::vector<Parameter> linear = light_parameters(scene);
    std::erase_if(linear, [](const Parameter& p) {
      return p.member == "turbidity" || p.member == "albedo" || !p.not_differentiable.empty();
    });
    check_linear(differentiated(scene, linear), linear);
  }
}

TEST_CASE("a component of the radiance changes its own channel only", "[transport]") {
  const Scene scene = scene_of("null_constant");
  const auto parameters = light_parameters(scene);
  REQUIRE(parameters.size() == 3);
  const Rendering image = differentiated(scene, parameters);
  for (std::size_t k = 0; k < 3; ++k) {
    double others = 0;
    for (std::size_t i = 0; i < image.mean.size(); ++i)
      if (i % 3 != k) others = std::max(others, std::abs(static_cast<double>(image.derivatives[k].mean[i])));
    CHECK(others == 0);
    CHECK(image.derivatives[k].mean_of_image[k] > 0);
  }
}

TEST_CASE("scale times the derivative by it is the image under an environment map", "[transport]") {
  for (const auto& [name, op] : {std::pair{"null_envmap", Operator::full}, {"hide_emitters", Operator::single}}) {
    INFO(name);
    Scene scene = scene_of(name);
    scene.environment->set("scale", 0.7);
    check_linear(differentiated(scene, light_parameters(scene), op), light_parameters(scene));
  }
}

TEST_CASE("sun and sky: their scales times the derivatives by these add up to the image", "[transport]") {
  for (const auto& [name, op] : {std::pair{"sunsky_null_floor", Operator::single},
                                 {"sunsky_rough_floor", Operator::full},
                                 {"rgb_sigma_t_null", Operator::full}}) {
    INFO(name);
    Scene scene = scene_of(name);
    scene.environment->sun.complex = op == Operator::single;
    scene.environment->set("sun_scale", 0.6);
    check_linear(differentiated(scene, light_parameters(scene), op), light_parameters(scene), is_scale);
  }
}

TEST_CASE("light that is off has the derivative of light that is on", "[transport][stat]") {
  SECTION("constant: of the same paths") {
    Scene scene = scene_of("null_constant");
    scene.environment->set("radiance", 1);
    const Rendering on = differentiated(scene, light_parameters(scene));
    scene.environment->set("radiance", 0);
    const Rendering off = differentiated(scene, light_parameters(scene));
    CHECK(off.mean_of_image[1] == 0);
    CHECK(off.derivatives[0].mean == on.mean);
  }
  SECTION("environment map, sun and sky: of other paths, since light is sampled where it is") {
    for (const char* name : {"null_envmap", "sunsky_rough_floor"}) {
      Scene scene = scene_of(name);
      const auto parameters = light_parameters(scene);
      const Rendering on = differentiated(scene, parameters);
      for (const Parameter& p : parameters)
        if (is_scale(p)) set_parameter(scene, p, 0);
      const Rendering off = differentiated(scene, parameters);
      for (std::size_t k = 0; k < parameters.size(); ++k) {
        const Image &a = on.derivatives[k], &b = off.derivatives[k];
        for (std::size_t c = 0; c < 3; ++c) {
          INFO(name << ", " << parameters[k].name << ", channel " << c);
          CHECK(off.mean_of_image[c] == 0);
          CHECK(std::isfinite(b.stderr_of_mean[c]));
          if (!is_scale(parameters[k]))
            CHECK(b.mean_of_image[c] == 0);  // nothing there to change
          else
            CHECK(std::abs(a.mean_of_image[c] - b.mean_of_image[c]) <
                  4 * std::hypot(a.stderr_of_mean[c], b.stderr_of_mean[c]));
        }
      }
    }
  }
}

TEST_CASE("derivatives by the light leave the image and other derivatives as they are", "[transport]") {
  const Scene scene = scene_of("sunsky_rough_floor");
  std::vector<Parameter> all, others;
  for (const Parameter& p : list_parameters(scene)) {
    if (!p.not_differentiable.empty()) continue;
    all.push_back(p);
    if (!is_of_light(p)) others.push_back(p);
  }
  std::reverse(all.begin(), all.end());  // the light first
  const Rendering with = differentiated(scene, all), without = differentiated(scene, others);
  CHECK(with.mean == without.mean);
  for (std::size_t k = 0; k < others.size(); ++k) {
    INFO(others[k].name);
    CHECK(with.derivatives[all.size() - 1 - k].mean == without.derivatives[k].mean);
  }
}

TEST_CASE("derivatives by the light agree between widths", "[transport][stat]") {
  const Scene scene = scene_of("sunsky_rough_floor");
  const auto parameters = light_parameters(scene);
  const Rendering narrow = differentiated(scene, parameters, Operator::full, 1),
                  wide = differentiated(scene, parameters, Operator::full, 0);
  for (std::size_t k = 0; k < parameters.size(); ++k)
    for (std::size_t c = 0; c < 3; ++c) {
      INFO(parameters[k].name << ", channel " << c);
      const Image &a = narrow.derivatives[k], &b = wide.derivatives[k];
      CHECK(std::abs(a.mean_of_image[c] - b.mean_of_image[c]) <=
            0.2 * a.stderr_of_mean[c] + 1e-6 * std::abs(a.mean_of_image[c]));
    }
}
