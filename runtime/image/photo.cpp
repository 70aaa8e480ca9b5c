#include "itn/photo.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>

#include "itn/colour.h"
#include "itn/error.h"
#include "itn/file.h"
#include "runtime/image/noise.h"
#include "runtime/image/samples.h"
#include "runtime/image/srgb.h"

namespace itn {
namespace {

constexpr double largest_sample = 65535;

std::size_t pixels_of(const Photo& photo) {
  return static_cast<std::size_t>(photo.width) * static_cast<std::size_t>(photo.height);
}

double decode(const TransferCurve& curve, double sample) {
  return curve.kind == TransferCurve::Kind::srgb     ? srgb_decode(sample)
         : curve.kind == TransferCurve::Kind::linear ? sample
                                                     : std::pow(sample, curve.exponent);
}

double encode(const TransferCurve& curve, double value) {
  return curve.kind == TransferCurve::Kind::srgb     ? srgb_encode(value)
         : curve.kind == TransferCurve::Kind::linear ? value
                                                     : std::pow(value, 1 / curve.exponent);
}

// Standard deviation of what rounding to steps of that size does to a value.
double rounding_error(const TransferCurve& curve, double sample, double step) {
  const double low = std::max(0.0, sample - step / 2), high = std::min(1.0, sample + step / 2);
  return (decode(curve, high) - decode(curve, low)) / std::sqrt(12.0);
}

// The linear value of a stored sample, and its noise.
struct Level {
  float value, noise;  // noise: of rounding
};

// The levels that a file of so many bits can hold, smallest first.
std::vector<Level> levels_of(const TransferCurve& curve, int bits) {
  const int count = 1 << bits;
  std::vector<Level> result;
  for (int k = 0; k < count; ++k) {
    const double sample = static_cast<double>(k) / (count - 1);
    result.push_back({static_cast<float>(decode(curve, sample)),
                      static_cast<float>(rounding_error(curve, sample, 1.0 / (count - 1)))});
  }
  return result;
}

// Parts of a row or a column of `from` pixels that make up each of `to`.
struct Part {
  int from;
  double share;
};

std::vector<std::vector<Part>> boxes(int from, int to) {
  std::vector<std::vector<Part>> result(static_cast<std::size_t>(to));
  const double size = static_cast<double>(from) / to;
  for (int i = 0; i < to; ++i) {
    // Whole numbers, so that no rounding leaves a sliver of the next pixel.
    const auto begin = std::int64_t{i} * from, end = begin + from;  // in 1/to pixels
    for (std::int64_t p = begin / to; p * to < end; ++p) {
      const std::int64_t overlap = std::min(end, (p + 1) * to) - std::max(begin, p * to);
      result[static_cast<std::size_t>(i)].push_back({static_cast<int>(p), static_cast<double>(overlap) / to / size});
    }
  }
  return result;
}

}  // namespace

TransferCurve transfer_curve(const std::string& text) {
  if (text == "auto") return {};
  if (text == "srgb") return {TransferCurve::Kind::srgb, 1};
  if (text == "linear") return {TransferCurve::Kind::linear, 1};
  constexpr double least = 0.2, most = 5;
  double exponent = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), exponent);
  if (error != std::errc() || end != text.data() + text.size() || !(exponent >= least && exponent <= most))
    throw UsageError(
        fmt::format("curve {}: need auto, srgb, linear, or an exponent from {} to {} such as 2.2", text, least, most));
  return {TransferCurve::Kind::power, exponent};
}

