// The clear sky of Hosek and Wilkie (2012) with their sun (2013), in linear sRGB, scaled and conditioned as Mitsuba 3's
// `sunsky`. Local frame: z up. Tables, their source and licence: data/hosek_wilkie_rgb.json, a part of the binary.
#pragma once
#include <array>
#include <vector>

#include "itn/scene.h"
#include "kernels/shared/environment_layout.h"

namespace itn {

struct SunSky {
  double turbidity = 3;
  Rgb albedo{0.3, 0.3, 0.3};
  double sun_scale = 1, sky_scale = 1;
  Sun sun;
};
SunSky sunsky_of(const Environment& environment);  // of the model sunsky

// The tables evaluated for one turbidity, ground albedo and elevation of the sun.
struct ClearSky {
  Vec3 sun{0, 0, 1};                                          // local, unit, towards the sun
  std::array<std::array<double, SKY_COEFFICIENTS>, 3> sky{};  // of kernels/model/sky_hosek_wilkie.h
  double sun_half_angle = 0;                                  // [radian]
  Rgb sun_radiance{};                                         // without limb darkening
  // With limb darkening, else empty: of [knot][channel][power], value and slope against the elevation of the direction
  // looked at [1/radian]; the radiance is the sum of the powers of mu times their cubic Hermite interpolation.
  std::vector<std::array<double, 2>> limb;
};

// Expects values inside their ranges: append_environment checks them.
ClearSky clear_sky(const SunSky& parameters);

// Parameters by which a clear sky can be differentiated: albedo has three components.
enum SkyParameter : std::size_t {
  SKY_TURBIDITY,
  SKY_ALBEDO,
  SKY_SUN_SCALE = SKY_ALBEDO + 3,
  SKY_SKY_SCALE,
  SKY_PARAMETERS
};

// By SkyParameter: the derivatives of sky, sun_radiance and limb; sun and sun_half_angle are as in clear_sky. The
// tables are piecewise linear in turbidity: at whole numbers from 2 to 9 this is the mean of the derivatives on both
// sides, the limit of central differences. sun_radiance() of such a record is the derivative of the sun's radiance, in
// which it is linear; the sky's needs derivative_sky_hosek_wilkie (runtime/render/derivative/score_functions.h).
std::array<ClearSky, SKY_PARAMETERS> clear_sky_derivatives(const SunSky& parameters);

// In a local direction. Both are 0 below the horizon.
Rgb sky_radiance(const ClearSky& sky, const Vec3& local);
// 0 outside the disc too.
Rgb sun_radiance(const ClearSky& sky, const Vec3& local);

}  // namespace itn
