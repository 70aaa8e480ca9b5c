// A file of the MERL database's format from a formula.
#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <functional>
#include <numbers>
#include <string>

namespace itn::test {

// The reflectance [1/sr] of red, green and blue by the angle from half vector to normal, from half vector to wi, and
// wi's azimuth about it [radian].
using MerlFormula = std::function<std::array<double, 3>(double half, double difference, double azimuth)>;

// At the centres of bins.
inline std::string merl_bytes(const MerlFormula& formula) {
  constexpr std::array<std::int32_t, 3> size{90, 90, 180};
  constexpr std::array<double, 3> unit{1.0 / 1500, 1.15 / 1500, 1.66 / 1500};
  constexpr double quarter = std::numbers::pi / 2;
  constexpr std::size_t bins = 90 * 90 * 180;
  std::string bytes(sizeof(size) + 3 * bins * sizeof(double), '\0');
  std::memcpy(bytes.data(), size.data(), sizeof(size));
  std::size_t at = 0;
  for (int h = 0; h < size[0]; ++h)
    for (int d = 0; d < size[1]; ++d)
      for (int p = 0; p < size[2]; ++p, ++at) {
        const double half = quarter * (h + 0.5) / 90 * (h + 0.5) / 90;
        const std::array<double, 3> f = formula(half, quarter * (d + 0.5) / 90, std::numbers::pi * (p + 0.5) / 180);
        for (std::size_t c = 0; c < 3; ++c) {
          const double value = f[c] / unit[c];
          std::memcpy(bytes.data() + sizeof(size) + (c * bins + at) * sizeof(double), &value, sizeof(double));
        }
      }
  return bytes;
}

}  // namespace itn::test
