// Smith's G1 for Beckmann without the usual rational fit.
#pragma once
#include <cmath>

#include "kernels/shared/portable.h"

namespace itn::test {

//   G1 = 2 / (1 + erf(a) + exp(-a^2) / (a sqrt(pi))),  a = 1 / (alpha tan v)
inline double beckmann_shadowing_exact(const Vector3<double>& v, double alpha) {
  const double slope = alpha * std::sqrt(v.x * v.x + v.y * v.y);
  if (slope == 0) return 1;
  const double a = std::abs(v.z) / slope;
  return 2 / (1 + std::erf(a) + std::exp(-a * a) / (a * std::sqrt(PI_)));
}

}  // namespace itn::test
