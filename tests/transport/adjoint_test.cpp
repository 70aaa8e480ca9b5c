// Gradients by path replay (kernels/derivative/adjoint.h) against derivative images from the same samples.
#include <catch2/catch.hpp>
#include <limits>

#include "itn/error.h"
#include "itn/gradient_renderer.h"
#include "itn/parameters.h"
#include "runtime/inverse/image_loss.h"
#include "transport.h"

using namespace itn;
using namespace itn::test;

namespace {

Scene scene_of(const std::string& name) { return load_scene(test_scene("mitsuba/" + name + ".xml")); }

bool of_light(const Scene& scene, const std::string& name) {
  return is_of_light(find_parameter(list_parameters(scene), name));
}

// By all that the image can be differentiated by.
RenderOptions by_all(const Scene& scene) {
  RenderOptions options = one_lane();
  options.seed = 3;
  options.baselines = Baselines::on;
  for (const Parameter& p : list_parameters(scene))
    if (p.not_differentiable.empty()) options.derivatives.push_back(p.name);
  return options;
}

// Brighter and darker than the image, by pixel and channel.
TargetImage uneven_target(const Sensor& sensor) {
  const auto pixels = static_cast<std::size_t>(sensor.crop_width * sensor.crop_height);
  const int channels = sensor.luminance ? 1 : 3;
  TargetImage target{sensor.crop_width,
                     sensor.crop_height,
                     channels,
                     std::vector<float>(pixels * static_cast<std::size_t>(channels)),
                     std::vector<float>(pixels),
                     {}};
  for (std::size_t i = 0; i < target.value.size(); ++i) target.value[i] = 0.2F + 0.1F * static_cast<float>(i % 7);
  for (std::size_t i = 0; i < pixels; ++i) target.weight[i] = static_cast<float>(i % 3);
  return target;
}

LossGradient by_images(const Scene& scene, const RenderOptions& options, int spp, double exposure = 1) {
  Renderer renderer(device(), scene, options);
  std::vector<Rendering> groups;
  int first = 0;
  for (const int samples : split_samples(spp)) {
    groups.push_back(renderer.render(first, samples));
    first += samples;
  }
  return loss_gradient(groups, uneven_target(scene.sensors[0]), exposure);
}

WeighedDerivatives by_replay(const Device& on, const Scene& scene, const RenderOptions& options, int spp,
                             double exposure = 1) {
  const TargetImage target = uneven_target(scene.sensors[0]);
  return GradientRenderer(on, scene, options).render(0, split_samples(spp), [&](const std::vector<Rendering>& groups) {
    return loss_weights(groups, target, exposure);
  });
}

void check_same(const Scene& scene, const RenderOptions& options, int spp, double exposure = 1) {
  const LossGradient images = by_images(scene, options, spp, exposure);
  const WeighedDerivatives replay = by_replay(device(), scene, options, spp, exposure);
  for (std::size_t p = 0; p < options.derivatives.size(); ++p) {
    INFO(options.derivatives[p] << ": images " << images.gradient[p] << " +- " << images.gradient_stderr[p]
                                << ", replay " << replay.value[p] << " +- " << replay.stderr_[p]);
    // single precision: of each pixel's mean here, of each product there
    CHECK(std::abs(replay.value[p] - images.gradient[p]) < 2e-5 * images.gradient_stderr[p]);
  }
}

void check_scenes(const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    INFO(name);
    const Scene scene = scene_of(name);
    check_same(scene, by_all(scene), 8);
  }
}

}  // namespace

