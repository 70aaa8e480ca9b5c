#include "runtime/image/preview.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "itn/colour.h"
#include "runtime/image/srgb.h"

namespace itn {
namespace {

void append(std::vector<std::uint8_t>& bytes, const Rgb& colour) {
  for (const double x : colour)
    bytes.push_back(static_cast<std::uint8_t>(std::lround(255 * srgb_encode(std::clamp(x, 0.0, 1.0)))));
}

// The value that a fraction of the finite ones does not exceed; 0 when there is none.
double percentile(std::vector<double> values, double fraction) {
  std::erase_if(values, [](double x) { return !std::isfinite(x); });
  if (values.empty()) return 0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

Rgb pixel(const std::vector<float>& data, int channels, std::size_t i) {
  if (channels == 1) return {data[i], data[i], data[i]};
  return {data[3 * i], data[3 * i + 1], data[3 * i + 2]};
}

double shoulder(double x) { return x <= 0.6 ? x : 1 - 0.4 * std::exp(-(x - 0.6) / 0.4); }

}  // namespace

double automatic_exposure(const std::vector<float>& data, int channels) {
  std::vector<double> luminances(data.size() / static_cast<std::size_t>(channels));
  for (std::size_t i = 0; i < luminances.size(); ++i) luminances[i] = luminance(pixel(data, channels, i));
  const double white = percentile(std::move(luminances), 0.98);
  return white > 0 ? 0.8 / white : 1;
}

std::vector<std::uint8_t> tone_mapped(const std::vector<float>& data, int channels, double exposure) {
  const std::size_t pixels = data.size() / static_cast<std::size_t>(channels);
  std::vector<std::uint8_t> bytes;
  bytes.reserve(3 * pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    Rgb c = pixel(data, channels, i);
    if (!std::isfinite(luminance(c)))
      c = {1, 0, 1};
    else
      for (double& x : c) x = shoulder(exposure * x);
    append(bytes, c);
  }
  return bytes;
}

std::vector<std::uint8_t> tone_mapped(const std::vector<float>& data, int channels) {
  return tone_mapped(data, channels, automatic_exposure(data, channels));
}

SignedPicture red_blue(const std::vector<float>& data, int channels) {
  const std::size_t pixels = data.size() / static_cast<std::size_t>(channels);
  std::vector<double> values(pixels), sizes;
  for (std::size_t i = 0; i < pixels; ++i) {
    const Rgb c = pixel(data, channels, i);
    values[i] = (c[0] + c[1] + c[2]) / 3;
    if (values[i] != 0) sizes.push_back(std::fabs(values[i]));
  }
  SignedPicture picture;
  picture.scale = percentile(sizes, 0.99);
  picture.bytes.reserve(3 * pixels);
  const auto byte = [](double x) { return static_cast<std::uint8_t>(std::lround(255 * x)); };
  for (const double value : values) {
    if (!std::isfinite(value)) {
      picture.bytes.insert(picture.bytes.end(), {0, 255, 0});
      continue;
    }
    const double t = picture.scale > 0 ? std::clamp(value / picture.scale, -1.0, 1.0) : 0;
    const std::uint8_t rest = byte(1 - std::fabs(t));
    picture.bytes.insert(picture.bytes.end(), {t >= 0 ? byte(1) : rest, rest, t >= 0 ? rest : byte(1)});
  }
  return picture;
}

}  // namespace itn
