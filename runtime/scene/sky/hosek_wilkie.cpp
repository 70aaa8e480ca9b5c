#include "runtime/scene/sky/hosek_wilkie.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>

#include "kernels/model/angle.h"
#include "kernels/model/sky_hosek_wilkie.h"
#include "runtime/base/dual.h"

namespace itn {

// Defined in the generated embedded_data.cpp.
const char* embedded_data(const std::string& path);

namespace {

constexpr double pi = std::numbers::pi, degree = pi / 180;
constexpr std::size_t turbidities = 10, albedos = 2, control_points = 6, elevations = 30, wavelengths = 10;
constexpr std::size_t knots = SUN_KNOTS, powers = SUN_POWERS;

// Shapes and meanings: "axes" and "about" in the file.
struct Tables {
  std::vector<double> sky_params, sky_rad, sun_irr, sun_val, sun_der, sun_ld, sun_rgb;
  double luminance_scale, sun_scale, sun_aperture;
};

const Tables& tables() {
  static const Tables loaded = [] {
    const auto json = nlohmann::json::parse(embedded_data("scene/data/hosek_wilkie_rgb.json"));
    const auto table = [&](const char* name) { return json["tables"][name]["data"].get<std::vector<double>>(); };
    const auto& constants = json["constants"];
    return Tables{table("sky_params"),   table("sky_rad"),
                  table("sun_irr"),      table("sun_val"),
                  table("sun_der"),      table("sun_ld"),
                  table("sun_rgb"),      constants["CIE_Y_NORM"],
                  constants["SUN_CONV"], constants["REF_SUN_APERTURE_DEG"]};
  }();
  return loaded;
}

double value_of(double x) { return x; }
template <std::size_t N>
double value_of(const Dual<N>& x) {
  return x.value;
}

template <class Real>
Real between(const Real& low, const Real& high, const Real& weight) {
  return low + weight * (high - low);
}

// Interval of x among 0, 1, ... last: the step below and the weight of the one above it.
template <class Real>
struct Step {
  std::size_t below;
  Real weight;
  Step(const Real& x, std::size_t last) {
    const Real inside = std::clamp(x, Real(0), Real(static_cast<double>(last)));
    below = std::min(static_cast<std::size_t>(value_of(inside)), last - 1);
    weight = inside - Real(static_cast<double>(below));
  }
  // between data[below * stride + at] and data[(below + 1) * stride + at]
  Real operator()(const std::vector<double>& data, std::size_t stride, std::size_t at) const {
    return between(Real(data[below * stride + at]), Real(data[(below + 1) * stride + at]), weight);
  }
};

// Quantities by which the sky can be differentiated.
template <class Real>
struct Controls {
  Real turbidity;
  std::array<Real, 3> albedo;
  Real sun_scale, sky_scale;
};

// ClearSky over any scalar; the sun's place and size are plain numbers.
template <class Real>
struct Coefficients {
  std::array<std::array<Real, SKY_COEFFICIENTS>, 3> sky{};
  std::array<Real, 3> sun_radiance{};
  std::vector<std::array<Real, 2>> limb;
};

// A value from a table [turbidity][albedo][control point][width]: linear in turbidity and albedo, a Bezier curve of
// degree 5 in the cube root of the elevation (as a share of the right angle).
template <class Real>
Real interpolate(const std::vector<double>& data, std::size_t width, std::size_t at, const Step<Real>& turbidity,
                 const Real& albedo, double elevation) {
  static const double binomial[control_points] = {1, 5, 10, 10, 5, 1};
  const double x = std::cbrt(elevation / (pi / 2));
  const std::size_t stride = albedos * control_points * width;
  Real sum = 0;
  for (std::size_t k = 0; k < control_points; ++k) {
    const double bernstein = binomial[k] * std::pow(x, k) * std::pow(1 - x, control_points - 1 - k);
    const Real dark = turbidity(data, stride, k * width + at);
    const Real bright = turbidity(data, stride, (control_points + k) * width + at);
    sum += bernstein * between(dark, bright, albedo);
  }
  return sum;
}

double one_minus_cos(double angle) { return 2 * std::pow(std::sin(angle / 2), 2); }

double elevation_of(const Vec3& direction) { return std::asin(std::clamp(direction[2], 0.0, 1.0)); }

Vec3 unit(const Vec3& v) {
  const double length = std::hypot(v[0], v[1], v[2]);
  return {v[0] / length, v[1] / length, v[2] / length};
}

double half_angle(const SunSky& parameters) { return parameters.sun.aperture / 2 * degree; }

template <class Real>
Coefficients<Real> coefficients(const SunSky& fixed, const Controls<Real>& controls) {
  const Tables& data = tables();
  Coefficients<Real> result;
  const double elevation = elevation_of(unit(fixed.sun.direction));
  const Step<Real> turbidity(controls.turbidity - Real(1), turbidities - 1);

  for (std::size_t c = 0; c < 3; ++c) {
    auto& k = result.sky[c];
    for (std::size_t i = 0; i < 9; ++i)
      k[i] = interpolate(data.sky_params, 3 * 9, c * 9 + i, turbidity, controls.albedo[c], elevation);
    // The tables order them A B C D E F G I H, which is the order of the formula's array too.
    k[9] = controls.sky_scale * data.luminance_scale *
           interpolate(data.sky_rad, 3, c, turbidity, controls.albedo[c], elevation);
  }

  const Real scale = controls.sun_scale * data.sun_scale * data.luminance_scale;
  if (!fixed.sun.complex) {
    // Irradiance at elevations of 2, 5, ... 89 degrees
    const Step<double> step((elevation / degree - 2) / 3, elevations - 1);
    for (std::size_t c = 0; c < 3; ++c) {
      const Real low = turbidity(data.sun_irr, elevations * 3, step.below * 3 + c);
      const Real high = turbidity(data.sun_irr, elevations * 3, (step.below + 1) * 3 + c);
      result.sun_radiance[c] =
          scale * between(low, high, Real(step.weight)) / (2 * pi * one_minus_cos(half_angle(fixed)));
    }
    return result;
  }
  // The spectrum is folded into three channels here, so that a direction costs no loop over wavelengths. A disc of
  // another size has the power of the sun's own, by the ratio of solid angles.
  const double ratio = one_minus_cos(data.sun_aperture / 2 * degree) / one_minus_cos(half_angle(fixed));
  for (std::size_t knot = 0; knot < knots; ++knot)
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t power = 0; power < powers; ++power) {
        std::array<Real, 2> sum{0, 0};
        for (std::size_t w = 0; w < wavelengths; ++w) {
          const Real factor = scale * ratio * data.sun_rgb[3 * w + c] * data.sun_ld[powers * w + power];
          sum[0] += factor * turbidity(data.sun_val, knots * wavelengths, knot * wavelengths + w);
          sum[1] += factor * turbidity(data.sun_der, knots * wavelengths, knot * wavelengths + w);
        }
        result.limb.push_back(sum);
      }
  return result;
}

}  // namespace

