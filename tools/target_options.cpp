#include "tools/target_options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <numeric>

#include "runtime/base/error.h"

namespace itn::tools {

void add_target_options(CLI::App& command, TargetOptions& options) {
  command
      .add_option(
          "--target", options.targets,
          "OpenEXR image to compare with, of the film's size, with standard errors (stderr.R ...) where they are "
          "known; repeated: one for each of several sensors")
      ->required()
      ->take_all();
  command
      .add_option("--mask", options.masks,
                  "OpenEXR file whose Y, R or else first channel weighs the target's pixels; one a target")
      ->take_all();
  command.add_option("--sensor", options.sensors, "the sensor of each target, from 0; default: in their order")
      ->check(CLI::Range(0, 1 << 20))
      ->take_all();
  add_size_option(command, options.size);
}

std::vector<TargetImage> read_targets(TargetOptions& options, const Scene& scene) {
  const std::size_t count = options.targets.size();
  if (options.sensors.empty()) {
    options.sensors.resize(count);
    std::iota(options.sensors.begin(), options.sensors.end(), 0);
  }
  if (options.sensors.size() != count)
    throw UsageError(fmt::format("{} --sensor and {} --target; need one sensor for each target, or none at all",
                                 options.sensors.size(), count));
  if (!options.masks.empty() && options.masks.size() != count)
    throw UsageError(fmt::format("{} --mask and {} --target; need one mask for each target, or none at all",
                                 options.masks.size(), count));
  std::vector<TargetImage> images;
  for (std::size_t t = 0; t < count; ++t) {
    const Sensor& sensor = chosen_sensor(scene, options.sensors[t]);
    images.push_back(read_target(options.targets[t], options.masks.empty() ? "" : options.masks[t], sensor.crop_width,
                                 sensor.crop_height, sensor.luminance ? 1 : 3));
  }
  return images;
}

bool errors_known(const std::vector<TargetImage>& targets) {
  return std::all_of(targets.begin(), targets.end(), [](const TargetImage& t) { return !t.error.empty(); });
}

double relative_noise(double given, const std::vector<TargetImage>& targets) {
  constexpr double assumed_noise = 0.01;  // where nobody says
  return given >= 0 ? given : errors_known(targets) ? 0 : assumed_noise;
}

}  // namespace itn::tools
