#include "tools/itn/target_options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <numeric>

#include "itn/error.h"
#include "runtime/base/ranks.h"

namespace itn::tools {

void add_target_options(CLI::App& command, TargetOptions& options) {
  command
      .add_option("--target", options.targets,
                  "Image to compare with: OpenEXR of the film's size, with standard errors (stderr.R ...) where known, "
                  "or a photo (PNG, JPEG, TIFF); repeated: one per sensor")
      ->required()
      ->take_all();
  command
      .add_option(
          "--mask", options.masks,
          "Weights of the target's pixels, 0 to 1: OpenEXR (channel Y, R or else the first), or PNG and the like "
          "(grey or red); one per target")
      ->take_all();
  command.add_option("--sensor", options.sensors, "Sensor of each target, from 0; default: in their order")
      ->check(CLI::Range(0, 1 << 20))
      ->take_all();
  add_size_option(command, options.size);
  add_photo_options(command, options.photo);
  group_options(command, "Targets", {"--target", "--mask", "--sensor", "--size"});
}

void add_curve_option(CLI::App& command, TransferCurve& curve) {
  command
      .add_option_function<std::string>(
          "--curve", [&curve](const std::string& text) { curve = transfer_curve(text); },
          "Transfer curve of photos: srgb, linear, an exponent such as 2.2, or auto (linear for TIFF of 16 bits, else "
          "srgb)")
      ->type_name("CURVE")
      ->default_str("auto")
      ->group("Photos");
}

void add_photo_options(CLI::App& command, PhotoOptions& options) {
  add_curve_option(command, options.curve);
  command
      .add_option("--saturation", options.saturation,
                  "Leave out pixels with a sample from this fraction of the file's range on; where the sensor "
                  "saturates below that range, give that end")
      ->check(CLI::Range(1e-3, 2.0))
      ->capture_default_str()
      ->group("Photos");
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
                                 sensor.crop_height, sensor.luminance ? 1 : 3, options.photo));
  }
  return images;
}

void print_notes(const CommonOptions& common, const std::vector<TargetImage>& targets, bool factor_known) {
  if (!common.talkative() || !world().is_first()) return;
  for (const TargetImage& target : targets)
    if (!target.note.empty())
      fmt::print("{}{}\n", target.note, factor_known ? "; taken for radiance as it is (--exposure)" : "");
}

void add_noise_option(CLI::App& command, std::optional<double>& relative) {
  command
      .add_option(
          "--noise", relative,
          "Standard deviation of the targets' noise relative to radiance, beside what their files say; default: "
          "measured in the image, where its file says nothing")
      ->check(CLI::Range(0.0, 10.0));
}

TargetNoise settle_noise(const CommonOptions& common, std::vector<TargetImage>& targets,
                         const std::optional<double>& relative) {
  TargetNoise noise = itn::settle_noise(targets, relative);
  if (!noise.known && common.talkative() && world().is_first())
    fmt::print(
        "the targets do not say their noise (stderr.Y or stderr.R ..., --noise): measured in them, {:.2g} % (median)\n",
        100 * noise.measured);
  return noise;
}

}  // namespace itn::tools
