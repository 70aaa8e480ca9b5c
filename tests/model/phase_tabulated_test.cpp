// Promises of the tabulated phase function alone: it is in proportion to its table, of any number of values, also
// where some are 0, and its samples follow it.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "../support/chi_square.h"
#include "../support/lane_function.h"
#include "kernels/model/phase/tabulated.h"
#include "runtime/scene/model/phase_formula.h"
#include "runtime/scene/model/sized_model.h"

using namespace itn;
using namespace itn::test;

namespace {

constexpr double significance = 1e-6;

std::vector<std::vector<double>> tables() {
  std::vector<std::vector<double>> result{{1, 3}, {0, 2}, {5, 0}, {0, 1, 0}, {1, 0, 0, 4}, {2, 1, 0.3, 0.2, 0.4, 9}};
  for (const int size : {32, TABULATED_MOST}) {
    std::vector<double> longest;
    for (int i = 0; i < size; ++i) longest.push_back(i % 7 == 3 ? 0 : std::exp(3.2 * i / size) + (i * 37) % 5);
    result.push_back(longest);
  }
  return result;
}

// Straight between the values, without a norm.
double between(const std::vector<double>& table, double cosine) {
  const double x = (cosine + 1) / 2 * static_cast<double>(table.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(x), table.size() - 2);
  const double t = x - static_cast<double>(i);
  return (1 - t) * table[i] + t * table[i + 1];
}

}  // namespace

TEST_CASE("a tabulated phase function is its table, made to integrate to 1", "[model]") {
  for (const std::vector<double>& table : tables()) {
    CAPTURE(table);
    const Model& model = tabulated_model(table.size());
    REQUIRE(model.parameters.size() == table.size());
    const std::vector<double> n = model.to_numbers(0, table);
    double sum = 0, moment = 0;  // midpoints, so many that no cell is missed
    constexpr int steps = 200'000;
    for (int i = 0; i < steps; ++i) {
      const double c = -1 + (i + 0.5) * 2 / steps;
      sum += between(table, c) * 2 / steps;
      moment += c * between(table, c) * 2 / steps;
    }
    for (const double c : {-1.0, -0.93, -0.5, 0.0, 0.123, 0.77, 1.0})
      CHECK(tabulated_value(model.table, n.data(), c) ==
            Approx(between(table, c) / (2 * PI_ * sum)).epsilon(1e-6).margin(1e-12));
    const std::vector<double> mean = mean_cosine(model, table);
    CHECK(mean.at(0) == Approx(moment / sum).margin(1e-6));
    REQUIRE(mean.size() == 1 + table.size());
    // A factor on all values changes nothing.
    double along = 0;
    for (std::size_t i = 0; i < table.size(); ++i) along += table[i] * mean[1 + i];
    CHECK(along == Approx(0).margin(1e-12));
  }
}

TEST_CASE("numbers of a table change with its values as differences say", "[model]") {
  const std::vector<double> table = tables()[5];
  const Model& model = tabulated_model(table.size());
  const auto by = model.jacobian(0, table);
  for (std::size_t k = 0; k < table.size(); ++k) {
    const double h = 1e-6 * table[k];
    std::vector<double> low = table, high = table;
    low[k] -= h;
    high[k] += h;
    const auto below = model.to_numbers(0, low), above = model.to_numbers(0, high);
    for (std::size_t i = 0; i < by.size(); ++i)
      CHECK(by[i].at(k) == Approx((above[i] - below[i]) / (2 * h)).epsilon(1e-6).margin(1e-9));
  }
}

TEST_CASE("samples of a tabulated phase function follow it (chi-square)", "[model][stat]") {
  const int width = GENERATE(1, 16);
  constexpr std::size_t count = 1 << 16;
  for (const std::vector<double>& table : tables()) {
    const Model& model = tabulated_model(table.size());
    const std::vector<double> n = model.to_numbers(0, table);
    LaneFunction call{{"model/phase/tabulated.h"}, {"u"}, {"c", "s"}, "REAL n[] = {"};
    for (const double x : n) call.body += "(REAL)(" + std::to_string(x) + "f), ";
    call.body += "};\ntabulated_draw(" + std::to_string(table.size()) + ", n, u, &c, &s);";
    const Columns out = run_lanes(call, width, {uniform_numbers(count, 4)});
    std::vector<Point> samples;
    double off_circle = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const double c = out[0][i], s = out[1][i];
      samples.push_back({c, 0.5});
      off_circle = std::max(off_circle, std::abs(c * c + s * s - 1));
    }
    const auto density = [&](double c, double) { return 2 * PI_ * tabulated_value(model.table, n.data(), c); };
    const ChiSquare result = chi_square(samples, density, {-1, 1 + 1e-6, 0, 1, 200, 1});
    CAPTURE(table, width, result.statistic, result.degrees_of_freedom);
    CHECK(result.p_value > significance);
    CHECK(off_circle < 1e-5);
  }
}
