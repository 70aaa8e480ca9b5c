#include <algorithm>
#include <catch2/catch.hpp>

#include "../support/chi_square.h"
#include "../support/lane_function.h"
#include "../support/z_test.h"
#include "compare.h"
#include "kernels/model/phase/henyey_greenstein.h"

using namespace itn::test;

namespace {

constexpr double significance = 1e-6;

const LaneFunction phase{{"model/phase/henyey_greenstein.h"},
                         {"cosine", "g", "u"},
                         {"value", "c", "s"},
                         "value = henyey_greenstein(cosine, g); henyey_greenstein_sample(g, u, &c, &s);"};

}  // namespace

TEST_CASE("Henyey-Greenstein integrates to 1 and has mean cosine g", "[model]") {
  const double g = GENERATE(-0.95, -0.5, 0.0, 1e-4, 0.3, 0.9, 0.99);
  const Grid all{-1, 1, 0, 1, 4096, 1};
  const auto density = [&](double c, double) { return 2 * PI_ * henyey_greenstein(c, g); };
  CHECK(integrate(density, all, 1e-9) == Approx(1).epsilon(1e-7));
  CHECK(integrate([&](double c, double b) { return c * density(c, b); }, all, 1e-9) == Approx(g).margin(1e-7));
}

TEST_CASE("Henyey-Greenstein with g 0 is isotropic", "[model]") {
  CHECK(henyey_greenstein(-0.7, 0.0) == Approx(1 / (4 * PI_)).epsilon(1e-14));
  double c = 0, s = 0;
  henyey_greenstein_sample(0.0, 0.25, &c, &s);
  CHECK(c == Approx(-0.5));
}

TEST_CASE("Henyey-Greenstein on the device matches double precision", "[model]") {
  const int width = GENERATE(1, 16);
  constexpr std::size_t n = 50000;
  const auto cosine = uniform_numbers(n, 1, -1, 1), g = uniform_numbers(n, 2, -0.98, 0.98), u = uniform_numbers(n, 3);
  const Columns out = run_lanes(phase, width, {cosine, g, u});
  CHECK(largest_error(out[0], 0, [&](auto i) { return henyey_greenstein<double>(cosine[i], g[i]); }) < 2e-6);
  const auto exact = [&](auto i, bool sine) {
    double c = 0, s = 0;
    henyey_greenstein_sample<double>(g[i], u[i], &c, &s);
    return sine ? s : c;
  };
  CHECK(largest_error(out[1], 1, [&](auto i) { return exact(i, false); }) < 1e-6);
  CHECK(largest_error(out[2], 0, [&](auto i) { return exact(i, true); }) < 3e-6);
}

TEST_CASE("Henyey-Greenstein keeps its digits in the sharpest peaks, also where rounding puts a cosine beyond 1",
          "[model]") {
  const int width = GENERATE(1, 16);
  Columns in(3);
  for (const float g : {0.98f, 0.999f, 0.9999f, 0.99999f, 0.999999f})
    for (const float c :
         {1 + 3e-7f, 1 + 1.2e-7f, 1.f, 1 - 6e-8f, 1 - 1e-6f, 0.999f, 0.5f, 0.f, -0.5f, -1.f, -1 - 3e-7f})
      for (const float sign : {1.f, -1.f}) {
        in[0].push_back(sign * c);
        in[1].push_back(sign * g);
        in[2].push_back(0.5f);
      }
  const auto exact = [&](auto i) {
    const long double g = in[1][i], c = std::clamp(in[0][i], -1.f, 1.f);  // double would lose four digits
    return static_cast<double>((1 - g * g) / (4 * PI_ * std::pow(1 + g * g - 2 * g * c, 1.5L)));
  };
  CHECK(largest_error(run_lanes(phase, width, in)[0], 0, exact) < 2e-6);
}

TEST_CASE("Henyey-Greenstein's sampled sine and cosine are of one angle, also in the sharpest peak", "[model]") {
  const double g = GENERATE(-0.9999, -0.3, 0.0, 1e-6, 0.9999);
  for (const double u : {1e-7, 0.01, 0.5, 0.99, 1 - 1e-7}) {
    double c = 0, s = 0;
    henyey_greenstein_sample(g, u, &c, &s);
    CHECK(c * c + s * s == Approx(1).epsilon(1e-12));
    CHECK(s >= 0);
  }
}

TEST_CASE("Henyey-Greenstein samples follow their density (chi-square) with mean cosine g (z-test)", "[model][stat]") {
  const int width = GENERATE(1, 16);
  const float g = GENERATE(-0.9f, -0.4f, 0.f, 1e-4f, 0.3f, 0.6f, 0.8f, 0.95f);
  constexpr std::size_t n = 1 << 17;
  const Columns out =
      run_lanes(phase, width, {std::vector<float>(n, 0.f), std::vector<float>(n, g), uniform_numbers(n, 4)});
  std::vector<Point> samples;
  double sum = 0, sum2 = 0;
  for (const float c : out[1]) {
    samples.push_back({c, 0.5});
    sum += c;
    sum2 += c * c;
  }
  const auto density = [&](double c, double) { return 2 * PI_ * henyey_greenstein<double>(c, g); };
  const ChiSquare result = chi_square(samples, density, {-1, 1 + 1e-6, 0, 1, 200, 1});
  INFO("g " << g << ", chi-square " << result.statistic << ", degrees of freedom " << result.degrees_of_freedom);
  CHECK(result.p_value > significance);
  const double mean = sum / n, error = std::sqrt((sum2 / n - mean * mean) / n);
  CHECK(std::abs(mean - g) / error < largest_z_bound(1, significance));
}
