#include "network/evaluation/appearance.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "itn/error.h"
#include "itn/exr.h"
#include "network/dataset/stored_image.h"
#include "network/model/input.h"
#include "network/model/ms_ssim.h"

namespace itn {
namespace {

constexpr int smallest_for_structure = 11;  // pixels a side: the window of MS-SSIM

}  // namespace

NoisyImage read_noisy_image(const std::string& folder, const Manifest& set, const Manifest::Image& image) {
  const std::string file = (std::filesystem::path(folder) / image.file).string();
  const ExrImage exr = read_stored(folder, set, image);
  NoisyImage result{luminance_of(exr, file), {}};
  const int channel = exr.channel("stderr.Y");
  if (channel < 0) throw InputError(file + ": has no channel stderr.Y, the standard error of its pixels");
  for (std::size_t i = 0; i < result.value.size(); ++i) {
    result.error.push_back(exr.data[i * exr.channels.size() + static_cast<std::size_t>(channel)]);
    if (!(std::isfinite(result.error.back()) && result.error.back() >= 0))
      throw InputError(file + ": channel stderr.Y has numbers that are no standard errors");
  }
  return result;
}

Difference difference(const Rendering& rendered, const NoisyImage& input) {
  const auto square = [](float x) { return static_cast<double>(x) * static_cast<double>(x); };
  const auto pixels = static_cast<double>(input.value.size());
  Difference result;
  double noise = 0;
  for (std::size_t i = 0; i < input.value.size(); ++i) {
    result.seen_mean_square += square(rendered.mean[i] - input.value[i]) / pixels;
    noise += (square(rendered.stderr_[i]) + square(input.error[i])) / pixels;
  }
  result.mean_square = result.seen_mean_square - noise;
  const float brightest = *std::max_element(input.value.begin(), input.value.end());
  result.structure =
      rendered.width < smallest_for_structure || !(brightest > 0)
          ? std::numeric_limits<double>::quiet_NaN()
          : 1 - ms_ssim(rendered.mean, input.value, rendered.width, rendered.height, static_cast<double>(brightest));
  return result;
}

}  // namespace itn
