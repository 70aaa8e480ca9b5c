// Promises of every phase function of kernels/model/phase/list.h: normalised, with the mean cosine that it says,
// sampled in proportion to itself. A new one needs no test of its own for these.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "../support/chi_square.h"
#include "../support/lane_function.h"
#include "../support/z_test.h"
#include "itn/model.h"
#include "kernels/model/phase/list.h"

using namespace itn;
using namespace itn::test;

namespace {

constexpr double significance = 1e-6;

struct PhaseUnderTest {
  const Model* model;
  double (*value)(const double* n, double cosine);
  double (*mean_cosine)(const double* n);
};

std::vector<PhaseUnderTest> all_phases() {
  std::vector<PhaseUnderTest> all;
#define ITN_PHASE_UNDER_TEST(name, PREFIX, type)                                         \
  all.push_back({find_model(phase_models(), type),                                       \
                 [](const double* n, double cosine) { return name##_value(n, cosine); }, \
                 [](const double* n) { return name##_mean_cosine(n); }});
  PHASE_LIST(ITN_PHASE_UNDER_TEST)
  return all;
}

// Values of all parameters: shares of their range, in logarithms where it spans many powers of ten.
std::vector<double> parameters_at(const Model& model, double share) {
  std::vector<double> slots;
  for (const DeclaredParameter& p : model.parameters) {
    // sharper peaks than a grid resolves are not tested here
    const bool logarithmic = std::isinf(p.kind.high);
    slots.push_back(logarithmic ? 1e-3 * std::pow(1e6, share) : p.kind.low + (p.kind.high - p.kind.low) * share);
  }
  return slots;
}

const double shares[] = {0.02, 0.3, 0.5, 0.75, 0.96};

}  // namespace

TEST_CASE("every phase function integrates to 1 and has the mean cosine that it says", "[model]") {
  for (const PhaseUnderTest& phase : all_phases())
    for (const double share : shares) {
      const std::vector<double> n = phase.model->to_numbers(0, parameters_at(*phase.model, share));
      CAPTURE(phase.model->name, share, n);
      const Grid grid{-1, 1, 0, 1, 4096, 1};
      const auto density = [&](double c, double) { return 2 * PI_ * phase.value(n.data(), c); };
      CHECK(integrate(density, grid, 1e-9) == Approx(1).epsilon(1e-6));
      CHECK(integrate([&](double c, double b) { return c * density(c, b); }, grid, 1e-9) ==
            Approx(phase.mean_cosine(n.data())).margin(1e-6));
    }
}

TEST_CASE("every phase function's samples follow it (chi-square), with sine and cosine of one angle", "[model][stat]") {
  const int width = GENERATE(1, 16);
  constexpr std::size_t count = 1 << 16;
  for (const PhaseUnderTest& phase : all_phases())
    for (const double share : shares) {
      const std::vector<double> n = phase.model->to_numbers(0, parameters_at(*phase.model, share));
      LaneFunction call{{"model/phase/list.h"}, {"u"}, {"c", "s", "value"}, "REAL n[33] = {"};
      for (std::size_t i = 0; i < 33; ++i) call.body += "(REAL)(" + std::to_string(i < n.size() ? n[i] : 0.0) + "f), ";
      call.body += "};\n" + phase.model->name + "_draw(n, u, &c, &s);\nvalue = " + phase.model->name + "_value(n, c);";
      const Columns out = run_lanes(call, width, {uniform_numbers(count, 4)});
      std::vector<Point> samples;
      double off_circle = 0, off_value = 0;
      for (std::size_t i = 0; i < count; ++i) {
        const double c = out[0][i], s = out[1][i], exact = phase.value(n.data(), c);
        samples.push_back({c, 0.5});
        off_circle = std::max(off_circle, std::abs(c * c + s * s - 1));
        off_value = std::max(off_value, std::abs(out[2][i] - exact) / exact);
      }
      const auto density = [&](double c, double) { return 2 * PI_ * phase.value(n.data(), c); };
      const ChiSquare result = chi_square(samples, density, {-1, 1 + 1e-6, 0, 1, 200, 1});
      CAPTURE(phase.model->name, share, width, result.statistic, result.degrees_of_freedom, n);
      CHECK(result.p_value > significance);
      CHECK(off_circle < 1e-5);
      CHECK(off_value < 1e-3);  // of a peak as sharp as 1e-3 the rounded cosine knows three digits
    }
}