TEST_CASE("a gradient's scene may be replaced by one that needs another program", "[derivative]") {
  const Scene scene = scene_of("null_constant");
  const std::string albedo = scene.media[0].id + ".albedo";
  RenderOptions options = one_lane();
  options.derivatives = {albedo};
  // from where baselines do not pay to where they do
  Scene dark = scene, bright = scene;
  set_parameter(dark, find_parameter(list_parameters(scene), albedo), 0.7);
  set_parameter(bright, find_parameter(list_parameters(scene), albedo), 0.9);
  const TargetImage target = uneven_target(scene.sensors[0]);
  const GroupWeights weights = [&](const std::vector<Rendering>& groups) { return loss_weights(groups, target); };
  GradientRenderer renderer(device(), dark, options);
  const double before = renderer.render(0, split_samples(4), weights).value[0];
  renderer.replace(bright);
  CHECK(renderer.render(0, split_samples(4), weights).value ==
        GradientRenderer(device(), bright, options).render(0, split_samples(4), weights).value);
  renderer.replace(dark);
  CHECK(renderer.render(0, split_samples(4), weights).value[0] == before);
}

TEST_CASE("replayed paths give the gradient of derivative images from the same samples", "[derivative]") {
  // Matched and rough boundaries, colours by sigma_t, a sun through boundaries, lights of the scene.
  check_scenes({"sunsky_rough_floor", "rgb_sigma_t"});
  // chosen directions and drawn ones, numbers that are integrals, several lights
  for (const auto& [name, parameters] :
       {std::pair<const char*, std::vector<std::string>>{
            "principled",
            {"lacquer.clearcoat_gloss", "glass.spec_trans", "leaf.diff_trans", "gilt.color0", "worn.color1"}},
        {"mixtures",
         {"haze.weight", "drops.weight", "halo.value_3", "peak.g", "soot.weight", "backward.g", "air.sigma_t"}},
        {"lights_rough",
         {"jelly.sigma_t", "roughdielectric0.alpha", "diffuse0.reflectance", "spot0.intensity.R", "area0.radiance.B",
          "sunsky0.sun_scale"}}}) {
    INFO(name);
    const Scene scene = scene_of(name);
    RenderOptions by_some = by_all(scene);
    by_some.derivatives = parameters;
    check_same(scene, by_some, 8);
  }
  const Scene scene = scene_of("null_constant");
  RenderOptions plain = by_all(scene);
  plain.baselines = Baselines::off;
  check_same(scene, plain, 8);
}

// Two programs of some 30 derivatives for each: minutes of compilation.
TEST_CASE("replayed paths give the gradient of derivative images in more scenes", "[.replay]") {
  check_scenes({"null_constant", "checkerboard", "rough_ggx", "sunsky_null_floor", "camera_inside", "nested",
                "lights_rough", "rough_textures", "lights_surfaces", "lights_textured", "grid_rough", "grid_rgb",
                "grid_inside"});
  for (const auto& [name, parameters] :
       {std::pair<const char*, std::vector<std::string>>{
            "tabulated", {"haze.value_3", "haze.value_10", "halo.value_0", "smoke.sigma_t"}},
        {"mirrors", {"gold.eta.R", "gold.k.G", "pane.int_ior"}},
        {"plastics", {"matt.alpha", "plate.int_ior", "squares.color1.G", "glaze.alpha"}}}) {
    INFO(name);
    const Scene scene = scene_of(name);
    RenderOptions by_some = by_all(scene);
    by_some.derivatives = parameters;
    check_same(scene, by_some, 8);
  }
  Scene dust = scene_of("rayleigh");
  for (Medium& medium : dust.media) {
    medium.phase.become(*find_model(phase_models(), "draine"));
    medium.phase.set("alpha", 5);
  }
  check_same(dust, by_all(dust), 8);
}

TEST_CASE("by a g that media share the derivative is the sum of those by each medium's own", "[derivative]") {
  Scene own = scene_of("nested");
  for (Medium& medium : own.media) {
    medium.phase.become(*find_model(phase_models(), "hg"));
    medium.phase.set("g", 0.4);
  }
  Scene shared = own;
  for (Medium& medium : shared.media) medium.phase.id = "haze";
  RenderOptions by_each = one_lane(), by_shared = one_lane();
  by_each.baselines = by_shared.baselines = Baselines::on;
  for (const Medium& medium : own.media) by_each.derivatives.push_back(medium.phase.id + ".g");
  by_shared.derivatives = {"haze.g", shared.media[0].id + ".sigma_t"};
  check_same(shared, by_shared, 8);
  const Rendering each = Renderer(device(), own, by_each).render(0, 8);
  const Rendering together = Renderer(device(), shared, by_shared).render(0, 8);
  std::size_t touched = 0;
  for (std::size_t i = 0; i < each.mean.size(); ++i) {
    double sum = 0, size = 0;
    for (const auto& image : each.derivatives) {
      sum += static_cast<double>(image.mean[i]);
      size += std::fabs(static_cast<double>(image.mean[i]));
    }
    touched += size > 0;
    REQUIRE(static_cast<double>(together.derivatives[0].mean[i]) == Approx(sum).margin(1e-4 * size + 1e-7));
  }
  CHECK(touched > each.mean.size() / 4);
}

