// Other coordinates of a material, and those of optimizers: every chain is written once, over any scalar, and
// differentiated by running it with dual numbers. (How parameters become the numbers of a model stands in its own
// file.)
#pragma once
#include <array>
#include <cmath>
#include <cstddef>

#include "runtime/base/dual.h"

namespace itn {

template <class Real, std::size_t N>
using Numbers = std::array<Real, N>;

// {sigma_t, albedo, mean cosine} -> {reduced scattering, absorption} [1/scene unit]
inline constexpr auto reduced_scattering_and_absorption = []<class Real>(const Numbers<Real, 3>& x) {
  return Numbers<Real, 2>{x[0] * x[1] * (Real(1) - x[2]), x[0] * (Real(1) - x[1])};
};

// {sigma_t, albedo, mean cosine} -> {log of the transport coefficient sigma_t (1 - albedo g) [1/scene unit], similarity
// parameter sqrt((1 - albedo) / (1 - albedo g)), mean cosine}: light that is scattered often depends on the first two
// alone (van de Hulst 1980, Multiple Light Scattering; Wyman, Patterson and Wilson 1989, Similarity relations).
inline constexpr auto similarity = []<class Real>(const Numbers<Real, 3>& x) {
  using std::log, std::sqrt;
  const Real transported = Real(1) - x[1] * x[2];
  return Numbers<Real, 3>{log(x[0] * transported), sqrt((Real(1) - x[1]) / transported), x[2]};
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
