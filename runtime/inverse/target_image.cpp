#include "itn/target_image.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "itn/error.h"
#include "itn/exr.h"
#include "itn/file.h"
#include "runtime/image/noise.h"
#include "runtime/image/radiance.h"
#include "runtime/image/samples.h"

namespace itn {
namespace {

std::string at_pixel(int pixel, int width) { return fmt::format("pixel ({}, {})", pixel % width, pixel / width); }

ExrImage read_sized(const std::string& file, int width, int height) {
  ExrImage image = read_exr(file);
  if (image.is_part)
    throw InputError(file +
                     ": its data window is not its display window: pixels would be compared with others; need the "
                     "whole image: save it without a crop");
  if (image.width != width || image.height != height)
    throw InputError(fmt::format("{}: {} x {} pixels, need {} x {}, the size of the sensor's film", file, image.width,
                                 image.height, width, height));
  return image;
}

std::vector<float> weights_of_picture(const std::string& mask, int width, int height) {
  const Samples samples = oriented(read_samples(read_file(mask), mask));
  Photo picture{samples.width, samples.height, 0, {}, {}, {}};
  for (std::size_t i = 0; i < samples.data.size(); i += static_cast<std::size_t>(samples.channels))
    picture.weight.push_back(static_cast<float>(samples.data[i] / 65535.0));
  return averaged_down(picture, width, height, mask).weight;
}

std::vector<float> weights_of_exr(const std::string& mask, int width, int height) {
  const ExrImage image = read_sized(mask, width, height);
  std::vector<float> weight(image.data.size() / image.channels.size());
  const std::size_t channel = static_cast<std::size_t>(std::max({image.channel("Y"), image.channel("R"), 0}));
  for (std::size_t i = 0; i < weight.size(); ++i) {
    weight[i] = image.data[i * image.channels.size() + channel];
    if (!(weight[i] >= 0 && std::isfinite(weight[i])))
      throw InputError(fmt::format("{}: {} is {}; a mask holds weights, finite and 0 or more", mask,
                                   at_pixel(static_cast<int>(i), width), weight[i]));
  }
  return weight;
}

bool nothing_weighs(const std::vector<float>& weight) {
  return std::all_of(weight.begin(), weight.end(), [](float w) { return w == 0; });
}

std::vector<float> read_weights(const std::string& mask, int width, int height) {
  if (mask.empty()) return std::vector<float>(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), 1.0F);
  std::vector<float> weight =
      is_exr(read_file(mask)) ? weights_of_exr(mask, width, height) : weights_of_picture(mask, width, height);
  if (nothing_weighs(weight)) throw InputError(mask + ": every pixel is 0, so nothing is compared; need some above 0");
  return weight;
}

// Median of noise, of the target's values, over them; 0: everything is black.
double relative_noise_of(const TargetImage& target, const std::vector<float>& noise) {
  std::vector<double> ratios;
  for (std::size_t i = 0; i < target.value.size(); ++i)
    if (target.weight[i / static_cast<std::size_t>(target.channels)] > 0 && target.value[i] > 0)
      ratios.push_back(static_cast<double>(noise[i] / target.value[i]));
  if (ratios.empty()) return 0;
  const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
  std::nth_element(ratios.begin(), middle, ratios.end());
  return *middle;
}

TargetImage target_of_photo(const std::string& file, std::vector<float> mask, int width, int height, int channels,
                            const PhotoOptions& options) {
  Photo whole = read_photo(file, options);
  if (channels == 1) whole = luminance_of(whole);
  if (whole.channels != channels) throw InputError(file + ": is grey, need colours, as the sensor's film");
  Photo photo = averaged_down(whole, width, height, file);
  for (std::size_t i = 0; i < photo.weight.size(); ++i) photo.weight[i] *= mask[i];
  if (nothing_weighs(photo.weight))
    throw InputError(file + ": every pixel is saturated, transparent or masked, so nothing is compared");
  TargetImage target{
      width, height, channels, std::move(photo.value), std::move(photo.weight), {}, std::move(photo.noise)};
  target.note = fmt::format(
      "{}: {} x {} pixels{}", file, whole.width, whole.height,
      whole.width == width && whole.height == height ? "" : fmt::format(", averaged down to {} x {}", width, height));
  if (photo.has_alpha) target.note += "; its alpha is the mask";
  if (photo.saturated > 0) target.note += fmt::format("; {:.2g} % are saturated and left out", 100 * photo.saturated);
  target.note += fmt::format("; noise of a pixel {:.2g} % (median)", 100 * relative_noise_of(target, target.noise));
  return target;
}

}  // namespace