TEST_CASE("replay: operator single, the device's lanes, luminance, exposure", "[derivative]") {
  Scene scene = scene_of("sunsky_rough_floor");
  RenderOptions options = by_all(scene);
  const std::string variant = GENERATE("single", "the device's lanes", "luminance");
  CAPTURE(variant);
  if (variant == "single") options.op = Operator::single;
  if (variant == "the device's lanes") options.width = 0;
  if (variant == "luminance") scene.sensors[0].luminance = true;
  check_same(scene, options, 6, 1.3);
}

TEST_CASE("replay: launches, schedules and memory change no bit of a gradient", "[derivative]") {
  const Scene scene = scene_of("sunsky_rough_floor");
  const RenderOptions options = by_all(scene);
  const WeighedDerivatives whole = by_replay(device(), scene, options, 12);
  RenderOptions small = options, staged = options;
  small.paths_a_launch = 777;
  staged.schedule = Schedule::staged;
  CHECK(by_replay(device(), scene, small, 12).value == whole.value);
  const WeighedDerivatives in_stages = by_replay(device(), scene, staged, 12);
  CHECK(in_stages.value == whole.value);
  CHECK(in_stages.stderr_ == whole.stderr_);
  // Samples do not fit and are traced again.
  std::uint64_t used = 0;
  {
    const Device roomy;
    const std::uint64_t before = roomy.free_memory();
    const GradientRenderer renderer(roomy, scene, options);
    used = before - roomy.free_memory();
  }
  const std::uint64_t samples = std::min(std::uint64_t{256} << 20, device().info().max_allocation / 4);
  CHECK(by_replay(Device("", used - samples + 1200000), scene, options, 128).value ==
        by_replay(device(), scene, options, 128).value);
}

TEST_CASE("replay: memory does not grow with the number of parameters", "[derivative]") {
  const Scene scene = scene_of("camera_inside");
  RenderOptions all = by_all(scene);
  std::erase_if(all.derivatives, [&](const std::string& name) { return of_light(scene, name); });
  RenderOptions one = all;
  one.derivatives = {all.derivatives.front()};
  REQUIRE(all.derivatives.size() > 10);
  const auto used = [&](const RenderOptions& options) {
    const Device own;
    const std::uint64_t before = own.free_memory();
    const GradientRenderer renderer(own, scene, options);
    return before - own.free_memory();
  };
  CHECK(used(all) == used(one));
}

namespace {

// The mean claimed variance over the true one, of gradients of other samples each, a parameter each.
std::vector<double> claimed_over_true(const Scene& scene, const RenderOptions& options, int spp, int repeats) {
  const TargetImage target = uneven_target(scene.sensors[0]);
  GradientRenderer renderer(device(), scene, options);
  std::vector<std::vector<double>> values(options.derivatives.size());
  std::vector<double> claimed(values.size());
  for (int r = 0; r < repeats; ++r) {
    const WeighedDerivatives one =
        renderer.render(r * spp, split_samples(spp),
                        [&](const std::vector<Rendering>& groups) { return loss_weights(groups, target); });
    for (std::size_t p = 0; p < values.size(); ++p) {
      values[p].push_back(one.value[p]);
      claimed[p] += one.stderr_[p] * one.stderr_[p] / repeats;
    }
  }
  std::vector<double> ratios;
  for (std::size_t p = 0; p < values.size(); ++p) {
    double mean = 0, variance = 0;
    for (const double v : values[p]) mean += v / repeats;
    for (const double v : values[p]) variance += (v - mean) * (v - mean) / (repeats - 1);
    ratios.push_back(claimed[p] / variance);
  }
  return ratios;
}

}  // namespace

