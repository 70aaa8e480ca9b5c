// How numbers that people set become the numbers that models take, and the derivatives of that: every chain is written
// once, over any scalar, and differentiated by running it with dual numbers.
//
//   d log f / d int_ior = d log f / d eta * jacobian(relative_index, {int_ior, ext_ior}).by[0][0]
#pragma once
#include <array>
#include <cmath>
#include <cstddef>

#include "runtime/derivative/dual.h"

namespace itn {

template <class Real, std::size_t N>
using Numbers = std::array<Real, N>;

// {int_ior, ext_ior} -> {eta}, of the inside over the outside. Both > 0.
inline constexpr auto relative_index = []<class Real>(const Numbers<Real, 2>& ior) {
  return Numbers<Real, 1>{ior[0] / ior[1]};
};

// {sigma_t, scale} -> {sigma_t * scale} [1/scene unit]. Both >= 0.
inline constexpr auto scaled_extinction = []<class Real>(const Numbers<Real, 2>& x) {
  return Numbers<Real, 1>{x[0] * x[1]};
};

// {scale, radiance} -> {scale * radiance}
inline constexpr auto scaled_radiance = []<class Real>(const Numbers<Real, 2>& x) {
  return Numbers<Real, 1>{x[0] * x[1]};
};

// {sigma_s, sigma_a} [1/scene unit] -> {sigma_t, albedo}. Both >= 0, not both 0.
inline constexpr auto extinction_and_albedo = []<class Real>(const Numbers<Real, 2>& sigma) {
  const Real sigma_t = sigma[0] + sigma[1];
  return Numbers<Real, 2>{sigma_t, sigma[0] / sigma_t};
};

// {reduced scattering sigma_s (1 - g), absorption sigma_a, g} -> {sigma_t, albedo, g}. g < 1.
inline constexpr auto from_reduced_scattering = []<class Real>(const Numbers<Real, 3>& x) {
  const auto medium = extinction_and_albedo(Numbers<Real, 2>{x[0] / (Real(1) - x[2]), x[1]});
  return Numbers<Real, 3>{medium[0], medium[1], x[2]};
};

// {sigma_t, scale, albedo, g} -> {reduced scattering, absorption} [1/scene unit]
inline constexpr auto reduced_scattering_and_absorption = []<class Real>(const Numbers<Real, 4>& x) {
  const Real sigma_t = scaled_extinction(Numbers<Real, 2>{x[0], x[1]})[0];
  return Numbers<Real, 2>{sigma_t * x[2] * (Real(1) - x[3]), sigma_t * (Real(1) - x[2])};
};

// Coordinates of an optimizer. {x} -> {e^x}: for numbers > 0.
inline constexpr auto from_log = []<class Real>(const Numbers<Real, 1>& x) {
  using std::exp;
  return Numbers<Real, 1>{exp(x[0])};
};

// {x} -> {number strictly between low and high}: x = log((p - low) / (high - p)).
struct FromLogit {
  double low = 0, high = 1;
  template <class Real>
  Numbers<Real, 1> operator()(const Numbers<Real, 1>& x) const {
    using std::exp;
    // of the two equal forms the one whose exponential does not overflow
    const bool upper = x[0] > Real(0);
    const Real e = exp(upper ? Real(-x[0]) : x[0]);
    const Real share = upper ? Real(1) / (Real(1) + e) : e / (Real(1) + e);
    return {Real(low) + Real(high - low) * share};
  }
};

template <std::size_t Out, std::size_t In>
struct Jacobian {
  std::array<double, Out> value{};
  std::array<std::array<double, In>, Out> by{};  // [output][input]
};

// Values and all partial derivatives of a chain.
template <class Chain, std::size_t In>
auto jacobian(const Chain& chain, const std::array<double, In>& at) {
  std::array<Dual<In>, In> x;
  for (std::size_t i = 0; i < In; ++i) x[i] = Dual<In>::variable(at[i], i);
  const auto y = chain(x);
  Jacobian<std::tuple_size_v<std::decay_t<decltype(y)>>, In> result;
  for (std::size_t i = 0; i < y.size(); ++i) {
    result.value[i] = y[i].value;
    result.by[i] = y[i].derivative;
  }
  return result;
}

}  // namespace itn
