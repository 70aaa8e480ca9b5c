// Do samples follow a density? Pearson's chi-square over a grid of cells.
#pragma once
#include <array>
#include <functional>
#include <vector>

namespace itn::test {

struct ChiSquare {
  double statistic = 0;
  int degrees_of_freedom = 0;
  double p_value = 1;  // how often samples of the density itself do worse
};

// Counts against expected counts of the same total. Cells are pooled, smallest first, until each group expects at least
// five: below that the statistic does not follow its limit distribution.
ChiSquare chi_square(const std::vector<double>& observed, const std::vector<double>& expected);

struct Grid {
  double a0 = 0, a1 = 1, b0 = 0, b1 = 1;
  int cells_a = 1, cells_b = 1;
};
using Point = std::array<double, 2>;

// Samples against a density per da db. What falls outside of the grid (NaN for samples that were rejected) is one more
// cell, which expects what the density lacks to 1.
ChiSquare chi_square(const std::vector<Point>& samples, const std::function<double(double, double)>& density,
                     const Grid& grid);

// Integral of f over the grid, each cell adaptively: absolute error about `tolerance`, if f's peaks are not so narrow
// that the 125 points first taken in a cell miss them.
double integrate(const std::function<double(double, double)>& f, const Grid& grid, double tolerance);

}  // namespace itn::test
