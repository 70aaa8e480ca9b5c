// Colours as three components of linear sRGB.
#pragma once
#include <array>

namespace itn {

using Rgb = std::array<double, 3>;  // linear sRGB

// Luminance by ITU-R BT.709, with the digits that Mitsuba 3 has (kernels/film.cl has the same for the device).
constexpr std::array<double, 3> luminance_weights{0.212671, 0.715160, 0.072169};

inline double luminance(const std::array<double, 3>& rgb) {
  return luminance_weights[0] * rgb[0] + luminance_weights[1] * rgb[1] + luminance_weights[2] * rgb[2];
}

inline bool grey(const std::array<double, 3>& rgb) { return rgb[0] == rgb[1] && rgb[1] == rgb[2]; }

}  // namespace itn
