// MS-SSIM against pytorch-msssim 1.0: ms_ssim_pytorch.py makes the same images and prints the figures below.
#include "network/model/ms_ssim.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <numeric>

#include "itn/error.h"

namespace {

struct Pair {
  std::vector<float> image, reference;
};

Pair images(int width, int height) {
  Pair pair;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const double reference = 0.5 + 0.25 * std::sin(0.07 * x + 0.11 * y) + 0.2 * std::sin(0.9 * x) * std::cos(1.3 * y);
      pair.reference.push_back(static_cast<float>(reference));
      pair.image.push_back(static_cast<float>(0.02 + 0.9 * reference + 0.05 * std::sin(2.1 * x - 0.4 * y)));
    }
  return pair;
}

double compare(int width, int height) {
  const Pair pair = images(width, height);
  return itn::ms_ssim(pair.image, pair.reference, width, height, 1.0);
}

// pytorch-msssim's window is in single precision: some 1e-7.
Approx about(double value) { return Approx(value).margin(1e-6).epsilon(0); }

}  // namespace

TEST_CASE("MS-SSIM over five scales is pytorch-msssim's") {
  CHECK(compare(176, 176) == about(0.9859687163986105));
  CHECK(compare(256, 192) == about(0.9859624823253227));
}

TEST_CASE("MS-SSIM of 128 and 64 pixels is pytorch-msssim's over four and three scales") {
  CHECK(compare(128, 128) == about(0.9844252452505455));
  CHECK(compare(64, 64) == about(0.9808512362016887));
  CHECK(compare(96, 64) == about(0.9805639865868208));
}

TEST_CASE("MS-SSIM of equal images is 1, of opposite ones 0, and does not change with the unit") {
  Pair pair = images(64, 64);
  CHECK(itn::ms_ssim(pair.image, pair.image, 64, 64, 1.0) == Approx(1).margin(1e-12));
  const double similarity = itn::ms_ssim(pair.image, pair.reference, 64, 64, 1.0);
  std::vector<float> opposite;
  for (const float value : pair.image) opposite.push_back(1 - value);
  CHECK(itn::ms_ssim(opposite, pair.image, 64, 64, 1.0) == 0);
  for (float& value : pair.image) value *= 8;
  for (float& value : pair.reference) value *= 8;
  CHECK(itn::ms_ssim(pair.image, pair.reference, 64, 64, 8.0) == Approx(similarity).epsilon(1e-12));
}

TEST_CASE("MS-SSIM takes as many scales as hold the window") {
  const auto scales = [](int side) { return itn::ms_ssim_weights(side).size(); };
  CHECK(scales(11) == 1);
  CHECK(scales(43) == 2);
  CHECK(scales(44) == 3);
  CHECK(scales(87) == 3);
  CHECK(scales(88) == 4);
  CHECK(scales(175) == 4);
  CHECK(scales(176) == 5);
  CHECK(scales(4096) == 5);
  const std::vector<double> weights = itn::ms_ssim_weights(64);
  CHECK(std::accumulate(weights.begin(), weights.end(), 0.0) == Approx(1).epsilon(1e-14));
  CHECK_THROWS_AS(scales(10), itn::UsageError);
}

TEST_CASE("MS-SSIM refuses images of another size and a data range of 0") {
  const Pair pair = images(16, 16);
  CHECK_THROWS_AS(itn::ms_ssim(pair.image, pair.reference, 16, 17, 1.0), itn::UsageError);
  CHECK_THROWS_AS(itn::ms_ssim(pair.image, pair.reference, 16, 16, 0.0), itn::UsageError);
}