SunSky sunsky_of(const Environment& e) {
  return {e.number("turbidity"), e.colour("albedo"), e.number("sun_scale"), e.number("sky_scale"), e.sun};
}

ClearSky clear_sky(const SunSky& parameters) {
  const auto made = coefficients<double>(
      parameters, {parameters.turbidity, parameters.albedo, parameters.sun_scale, parameters.sky_scale});
  return {unit(parameters.sun.direction), made.sky, half_angle(parameters), made.sun_radiance, made.limb};
}

std::array<ClearSky, SKY_PARAMETERS> clear_sky_derivatives(const SunSky& parameters) {
  using Moving = Dual<SKY_PARAMETERS>;
  const auto& albedo = parameters.albedo;
  const auto at = [&](double turbidity) {
    return coefficients<Moving>(parameters,
                                {Moving::variable(turbidity, SKY_TURBIDITY),
                                 {Moving::variable(albedo[0], SKY_ALBEDO), Moving::variable(albedo[1], SKY_ALBEDO + 1),
                                  Moving::variable(albedo[2], SKY_ALBEDO + 2)},
                                 Moving::variable(parameters.sun_scale, SKY_SUN_SCALE),
                                 Moving::variable(parameters.sky_scale, SKY_SKY_SCALE)});
  };
  // The steps of the tables on both sides of the turbidity: the same one, unless it is a whole number.
  const auto above = at(parameters.turbidity), below = at(std::nextafter(parameters.turbidity, 1.0));
  std::array<ClearSky, SKY_PARAMETERS> result;
  for (std::size_t p = 0; p < SKY_PARAMETERS; ++p) {
    const auto mean = [p](const Moving& a, const Moving& b) { return (a.derivative[p] + b.derivative[p]) / 2; };
    ClearSky& d = result[p];
    d.sun = unit(parameters.sun.direction);
    d.sun_half_angle = half_angle(parameters);
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t i = 0; i < SKY_COEFFICIENTS; ++i) d.sky[c][i] = mean(above.sky[c][i], below.sky[c][i]);
      d.sun_radiance[c] = mean(above.sun_radiance[c], below.sun_radiance[c]);
    }
    for (std::size_t i = 0; i < above.limb.size(); ++i)
      d.limb.push_back({mean(above.limb[i][0], below.limb[i][0]), mean(above.limb[i][1], below.limb[i][1])});
  }
  return result;
}

