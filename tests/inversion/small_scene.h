// A ball of fog under a constant sky, seen in few pixels: its limb and its middle tell sigma_t, albedo and g apart.
#pragma once
#include <random>

#include "runtime/inverse/gauss_newton/inversion.h"
#include "tests/stage/scenes.h"
#include "tests/stage/stage_test.h"

namespace itn::test {

inline Scene fog_ball(double sigma_t, double albedo, double g, int pixels = 14) {
  Scene scene = sphere_scene(bsdf_of("null"), medium_of(sigma_t, albedo, g));
  scene.media[0].id = "fog";
  scene.media[0].phase.id = "phase";
  Sensor& sensor = scene.sensors[0];
  sensor.width = sensor.height = sensor.crop_width = sensor.crop_height = pixels;
  sensor.luminance = true;
  scene.environment = make_environment("sunsky");
  scene.environment->sun.direction = {0.8, -0.3, 0.52};
  scene.environment->sun.aperture = 30;
  sensor.to_world.m = {1, 0, 0, 0, 0, 0, 1, -4, 0, 1, 0, 0, 0, 0, 0, 1};
  return scene;
}

// The image with its standard error, as read_target would read it.
inline TargetImage target_of(const Rendering& image) {
  const std::size_t pixels = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  TargetImage target{image.width, image.height, 1, {}, std::vector<float>(pixels, 1.0F), {}};
  for (std::size_t i = 0; i < pixels; ++i) {
    const std::size_t at = i * static_cast<std::size_t>(image.channels);
    target.value.push_back(image.mean[at]);
    target.error.push_back(image.stderr_[at]);
  }
  return target;
}

inline TargetImage rendered_target(const Device& device, const Scene& scene, int spp, std::uint64_t seed) {
  RenderOptions options;
  options.spp = spp;
  options.seed = seed;
  return target_of(render(device, scene, options));
}

// Runs an inversion to its end.
inline Inversion::Conclusion invert(Inversion& inversion, const std::vector<double>& start) {
  InversionState state = inversion.start(start);
  while (!state.done) inversion.advance(state);
  return inversion.conclude(state);
}

}  // namespace itn::test
