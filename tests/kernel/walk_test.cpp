// The bare walk that itn bench measures scattering against does scatter: its drift is known.
#include <catch2/catch.hpp>
#include <cmath>

#include "itn/device.h"

using namespace itn;

// The mean cosine between a flight and the first is g^k after k scatterings, so paths that start along z end at
// z = (1 - g^n) / ((1 - g) sigma_t) in the mean, and at x = y = 0.
TEST_CASE("n flights of a walk lead as far ahead as g says") {
  const Device device;
  constexpr int flights = 12;
  constexpr double sigma_t = 2;
  constexpr std::size_t n = 1 << 16;
  for (const int width : {1, 4, 8, 16})
    for (const double g : {-0.5, 0.0, 0.8}) {
      cl::Kernel walk(device.build("walk.cl", {{"WIDTH", std::to_string(width)}}), "walk");
      std::vector<float> ends(n);
      const cl::Buffer out = device.upload(ends, "ends");
      walk.setArg(0, static_cast<float>(sigma_t));
      walk.setArg(1, static_cast<float>(g));
      walk.setArg(2, cl_int{flights});
      walk.setArg(3, cl_uint{3});
      walk.setArg(4, out);
      device.launch(walk, n / static_cast<std::size_t>(width), 1);
      device.finish();
      device.download(out, ends);
      double sum = 0, square = 0;
      for (const double end : ends) {
        sum += end;
        square += end * end;
      }
      const double mean = sum / n, stderr_ = std::sqrt((square / n - mean * mean) / n),
                   expected = (1 - std::pow(g, flights)) / ((1 - g) * sigma_t);
      CAPTURE(width, g, mean, stderr_, expected);
      CHECK(std::abs(mean - expected) < 4 * stderr_);
    }
}
