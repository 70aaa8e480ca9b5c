// Images and derivatives where numbers of a scene are at the edges of their ranges or next to them: finite, or refused
// by name.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <utility>

#include "../support/z_test.h"
#include "itn/error.h"
#include "itn/parameters.h"
#include "transport.h"

using namespace itn;
using namespace itn::test;

namespace {

Scene small_scene(const std::string& name) {
  Scene scene = load_scene(test_scene("mitsuba/" + name + ".xml"));
  Sensor& sensor = scene.sensors[0];
  sensor.width = sensor.height = sensor.crop_width = sensor.crop_height = 12;
  for (Bsdf& bsdf : scene.bsdfs)
    if (bsdf.model && bsdf.values[0].bitmap) {
      bsdf.value("reflectance") = {};
      bsdf.value("reflectance").value = {0.7, 0.3, 0.2};
    }
  return scene;
}

// The ends of the range, and what is so near to them that single precision rounds it there.
std::vector<double> edges(const Parameter& p) {
  const double width = std::isinf(p.high) ? 1 : p.high - p.low;
  std::vector<double> values{p.low, p.low + 1e-300, p.low + 1e-40 * width, p.low + 1e-30 * width};
  for (const double share : {1e-9, 1e-7, 1e-4}) {
    values.push_back(p.low + share * width);
    if (!std::isinf(p.high)) values.push_back(p.high - share * width);
  }
  if (std::isinf(p.high))
    for (const double large : {1e4, 1e9}) values.push_back(large);
  else
    values.push_back(p.high);
  if (p.member == "sigma_t" || p.member == "scale") values.insert(values.end(), {1e25, 1e300});
  if (p.member == "int_ior" || p.member == "ext_ior") values.insert(values.end(), {1, 1.00005, 1.33, 1.33 + 1e-8});
  values.erase(std::remove_if(values.begin(), values.end(), [&](double v) { return !p.contains(v); }), values.end());
  return values;
}

bool finite(const Image& image) {
  const auto good = [](auto x) { return std::isfinite(x); };
  return std::all_of(image.mean.begin(), image.mean.end(), good) &&
         std::all_of(image.stderr_.begin(), image.stderr_.end(), good);
}

// The image and its derivatives by all numbers that are not refused.
void check_at(const std::string& name, const Scene& scene, const Parameter& p, double value, int spp) {
  Scene at = scene;
  set_parameter(at, p, value);
  RenderOptions options;
  options.spp = spp;
  options.seed = 9;
  std::string refused;
  for (const Parameter& q : list_parameters(at)) {
    if (q.not_differentiable.empty()) {
      options.derivatives.push_back(q.name);
      continue;
    }
    refused += " " + q.name;
    RenderOptions alone;
    alone.derivatives = {q.name};
    CHECK_THROWS_WITH(render(device(), at, alone), Catch::Contains(q.name) && Catch::Contains(q.not_differentiable));
  }
  INFO(name << ", " << p.name << " = " << value << ", refused:" << refused);
  const Rendering image = render(device(), at, options);
  CHECK(finite(image));
  for (std::size_t k = 0; k < options.derivatives.size(); ++k) {
    INFO("derivative by " << options.derivatives[k]);
    CHECK(finite(image.derivatives[k]));
  }
}

}  // namespace

TEST_CASE("at the edges of its range no number makes an image or a derivative that is not finite", "[.edges]") {
  const std::string name = GENERATE("sunsky_rough_floor", "rough_ggx", "rgb_sigma_t_null");
  const Scene scene = small_scene(name);
  for (const Parameter& p : list_parameters(scene))
    for (const double value : edges(p)) check_at(name, scene, p, value, 4);
}

// RGB sigma_t: a light connection evaluates the peak of the phase function where rounding puts the cosine, and a
// channel with a small sigma_t shares its paths with one whose mean free path is below the rounding of positions.
TEST_CASE(
    "neither the sharpest phase function nor the densest medium makes an image or a derivative that is not finite") {
  const std::string name = "rgb_sigma_t_null";
  const Scene scene = small_scene(name);
  const auto check = [&](const std::string& parameter, const std::vector<double>& values) {
    const Parameter p = find_parameter(list_parameters(scene), parameter);
    for (const double value : values) check_at(name, scene, p, value, 64);
  };
  check("hg0.g", {-0.999999, -0.9999, 0.9999, 0.999999, 1 - 1e-12});
  check("smoke.scale", {1e5, 1e9, 1e20});
  check("smoke.sigma_t.R", {1e9});
  check("smoke.sigma_t.B", {1e-20, 1e9});
}

// If mean free paths are below the rounding of positions, images are off by some percent whatever sigma_t is given
// as (kernels/README.md).
TEST_CASE("the channels of a medium with RGB sigma_t look as with their sigma_t alone, however dense it is") {
  Scene scene = small_scene("rgb_sigma_t_null");
  const auto [scale, allowed] = GENERATE(std::pair{1e4, 0.0}, std::pair{1e9, 0.1});
  scene.media[0].set("scale", scale);
  RenderOptions options;
  options.spp = 512;
  const Rendering together = render(device(), scene, options);
  const Rgb sigma_t = scene.media[0].colour("sigma_t");
  options.seed = 1;
  for (std::size_t c = 0; c < 3; ++c) {
    scene.media[0].set("sigma_t", sigma_t[c]);
    const Rendering alone = render(device(), scene, options);
    const double difference = std::abs(together.mean_of_image[c] - alone.mean_of_image[c]),
                 error = std::hypot(together.stderr_of_mean[c], alone.stderr_of_mean[c]);
    INFO("scale " << scale << ", channel " << c << ", alone " << alone.mean_of_image[c] << ", difference " << difference
                  << ", its standard error " << error);
    CHECK(difference < allowed * alone.mean_of_image[c] + largest_z_bound(6, 0.0027) * error);
  }
}
