#include "kernels/model/shading_frame.h"

#include <catch2/catch.hpp>

#include "../support/lane_function.h"
#include "compare.h"

using namespace itn::test;

TEST_CASE("shading frames are orthonormal and right-handed, also at the poles", "[model]") {
  const int width = GENERATE(1, 16);
  const LaneFunction model{{"model/shading_frame.h"},
                           {"nx", "ny", "nz"},
                           {"worst", "determinant", "round_trip"},
                           R"(
  REAL3 n = make3(nx, ny, nz), s, t;
  shading_frame(n, &s, &t);
  REAL a = MAX(fabs(dot3(s, s) - 1.0f), fabs(dot3(t, t) - 1.0f));
  REAL b = MAX(fabs(dot3(s, t)), MAX(fabs(dot3(s, n)), fabs(dot3(t, n))));
  worst = MAX(a, b);
  determinant = dot3(cross3(s, t), n);
  REAL3 v = make3(NUMBER(0.2), NUMBER(-0.7), NUMBER(0.5));
  REAL3 d = sub3(to_world(s, t, n, to_local(s, t, n, v)), v);
  round_trip = SQRT(dot3(d, d));)"};
  const auto z = uniform_numbers(20000, 1, -1, 1), phi = uniform_numbers(20000, 2, 0, 6.28);
  Columns in(3);
  for (std::size_t i = 0; i < z.size(); ++i) {
    const double r = std::sqrt(1 - static_cast<double>(z[i]) * z[i]);
    in[0].push_back(static_cast<float>(r * std::cos(phi[i])));
    in[1].push_back(static_cast<float>(r * std::sin(phi[i])));
    in[2].push_back(z[i]);
  }
  for (const float pole : {1.f, -1.f}) {
    for (const float tilt : {0.f, 1e-8f, -1e-4f}) {
      in[0].push_back(tilt);
      in[1].push_back(tilt);
      in[2].push_back(pole);
    }
  }
  const Columns out = run_lanes(model, width, in);
  CHECK(largest_error(out[0], 1, [](auto) { return 0; }) < 1e-6);
  CHECK(largest_error(out[1], 0, [](auto) { return 1; }) < 1e-6);
  CHECK(largest_error(out[2], 1, [](auto) { return 0; }) < 1e-6);
}
