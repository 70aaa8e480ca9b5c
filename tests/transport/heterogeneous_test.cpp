// A heterogeneous medium whose grid is the same everywhere is the homogeneous medium: image, every derivative,
// gradients by replay; with matched and rough boundaries, a sun, lamps, a grey and an RGB sigma_t.
#include <algorithm>
#include <catch2/catch.hpp>
#include <memory>

#include "../support/z_test.h"
#include "itn/gradient_renderer.h"
#include "itn/parameters.h"
#include "runtime/scene/transform.h"
#include "transport.h"

using namespace itn;
using namespace itn::test;

namespace {

constexpr double significance = 1e-4;
constexpr std::size_t tests = 100;

// All media of the scene from grids of one value each, in a box around everything.
Scene with_grids(Scene scene, int channels) {
  for (Medium& medium : scene.media) {
    auto grid = std::make_shared<VoxelGrid>();
    grid->width = 9;
    grid->height = 6;
    grid->depth = 5;
    grid->channels = channels;
    const Rgb sigma_t = medium.colour("sigma_t"), albedo = medium.colour("albedo");
    for (int i = 0; i < 9 * 6 * 5 * channels; ++i)
      grid->data.push_back(static_cast<float>(sigma_t[static_cast<std::size_t>(i % channels)]));
    Volume volume;
    volume.to_world = translate({-9, -9, -9}) * scale({18, 18, 18});
    volume.grid = grid;
    const double number = medium.number("scale");
    medium.become(*find_model(medium_models(), "heterogeneous"));
    medium.value("sigma_t").value = {1, 1, 1};
    medium.value("sigma_t").volume = std::make_shared<const Volume>(volume);
    medium.set("albedo", albedo);
    medium.set("scale", number);
  }
  return scene;
}

std::vector<std::string> parameters_of(const Scene& scene) {
  std::vector<std::string> names;
  for (const Parameter& p : list_parameters(scene))
    if (p.not_differentiable.empty() && p.member != "sigma_t" && !is_of_light(p)) names.push_back(p.name);
  return names;
}

void check_alike(const std::string& what, const Image& a, const Image& b) {
  for (std::size_t c = 0; c < 3; ++c) {
    double sum = 0, variance = 0;
    for (std::size_t at = c; at < a.mean.size(); at += 3) {
      sum += static_cast<double>(a.mean[at]) - static_cast<double>(b.mean[at]);
      const double e = static_cast<double>(a.stderr_[at]), f = static_cast<double>(b.stderr_[at]);
      variance += e * e + f * f;
    }
    INFO(what << ", channel " << c << ": z " << sum / std::sqrt(variance));
    if (variance == 0) continue;
    CHECK(std::abs(sum) < largest_z_bound(tests, significance) * std::sqrt(variance));
  }
}

}  // namespace

TEST_CASE("a grid of one value is the homogeneous medium, with all derivatives (z-test)", "[derivative][stat]") {
  for (const auto& [name, channels] :
       {std::pair<const char*, int>{"sunsky_rough_floor", 1}, {"rgb_sigma_t_null", 3}, {"lights_medium", 3}}) {
    const Scene same = load_scene(test_scene("mitsuba/" + std::string(name) + ".xml"));
    const Scene grids = with_grids(same, channels);
    const std::vector<std::string> parameters = parameters_of(grids);
    RenderOptions options = one_lane();
    options.derivatives = parameters;
    options.spp = 256;
    options.seed = 3;
    const Rendering a = render(device(), same, options);
    options.seed = 4;
    const Rendering b = render(device(), grids, options);
    check_alike(name, a, b);
    for (std::size_t i = 0; i < parameters.size(); ++i)
      check_alike(std::string(name) + " by " + parameters[i], a.derivatives[i], b.derivatives[i]);
  }
}

TEST_CASE("media with and without grids lie inside each other", "[stat]") {
  // nested: one medium of several gets a grid
  const Scene same = load_scene(test_scene("mitsuba/nested.xml"));
  Scene mixed = with_grids(same, 1);
  mixed.media.back() = same.media.back();
  RenderOptions options = one_lane();
  options.spp = 512;
  options.seed = 3;
  options.derivatives = parameters_of(mixed);
  const Rendering a = render(device(), same, options);
  options.seed = 4;
  const Rendering b = render(device(), mixed, options);
  check_alike("nested", a, b);
  for (std::size_t i = 0; i < options.derivatives.size(); ++i)
    check_alike("nested by " + options.derivatives[i], a.derivatives[i], b.derivatives[i]);
}

TEST_CASE("grids: schedules, launches and widths", "[determinism]") {
  for (const char* name : {"grid_rgb", "grid_inside"}) {
    const Scene scene = load_scene(test_scene("mitsuba/" + std::string(name) + ".xml"));
    RenderOptions options = one_lane();
    options.spp = 16;
    options.derivatives = parameters_of(scene);
    const Rendering whole = render(device(), scene, options);
    RenderOptions staged = options, small = options, wide = options;
    staged.schedule = Schedule::staged;
    small.paths_a_launch = 777;
    wide.width = 0;  // the device's own
    wide.seed = 9;
    for (const RenderOptions& other : {staged, small}) {
      const Rendering again = render(device(), scene, other);
      CHECK(again.mean == whole.mean);
      for (std::size_t i = 0; i < options.derivatives.size(); ++i)
        CHECK(again.derivatives[i].mean == whole.derivatives[i].mean);
    }
    check_alike(name, whole, render(device(), scene, wide));
  }
}
