// Derivatives where numbers of a scene are at the edges of their ranges or next to them: finite, or refused by name.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "runtime/error.h"
#include "runtime/scene/parameters.h"
#include "transport.h"

using namespace itn;
using namespace itn::test;

namespace {

Scene small_scene(const std::string& name) {
  Scene scene = load_scene(test_scene("mitsuba/" + name + ".xml"));
  Sensor& sensor = scene.sensors[0];
  sensor.width = sensor.height = sensor.crop_width = sensor.crop_height = 12;
  for (Bsdf& bsdf : scene.bsdfs)
    if (bsdf.reflectance.bitmap) {
      bsdf.reflectance = {};
      bsdf.reflectance.value = {0.7, 0.3, 0.2};
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
  if (p.kind == ParameterKind::int_ior || p.kind == ParameterKind::ext_ior)
    values.insert(values.end(), {1, 1.00005, 1.33, 1.33 + 1e-8});
  values.erase(std::remove_if(values.begin(), values.end(), [&](double v) { return !p.contains(v); }), values.end());
  return values;
}

bool finite(const Image& image) {
  const auto good = [](auto x) { return std::isfinite(x); };
  return std::all_of(image.mean.begin(), image.mean.end(), good) &&
         std::all_of(image.stderr_.begin(), image.stderr_.end(), good);
}

}  // namespace

TEST_CASE("at the edges of its range no number makes an image or a derivative that is not finite", "[.edges]") {
  const std::string name = GENERATE("sunsky_rough_floor", "rough_ggx");
  const Scene scene = small_scene(name);
  const Device& on = device();
  for (const Parameter& p : list_parameters(scene))
    for (const double value : edges(p)) {
      Scene at = scene;
      set_parameter(at, p, value);
      RenderOptions options;
      options.spp = 4;
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
        CHECK_THROWS_WITH(render(on, at, alone), Catch::Contains(q.name) && Catch::Contains(q.not_differentiable));
      }
      INFO(name << ", " << p.name << " = " << value << ", refused:" << refused);
      const Rendering image = render(on, at, options);
      CHECK(finite(image));
      for (std::size_t k = 0; k < options.derivatives.size(); ++k) {
        INFO("derivative by " << options.derivatives[k]);
        CHECK(finite(image.derivatives[k]));
      }
    }
}