// Bounds are of four standard errors of the true variance's estimate.
TEST_CASE("replay: the standard error is that of the spread of gradients, however many samples", "[derivative][stat]") {
  Scene scene = scene_of("null_constant");
  // 128 pixels, so that many samples take little time
  scene.sensors[0].crop_x = 4;
  scene.sensors[0].crop_y = 8;
  scene.sensors[0].crop_width = 16;
  scene.sensors[0].crop_height = 8;
  RenderOptions options = by_all(scene);
  options.width = 0;
  const auto [spp, repeats] = GENERATE(table<int, int>({{4, 800}, {5, 400}, {16, 400}, {40, 200}, {512, 100}}));
  CAPTURE(spp, repeats);
  const double spread = std::sqrt(2.0 / (repeats - 1));
  const std::vector<double> ratios = claimed_over_true(scene, options, spp, repeats);
  for (std::size_t p = 0; p < ratios.size(); ++p) {
    INFO(options.derivatives[p] << ": claimed over true variance " << ratios[p]);
    CHECK(std::abs(ratios[p] - 1) < 4 * spread);
  }
}

TEST_CASE("replay: the standard error by all voxels or texels is that of the spread of gradients",
          "[derivative][stat]") {
  Scene scene = scene_of("grid_null");
  scene.sensors[0].crop_x = 4;
  scene.sensors[0].crop_y = 8;
  scene.sensors[0].crop_width = 16;
  scene.sensors[0].crop_height = 8;
  RenderOptions options;
  options.seed = 4;
  for (const Parameter& p : list_parameters(scene))
    if (p.has_values()) options.derivatives.push_back(p.name);
  REQUIRE(!options.derivatives.empty());
  for (const auto& [spp, repeats] : {std::pair{4, 300}, {64, 100}}) {
    const std::vector<double> ratios = claimed_over_true(scene, options, spp, repeats);
    for (std::size_t p = 0; p < ratios.size(); ++p) {
      INFO(options.derivatives[p] << ", " << spp << " samples: claimed over true variance " << ratios[p]);
      CHECK(std::abs(ratios[p] - 1) < 4 * std::sqrt(2.0 / (repeats - 1)));
    }
  }
}

TEST_CASE("replay: millions of equal paths are not rounded off", "[derivative]") {
  // a pixel beside the star: all paths bring the light's radiance
  Scene scene = scene_of("null_constant");
  scene.sensors[0].crop_width = scene.sensors[0].crop_height = 1;
  RenderOptions options;
  for (const Parameter& p : list_parameters(scene))
    if (is_of_light(p)) options.derivatives.push_back(p.name);
  REQUIRE(options.derivatives.size() == 3);
  const auto weights = [](const std::vector<Rendering>&) {
    return std::vector<std::vector<double>>{std::vector<double>(3, 1.0)};
  };
  const std::vector<double> found = GradientRenderer(device(), scene, options).render(0, {3 << 22}, weights).value;
  for (const double of_channel : found) CHECK(of_channel == Approx(1).epsilon(3e-7));
}

TEST_CASE("replay refuses what it cannot do, by name", "[derivative]") {
  const Scene scene = scene_of("sunsky_rough_floor");
  RenderOptions options = by_all(scene);
  GradientRenderer renderer(device(), scene, options);
  const auto bad = [](const std::vector<Rendering>& groups) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    return std::vector<std::vector<double>>(groups.size(), std::vector<double>(groups[0].mean.size(), nan));
  };
  CHECK_THROWS_AS(renderer.render(0, {2, 2}, bad), ResultError);
  const auto none = [](const std::vector<Rendering>& groups) {
    return std::vector<std::vector<double>>(groups.size(), std::vector<double>(groups[0].mean.size(), 0));
  };
  CHECK_THROWS_WITH(renderer.render(0, {2, 2}, none), Catch::Contains("derivatives by the light"));
}
