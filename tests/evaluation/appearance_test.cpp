// Measures of how much images differ, whatever their noise.
#include "network/evaluation/appearance.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "itn/error.h"
#include "network/dataset/stored_image.h"
#include "runtime/base/random.h"
#include "tests/support/temporary_folder.h"

using namespace itn;

namespace {

constexpr int size = 32;
constexpr std::size_t pixels = std::size_t{size} * size;

double scene(std::size_t pixel) { return 1 + 0.5 * std::sin(0.1 * static_cast<double>(pixel % size * (pixel / size))); }

Rendering rendered(double brighter, double noise, std::uint64_t seed) {
  Rendering r;
  r.width = r.height = size;
  r.channels = 1;
  for (std::size_t i = 0; i < pixels; ++i) {
    r.mean.push_back(static_cast<float>(scene(i) + brighter + noise * random_normal(seed, 0, i)));
    r.stderr_.push_back(static_cast<float>(noise));
  }
  return r;
}

NoisyImage input(double noise, std::uint64_t seed) {
  NoisyImage image;
  for (std::size_t i = 0; i < pixels; ++i) {
    image.value.push_back(static_cast<float>(scene(i) + noise * random_normal(seed, 1, i)));
    image.error.push_back(static_cast<float>(noise));
  }
  return image;
}

}  // namespace

TEST_CASE("equal images have no difference, and MS-SSIM 1") {
  const Difference d = difference(rendered(0, 0, 0), input(0, 0));
  CHECK(d.mean_square == 0);
  CHECK(d.seen_mean_square == 0);
  CHECK(std::abs(d.structure) < 1e-12);
}

TEST_CASE("the noise of both images is taken out of the mean square, and no more than it") {
  constexpr int trials = 200;
  for (const double brighter : {0.0, 0.05}) {
    double mean = 0, square = 0, seen = 0;
    for (int t = 0; t < trials; ++t) {
      const auto seed = static_cast<std::uint64_t>(t);
      const Difference d = difference(rendered(brighter, 0.1, seed), input(0.2, seed));
      mean += d.mean_square / trials;
      square += d.mean_square * d.mean_square / trials;
      seen += d.seen_mean_square / trials;
      CHECK(d.structure > 0.01);
    }
    const double deviation = std::sqrt((square - mean * mean) / trials);
    CAPTURE(brighter, mean, deviation);
    CHECK(std::abs(mean - brighter * brighter) < 4 * deviation);
    CHECK(deviation < 0.001);
    CHECK(seen == Approx(brighter * brighter + 0.05).epsilon(0.02));
  }
}

TEST_CASE("a data set's image is read with its noise, and refused without it") {
  const TemporaryFolder folder;
  Manifest set;
  set.size = 2;
  set.hash = "00000000000000aa";
  Manifest::Image image;
  image.file = "a.exr";
  write_stored(folder / "", set, image, {2, 2, {"Y", "stderr.Y"}, {1, 0.1F, 2, 0.2F, 3, 0.3F, 4, 0.4F}, {}});
  const NoisyImage read = read_noisy_image(folder / "", set, image);
  CHECK(read.value == std::vector<float>{1, 2, 3, 4});
  CHECK(read.error == std::vector<float>{0.1F, 0.2F, 0.3F, 0.4F});
  write_stored(folder / "", set, image, {2, 2, {"Y"}, {1, 2, 3, 4}, {}});
  CHECK_THROWS_WITH(read_noisy_image(folder / "", set, image), Catch::Contains("no channel stderr.Y"));
  write_stored(folder / "", set, image, {2, 2, {"Y", "stderr.Y"}, {1, -0.1F, 2, 0.2F, 3, 0.3F, 4, 0.4F}, {}});
  CHECK_THROWS_AS(read_noisy_image(folder / "", set, image), InputError);
}
