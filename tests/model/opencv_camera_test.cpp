// OpenCV's distortion: where a point appears, and back.
#include <array>
#include <catch2/catch.hpp>
#include <cmath>

#include "../support/lane_function.h"
#include "kernels/model/sensor/opencv.h"

using namespace itn::test;

namespace {

using Distortion = std::array<double, 8>;  // k1 to k6, p1, p2

// A telephone's camera, a wide angle with the rational model, and one that is off its axis.
const std::array<Distortion, 3> cameras{{{0.12, -0.25, 0.1, 0, 0, 0, 1e-3, -5e-4},
                                         {6.2, 3.1, 0.2, 6.6, 5.0, 1.0, 2e-4, 3e-4},
                                         {-0.28, 0.07, 0, 0, 0, 0, 4e-3, 6e-3}}};

// As OpenCV's manual writes it.
std::array<double, 2> manual(const Distortion& d, double x, double y) {
  const auto [k1, k2, k3, k4, k5, k6, p1, p2] = d;
  const double r = std::hypot(x, y);
  const double radial = (1 + k1 * std::pow(r, 2) + k2 * std::pow(r, 4) + k3 * std::pow(r, 6)) /
                        (1 + k4 * std::pow(r, 2) + k5 * std::pow(r, 4) + k6 * std::pow(r, 6));
  return {x * radial + 2 * p1 * x * y + p2 * (r * r + 2 * x * x),
          y * radial + p1 * (r * r + 2 * y * y) + 2 * p2 * x * y};
}

}  // namespace

TEST_CASE("a distorted point is where OpenCV's manual has it, and is found again") {
  for (const Distortion& d : cameras)
    for (double x = -0.6; x < 0.65; x += 0.1)
      for (double y = -0.45; y < 0.5; y += 0.1) {
        double to_x = 0, to_y = 0, u = 0, v = 0;
        opencv_distort(d.data(), x, y, &to_x, &to_y);
        CHECK(to_x == Approx(manual(d, x, y)[0]).margin(1e-12));
        CHECK(to_y == Approx(manual(d, x, y)[1]).margin(1e-12));
        opencv_undistort(d.data(), to_x, to_y, &u, &v);
        CHECK(u == Approx(x).margin(1e-9));
        CHECK(v == Approx(y).margin(1e-9));
      }
}

TEST_CASE("the device finds a distorted point again to a thousandth of a pixel") {
  for (const Distortion& d : cameras)
    for (const int width : {1, 16}) {
      const Columns in{uniform_numbers(4096, 1, -0.6, 0.6), uniform_numbers(4096, 2, -0.45, 0.45)};
      std::string body = "REAL k[8] = {";
      for (const double k : d) body += "(REAL)(" + std::to_string(k) + "f), ";
      const Columns out =
          run_lanes({{"model/sensor/opencv.h"}, {"x", "y"}, {"u", "v"}, body + "}; opencv_undistort(k, x, y, &u, &v);"},
                    width, in);
      double worst = 0;
      for (std::size_t i = 0; i < in[0].size(); ++i) {
        const auto [x, y] = manual(d, static_cast<double>(out[0][i]), static_cast<double>(out[1][i]));
        worst = std::max(worst, std::hypot(x - static_cast<double>(in[0][i]), y - static_cast<double>(in[1][i])));
      }
      CHECK(worst < 1e-3 / 3000);  // of a focal length of 3,000 pixels
    }
}