Photo read_photo(const std::string& path, const PhotoOptions& options) {
  const Samples samples = oriented(read_samples(read_file(path), path));
  TransferCurve curve = options.curve;
  if (curve.kind == TransferCurve::Kind::automatic)
    curve.kind = samples.is_tiff && samples.bits == 16 ? TransferCurve::Kind::linear : TransferCurve::Kind::srgb;
  Photo photo{samples.width, samples.height, samples.colours(), {}, {}, {}, 0, samples.has_alpha()};
  const auto stored = static_cast<std::size_t>(samples.channels), channels = static_cast<std::size_t>(photo.channels);
  const std::vector<Level> levels = levels_of(curve, samples.bits);
  const auto largest_level = static_cast<double>(levels.size() - 1);
  const double samples_a_level = largest_sample / largest_level;
  double saturated = 0, all = 0;
  for (std::size_t at = 0; at < samples.data.size(); at += stored) {
    const double alpha = photo.has_alpha ? samples.data[at + channels] / largest_sample : 1;
    bool clipped = false;
    for (std::size_t c = 0; c < channels; ++c) {
      const double sample = samples.data[at + c] / largest_sample;
      clipped |= sample >= options.saturation;
      const Level& level = levels[static_cast<std::size_t>(samples.data[at + c] / samples_a_level)];
      photo.value.push_back(level.value);
      photo.noise.push_back(level.noise);
    }
    photo.weight.push_back(clipped ? 0.0F : static_cast<float>(alpha));
    saturated += clipped && alpha > 0;
    all += alpha > 0;
  }
  if (all == 0) throw InputError(path + ": its alpha is 0 everywhere, so nothing is seen; need some above 0");
  photo.saturated = saturated / all;
  const Rounding rounding = [&](double value) -> std::optional<double> {
    const double sample = encode(curve, value), step = 1 / largest_level;
    if (!(sample > 4 * step)) return {};
    return rounding_error(curve, sample, step);
  };
  add_photon_noise({photo.width, photo.height, photo.channels, photo.value, photo.weight}, rounding, photo.noise);
  for (std::vector<float>* values : {&photo.value, &photo.noise})
    for (float& value : *values) value *= static_cast<float>(options.white);
  return photo;
}

Photo averaged_down(const Photo& photo, int width, int height, const std::string& path) {
  if (photo.width == width && photo.height == height) return photo;
  // Half a pixel of the smaller picture, along one side of it.
  const auto differs = [](double from, double from_other, double to, double to_other) {
    return std::fabs(from / from_other * to_other - to) > 0.5;
  };
  const bool other_shape =
      differs(photo.width, photo.height, width, height) || differs(photo.height, photo.width, height, width);
  if (width > photo.width || height > photo.height || other_shape)
    throw InputError(
        fmt::format("{}: {} x {} pixels, need {} x {}, the size of the sensor's film, or a larger picture of "
                    "the same shape: cut it, or set the film's size",
                    path, photo.width, photo.height, width, height));
  Photo result{width, height, photo.channels, {}, {}, {}, photo.saturated, photo.has_alpha};
  const std::vector<std::vector<Part>> rows = boxes(photo.height, height), columns = boxes(photo.width, width);
  const auto channels = static_cast<std::size_t>(photo.channels);
  std::vector<double> value(channels), variance(channels);
  for (const std::vector<Part>& of_row : rows)
    for (const std::vector<Part>& of_column : columns) {
      std::fill(value.begin(), value.end(), 0.0);
      std::fill(variance.begin(), variance.end(), 0.0);
      float weight = 1;
      for (const Part& row : of_row)
        for (const Part& column : of_column) {
          const std::size_t pixel = static_cast<std::size_t>(row.from) * static_cast<std::size_t>(photo.width) +
                                    static_cast<std::size_t>(column.from);
          const double share = row.share * column.share;
          weight = std::min(weight, photo.weight[pixel]);
          for (std::size_t c = 0; c < channels; ++c) {
            value[c] += share * static_cast<double>(photo.value[pixel * channels + c]);
            variance[c] += std::pow(share * static_cast<double>(photo.noise[pixel * channels + c]), 2);
          }
        }
      result.weight.push_back(weight);
      for (std::size_t c = 0; c < channels; ++c) {
        result.value.push_back(static_cast<float>(value[c]));
        result.noise.push_back(static_cast<float>(std::sqrt(variance[c])));
      }
    }
  return result;
}

Photo luminance_of(const Photo& photo) {
  if (photo.channels == 1) return photo;
  Photo result{photo.width, photo.height, 1, {}, photo.weight, {}, photo.saturated, photo.has_alpha};
  for (std::size_t i = 0; i < pixels_of(photo); ++i) {
    double value = 0, variance = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      value += luminance_weights[c] * static_cast<double>(photo.value[3 * i + c]);
      variance += std::pow(luminance_weights[c] * static_cast<double>(photo.noise[3 * i + c]), 2);
    }
    result.value.push_back(static_cast<float>(value));
    result.noise.push_back(static_cast<float>(std::sqrt(variance)));
  }
  return result;
}

}  // namespace itn
