#include "itn/measured_brdf.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <numbers>

#include "itn/error.h"
#include "itn/file.h"
#include "kernels/model/bsdf/merl.h"

namespace itn {
namespace {

constexpr std::size_t header_bytes = 12, bins = MERL_BINS;
constexpr std::array<double, 3> unit{1.0 / 1500, 1.15 / 1500, 1.66 / 1500};
constexpr double greatest_value = 1e30;
constexpr double quarter = std::numbers::pi / 2;

[[noreturn]] void fail(const std::string& file, const std::string& what) { throw InputError(file + ": " + what); }

// The table at places in bins (merl_place of kernels/model/bsdf/merl.h).
std::vector<double> at_place(const MeasuredBrdf& brdf, const std::array<double, 3>& place) {
  constexpr std::array<int, 3> count{MERL_HALF_BINS, MERL_DIFFERENCE_BINS, MERL_AZIMUTH_BINS};
  std::array<std::array<int, 2>, 3> bin{};
  std::array<double, 3> beyond{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const bool round = axis == 2;
    double from_centre = place[axis] - 0.5;
    if (round && from_centre < 0) from_centre += count[axis];
    if (!round) from_centre = std::clamp(from_centre, 0.0, count[axis] - 1.0);
    const int first = std::min(static_cast<int>(from_centre), count[axis] - (round ? 1 : 2));
    bin[axis] = {first, (first + 1) % count[axis]};
    beyond[axis] = from_centre - first;
  }
  std::vector<double> sum(3);
  for (std::size_t corner = 0; corner < 8; ++corner) {
    const std::array<std::size_t, 3> side{corner & 1, corner >> 1 & 1, corner >> 2};
    double weight = 1;
    std::size_t at = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      weight *= side[axis] ? beyond[axis] : 1 - beyond[axis];
      at = at * static_cast<std::size_t>(count[axis]) + static_cast<std::size_t>(bin[axis][side[axis]]);
    }
    for (std::size_t c = 0; c < 3; ++c) sum[c] += weight * static_cast<double>(brdf.values[3 * at + c]);
  }
  return sum;
}

// Mean of the channels, at a difference angle of 20 degrees across the plane of incidence.
double profile(const MeasuredBrdf& brdf, double half) {
  const std::vector<double> value = measured_value(brdf, half, quarter * 20 / 90, quarter);
  return (value[0] + value[1] + value[2]) / 3;
}

// Fits GGX: its normals have fallen to half where the profile has fallen to half of its peak above the diffuse part: (1
// + tan^2 / alpha^2)^2 = 2 but for the fourth power of the cosine. The glossy lobe reflects pi alpha^2 times the peak,
// the diffuse one pi times its value.
void fit_sampler(MeasuredBrdf& brdf) {
  constexpr double degree = quarter / 90;
  double diffuse = profile(brdf, 40 * degree);
  for (int angle = 40; angle <= 65; ++angle) diffuse = std::min(diffuse, profile(brdf, angle * degree));
  const double peak = profile(brdf, 0) - diffuse;
  double half = 0;
  while (half < 60 * degree && profile(brdf, half) - diffuse > peak / 2) half += degree / 16;
  constexpr double least_fitted = 1e-3, least_share = 0.1;
  brdf.alpha = std::clamp(std::tan(half) / std::sqrt(std::sqrt(2.0) - 1), least_fitted, 1.0);
  const double glossy = std::max(0.0, peak) * brdf.alpha * brdf.alpha;
  // each lobe stays: the fit is rough, and where one is missing weights have no bound
  brdf.gloss = std::clamp(glossy / std::max(glossy + diffuse, 1e-30), least_share, 1 - least_share);
}

}  // namespace

std::vector<double> measured_value(const MeasuredBrdf& brdf, double half, double difference, double azimuth) {
  double turn = std::fmod(azimuth / std::numbers::pi, 1.0);
  if (turn < 0) turn += 1;
  return at_place(brdf, {std::sqrt(half / quarter) * MERL_HALF_BINS, difference / quarter * MERL_DIFFERENCE_BINS,
                         turn * MERL_AZIMUTH_BINS});
}

MeasuredBrdf read_merl_file(const std::string& file) {
  const std::string bytes = read_file(file);
  if (bytes.size() < header_bytes)
    fail(file, fmt::format("ends within its header of {} bytes; need a file of the MERL database", header_bytes));
  std::array<std::int32_t, 3> size{};
  std::memcpy(size.data(), bytes.data(), header_bytes);
  if (size != std::array<std::int32_t, 3>{MERL_HALF_BINS, MERL_DIFFERENCE_BINS, MERL_AZIMUTH_BINS})
    fail(file, fmt::format("a table of {} x {} x {} bins; need {} x {} x {}, as the MERL database has them", size[0],
                           size[1], size[2], MERL_HALF_BINS, MERL_DIFFERENCE_BINS, MERL_AZIMUTH_BINS));
  constexpr std::size_t needed = header_bytes + 3 * bins * sizeof(double);
  if (bytes.size() < needed)
    fail(file, fmt::format("{} bytes; such a table takes {}: copy the whole file", bytes.size(), needed));
  MeasuredBrdf brdf;
  brdf.values.resize(3 * bins);
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t i = 0; i < bins; ++i) {
      double value = 0;
      std::memcpy(&value, bytes.data() + header_bytes + (c * bins + i) * sizeof(double), sizeof(double));
      if (!(std::abs(value) <= greatest_value))
        fail(file, fmt::format("value {} of channel {} is {}; need numbers up to {:g}: mend the table", i, "RGB"[c],
                               value, greatest_value));
      brdf.values[3 * i + c] = static_cast<float>(std::max(value, 0.0) * unit[c]);
    }
  if (std::all_of(brdf.values.begin(), brdf.values.end(), [](float v) { return v == 0; }))
    fail(file, "all values are 0 or negative, which means not measured; need a table of reflectance");
  fit_sampler(brdf);
  return brdf;
}

}  // namespace itn
