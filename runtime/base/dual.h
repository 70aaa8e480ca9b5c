// A number with its derivatives along N directions: the reference for recorded derivatives, and what evaluates the
// parameter chains on the host. Formulas of kernels/model run with REAL = Dual<N>; a select takes one branch alone, so
// the other's NaN does not show. (Eigen's AutoDiffScalar builds expression templates, which do not deduce as one REAL.)
#pragma once
#include <array>
#include <cmath>
#include <cstddef>

namespace itn {

template <std::size_t N>
struct Dual {
  double value = 0;
  std::array<double, N> derivative{};

  Dual(double constant = 0) : value(constant) {}  // implicit, as formulas mix numbers in
  // The variable number `direction`.
  static Dual variable(double value, std::size_t direction) {
    Dual result(value);
    result.derivative[direction] = 1;
    return result;
  }

  // f(a, b) with the partial derivatives by a and by b. A zero slope silences a factor that is not finite.
  static Dual chain(double f, const Dual& a, double by_a, const Dual& b = 0, double by_b = 0) {
    Dual result(f);
    for (std::size_t i = 0; i < N; ++i)
      result.derivative[i] =
          (a.derivative[i] == 0 ? 0 : by_a * a.derivative[i]) + (b.derivative[i] == 0 ? 0 : by_b * b.derivative[i]);
    return result;
  }

  friend Dual operator+(const Dual& a, const Dual& b) { return chain(a.value + b.value, a, 1, b, 1); }
  friend Dual operator-(const Dual& a, const Dual& b) { return chain(a.value - b.value, a, 1, b, -1); }
  friend Dual operator*(const Dual& a, const Dual& b) { return chain(a.value * b.value, a, b.value, b, a.value); }
  friend Dual operator/(const Dual& a, const Dual& b) {
    const double quotient = a.value / b.value;
    return chain(quotient, a, 1 / b.value, b, -quotient / b.value);
  }
  friend Dual operator-(const Dual& a) { return chain(-a.value, a, -1); }
  friend Dual& operator+=(Dual& a, const Dual& b) { return a = a + b; }
  friend Dual& operator-=(Dual& a, const Dual& b) { return a = a - b; }
  friend Dual& operator*=(Dual& a, const Dual& b) { return a = a * b; }
  friend Dual& operator/=(Dual& a, const Dual& b) { return a = a / b; }

  friend Dual sqrt(const Dual& a) {
    const double root = std::sqrt(a.value);
    return chain(root, a, root == 0 ? 0 : 0.5 / root);
  }
  friend Dual exp(const Dual& a) {
    const double e = std::exp(a.value);
    return chain(e, a, e);
  }
  friend Dual log(const Dual& a) { return chain(std::log(a.value), a, 1 / a.value); }
  friend Dual sin(const Dual& a) { return chain(std::sin(a.value), a, std::cos(a.value)); }
  friend Dual cos(const Dual& a) { return chain(std::cos(a.value), a, -std::sin(a.value)); }
  friend Dual fabs(const Dual& a) { return a.value < 0 ? -a : a; }

  friend bool operator<(const Dual& a, const Dual& b) { return a.value < b.value; }
  friend bool operator>(const Dual& a, const Dual& b) { return a.value > b.value; }
  friend bool operator<=(const Dual& a, const Dual& b) { return a.value <= b.value; }
  friend bool operator>=(const Dual& a, const Dual& b) { return a.value >= b.value; }
  friend bool operator==(const Dual& a, const Dual& b) { return a.value == b.value; }
};

}  // namespace itn
