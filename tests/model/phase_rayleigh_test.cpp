// Promises of Rayleigh's phase function alone; norm, mean cosine and chi-square are in phase_functions_test.cpp.
#include <catch2/catch.hpp>

#include "../support/lane_function.h"
#include "compare.h"
#include "kernels/model/phase/rayleigh.h"

using namespace itn::test;

TEST_CASE("Rayleigh's phase function has its published values", "[model]") {
  const double none = 0;
  CHECK(rayleigh_value(&none, 0.0) == Approx(3 / (16 * PI_)).epsilon(1e-14));
  CHECK(rayleigh_value(&none, 1.0) == Approx(6 / (16 * PI_)).epsilon(1e-14));
  CHECK(rayleigh_value(&none, -1.0) == rayleigh_value(&none, 1.0));
}

TEST_CASE("Rayleigh's sampled cosine is the inverse of the cumulative distribution, in single precision too",
          "[model]") {
  const int width = GENERATE(1, 16);
  auto u = uniform_numbers(50000, 3);
  u.insert(u.end(), {0.5F / 8388608, 0.25F, 0.5F, 0.75F, 1 - 0.5F / 8388608});
  const Columns out = run_lanes(
      {{"model/phase/rayleigh.h"}, {"u"}, {"c", "s"}, "REAL n[1] = {0}; rayleigh_draw(n, u, &c, &s);"}, width, {u});
  const auto back = [](double c) { return (4 + 3 * c + c * c * c) / 8; };
  double off = 0, off_circle = 0;
  for (std::size_t i = 0; i < u.size(); ++i) {
    const double c = out[0][i], s = out[1][i];
    off = std::max(off, std::abs(back(c) - u[i]));
    off_circle = std::max(off_circle, std::abs(c * c + s * s - 1));
    CHECK(s >= 0);
  }
  CHECK(off < 3e-7);
  CHECK(off_circle < 3e-7);
  double c = 0, s = 0;
  const double none = 0;
  rayleigh_draw(&none, 0.1, &c, &s);
  CHECK(back(c) == Approx(0.1).epsilon(1e-14));
}