TargetImage read_target(const std::string& file, const std::string& mask, int width, int height, int channels,
                        const PhotoOptions& photo) {
  std::vector<float> weight = read_weights(mask, width, height);
  if (!is_exr(read_file(file))) return target_of_photo(file, std::move(weight), width, height, channels, photo);
  const ExrImage image = read_sized(file, width, height);
  TargetImage target{width, height, channels, {}, std::move(weight), {}};
  std::vector<std::size_t> from, errors;
  for (const char* name : channels == 1 ? std::vector<const char*>{"Y"} : std::vector<const char*>{"R", "G", "B"}) {
    const int c = image.channel(name);
    if (c < 0)
      throw InputError(fmt::format("{}: has channels {}, need {}, as the sensor's film", file,
                                   fmt::join(image.channels, " "), channels == 1 ? "Y" : "R G B"));
    from.push_back(static_cast<std::size_t>(c));
    const int error = image.channel(std::string("stderr.") + name);
    if (error >= 0) errors.push_back(static_cast<std::size_t>(error));
  }
  for (std::size_t i = 0; i < target.weight.size(); ++i)
    for (const std::size_t c : from) {
      const float value = image.data[i * image.channels.size() + c];
      if (target.weight[i] > 0 && !std::isfinite(value))
        throw InputError(fmt::format("{}: {}, channel {} is {}; radiance is finite: give the pixel weight 0 in a mask",
                                     file, at_pixel(static_cast<int>(i), width), image.channels[c], value));
      target.value.push_back(target.weight[i] > 0 ? value : 0.0F);
    }
  const auto place = [&](std::size_t i) {
    return at_pixel(static_cast<int>(i / from.size()), width) + ", channel " + image.channels[from[i % from.size()]];
  };
  if (const std::string wrong = wrong_with_target(target.value, place); !wrong.empty())
    throw InputError(fmt::format("{}: {}", file, wrong));
  if (errors.size() == from.size())
    for (std::size_t i = 0; i < target.weight.size(); ++i)
      for (const std::size_t c : errors) {
        const float error = image.data[i * image.channels.size() + c];
        if (target.weight[i] > 0 && !(error >= 0 && std::isfinite(error)))
          throw InputError(fmt::format("{}: {}, channel {} is {}; a standard error is finite and 0 or more", file,
                                       at_pixel(static_cast<int>(i), width), image.channels[c], error));
        target.error.push_back(target.weight[i] > 0 ? error : 0.0F);
      }
  return target;
}

TargetNoise settle_noise(std::vector<TargetImage>& targets, std::optional<double> relative) {
  if (relative && !(*relative >= 0 && std::isfinite(*relative)))
    throw UsageError(fmt::format("noise {}: need a finite number, 0 or more", *relative));
  if (relative) return {*relative, true};
  constexpr float least = 1e-3F;
  TargetNoise result;
  int measured = 0;
  for (TargetImage& target : targets) {
    if (!target.error.empty() || !target.noise.empty()) continue;
    ++measured;
    for (const float value : target.value) target.error.push_back(least * std::fabs(value));
    const Rounding none = [](double value) { return value > 0 ? std::optional(0.0) : std::nullopt; };
    add_photon_noise({target.width, target.height, target.channels, target.value, target.weight}, none, target.error);
    for (std::size_t i = 0; i < target.value.size(); ++i)
      if (target.value[i] == 0) target.error[i] = 0;  // what is rendered as black has no noise
    result.measured += relative_noise_of(target, target.error);
  }
  result.known = measured == 0;
  if (measured > 0) result.measured /= measured;
  return result;
}

std::string measured_noise_words() {
  return "The targets do not say their noise (no standard errors, and noise was not given): it was measured in them to "
         "weigh the pixels; the intervals come from what is left of the targets, so they hold if that is noise.";
}

}  // namespace itn