Rgb sky_radiance(const ClearSky& sky, const Vec3& local) {
  Rgb rgb{0, 0, 0};
  if (local[2] < 0) return rgb;
  const Vector3<double> d{local[0], local[1], local[2]}, s{sky.sun[0], sky.sun[1], sky.sun[2]};
  const auto chord = sub3(d, s);
  for (std::size_t c = 0; c < 3; ++c)
    rgb[c] = sky_hosek_wilkie(sky.sky[c].data(), d.z, angle_between(d, s), 0.5 * dot3(chord, chord));
  return rgb;
}

Rgb sun_radiance(const ClearSky& sky, const Vec3& local) {
  double chord2 = 0;
  for (std::size_t i = 0; i < 3; ++i) chord2 += std::pow(local[i] - sky.sun[i], 2);
  if (local[2] < 0 || chord2 > 2 * one_minus_cos(sky.sun_half_angle)) return {0, 0, 0};
  if (sky.limb.empty()) return sky.sun_radiance;

  const double sin2 = chord2 * (1 - chord2 / 4), limit = std::sin(sky.sun_half_angle);
  const double mu = std::sqrt(std::max(0.0, 1 - sin2 / (limit * limit)));
  const double elevation = std::asin(std::min(local[2], 1.0));
  const auto knot = std::min(static_cast<std::size_t>((knots - 1) * std::cbrt(elevation / (pi / 2))), knots - 2);
  const auto at = [](std::size_t i) { return pi / 2 * std::pow(static_cast<double>(i) / (knots - 1), 3); };
  const double width = at(knot + 1) - at(knot), t = (elevation - at(knot)) / width;
  Rgb rgb{0, 0, 0};
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t power = 0; power < powers; ++power) {
      const auto& a = sky.limb[(knot * 3 + c) * powers + power];
      const auto& b = sky.limb[((knot + 1) * 3 + c) * powers + power];
      const double value = a[0] * (1 + 2 * t) * (1 - t) * (1 - t) + b[0] * t * t * (3 - 2 * t) +
                           width * t * (1 - t) * (a[1] * (1 - t) - b[1] * t);
      rgb[c] += value * std::pow(mu, power);
    }
  return rgb;
}

}  // namespace itn
