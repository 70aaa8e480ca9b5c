#include "chi_square.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "z_test.h"

namespace itn::test {
namespace {

// Gauss-Legendre, 5 x 5 points.
double gauss(const std::function<double(double, double)>& f, const Grid& r) {
  constexpr std::array<double, 5> x{-0.906179845938664, -0.538469310105683, 0, 0.538469310105683, 0.906179845938664};
  constexpr std::array<double, 5> w{0.236926885056189, 0.478628670499366, 0.568888888888889, 0.478628670499366,
                                    0.236926885056189};
  const double half_a = 0.5 * (r.a1 - r.a0), half_b = 0.5 * (r.b1 - r.b0);
  double sum = 0;
  for (std::size_t i = 0; i < 5; ++i)
    for (std::size_t j = 0; j < 5; ++j) sum += w[i] * w[j] * f(r.a0 + half_a * (1 + x[i]), r.b0 + half_b * (1 + x[j]));
  return sum * half_a * half_b;
}

double refine(const std::function<double(double, double)>& f, const Grid& r, double whole, double tolerance,
              int depth) {
  const double a = 0.5 * (r.a0 + r.a1), b = 0.5 * (r.b0 + r.b1);
  const std::array<Grid, 4> quarter{{{r.a0, a, r.b0, b}, {a, r.a1, r.b0, b}, {r.a0, a, b, r.b1}, {a, r.a1, b, r.b1}}};
  std::array<double, 4> part{};
  for (std::size_t i = 0; i < 4; ++i) part[i] = gauss(f, quarter[i]);
  const double sum = part[0] + part[1] + part[2] + part[3];
  if (depth == 0 || std::abs(sum - whole) < tolerance) return sum;
  double result = 0;
  for (std::size_t i = 0; i < 4; ++i) result += refine(f, quarter[i], part[i], 0.5 * tolerance, depth - 1);
  return result;
}

}  // namespace

double integrate(const std::function<double(double, double)>& f, const Grid& grid, double tolerance) {
  const double step_a = (grid.a1 - grid.a0) / grid.cells_a, step_b = (grid.b1 - grid.b0) / grid.cells_b;
  double sum = 0;
  for (int i = 0; i < grid.cells_a; ++i)
    for (int j = 0; j < grid.cells_b; ++j) {
      const Grid cell{grid.a0 + i * step_a, grid.a0 + (i + 1) * step_a, grid.b0 + j * step_b,
                      grid.b0 + (j + 1) * step_b};
      sum += refine(f, cell, gauss(f, cell), tolerance / (grid.cells_a * grid.cells_b), 7);
    }
  return sum;
}

ChiSquare chi_square(const std::vector<double>& observed, const std::vector<double>& expected) {
  std::vector<std::size_t> order(expected.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) { return expected[i] < expected[j]; });
  std::vector<double> group_observed, group_expected;
  double o = 0, e = 0;
  for (const std::size_t i : order) {
    o += observed[i];
    e += expected[i];
    if (e < 5) continue;
    group_observed.push_back(o);
    group_expected.push_back(e);
    o = e = 0;
  }
  if (group_expected.empty()) return {};
  group_observed.back() += o;  // nothing is left over unless all cells are small
  group_expected.back() += e;
  ChiSquare result;
  for (std::size_t i = 0; i < group_expected.size(); ++i)
    result.statistic +=
        (group_observed[i] - group_expected[i]) * (group_observed[i] - group_expected[i]) / group_expected[i];
  result.degrees_of_freedom = static_cast<int>(group_expected.size()) - 1;
  if (result.degrees_of_freedom > 0) result.p_value = chi_square_tail(result.statistic, result.degrees_of_freedom);
  return result;
}

ChiSquare chi_square(const std::vector<Point>& samples, const std::function<double(double, double)>& density,
                     const Grid& grid) {
  const auto cells = static_cast<std::size_t>(grid.cells_a * grid.cells_b);
  std::vector<double> observed(cells + 1), expected(cells + 1);
  const double step_a = (grid.a1 - grid.a0) / grid.cells_a, step_b = (grid.b1 - grid.b0) / grid.cells_b;
  for (const auto& [a, b] : samples) {
    const double i = std::floor((a - grid.a0) / step_a), j = std::floor((b - grid.b0) / step_b);
    const bool inside = i >= 0 && i < grid.cells_a && j >= 0 && j < grid.cells_b;
    observed[inside ? static_cast<std::size_t>(i) * static_cast<std::size_t>(grid.cells_b) + static_cast<std::size_t>(j)
                    : cells] += 1;
  }
  const auto count = static_cast<double>(samples.size());
  expected[cells] = count;
  for (int i = 0; i < grid.cells_a; ++i)
    for (int j = 0; j < grid.cells_b; ++j) {
      const Grid cell{grid.a0 + i * step_a, grid.a0 + (i + 1) * step_a, grid.b0 + j * step_b,
                      grid.b0 + (j + 1) * step_b};
      const double mass = count * integrate(density, cell, 3e-2 / count);
      expected[static_cast<std::size_t>(i * grid.cells_b + j)] = mass;
      expected[cells] -= mass;
    }
  expected[cells] = std::max(expected[cells], 0.0);
  return chi_square(observed, expected);
}

}  // namespace itn::test
