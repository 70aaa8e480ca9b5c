// Whether an image fits, and what several ends say together, on made-up residuals.
#include "runtime/inverse/image_fit.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "runtime/inverse/gauss_newton/inversion_outcome.h"

using namespace itn;

namespace {

WhiteResidual noise(std::mt19937_64& random, int size, int channels, double deviation = 1) {
  std::normal_distribution<double> normal(0, deviation);
  WhiteResidual result{size, size, channels, {}};
  for (int i = 0; i < size * size * channels; ++i) result.value.push_back(normal(random));
  return result;
}

// Adds a gentle slope from -most to most.
WhiteResidual sloped(WhiteResidual residual, double most) {
  const auto channels = static_cast<std::size_t>(residual.channels), width = static_cast<std::size_t>(residual.width);
  for (std::size_t i = 0; i < residual.value.size(); ++i)
    residual.value[i] += most * (2 * static_cast<double>((i / channels) % width) / static_cast<double>(width - 1) - 1);
  return residual;
}

}  // namespace

TEST_CASE("noise fits: a false alarm is rare, since the exit code hangs on it") {
  std::mt19937_64 random(1);
  int alarms = 0, high = 0;
  constexpr int images = 300;
  for (int k = 0; k < images; ++k) {
    const ImageFit fit = image_fit({noise(random, 12, k % 2 == 0 ? 1 : 3)}, true);
    alarms += !fit.fits();
    high += fit.chance > 0.5;
  }
  CHECK(alarms <= 5);  // one in 400 by structure, fewer by size: more in one of 300 series
  CHECK(std::abs(high - images / 2) < 30);
}

TEST_CASE("a misfit far below the noise of a pixel is found where neighbours share it") {
  std::mt19937_64 random(2);
  for (int k = 0; k < 10; ++k) {
    const ImageFit fit = image_fit({sloped(noise(random, 32, 1), 0.4)}, true);
    CHECK(fit.size() == 0);  // the squares alone do not tell: 1.05 in place of 1
    CHECK_FALSE(fit.looks_alike());
    // Nor does it need to know how strong the noise is.
    WhiteResidual strong = sloped(noise(random, 32, 1), 0.4);
    for (double& v : strong.value) v *= 7;
    CHECK_FALSE(image_fit({strong}, false).fits());
  }
}

TEST_CASE("noise of another size is said to be so, where it is known") {
  std::mt19937_64 random(3);
  const WhiteResidual strong = noise(random, 24, 1, 1.3), weak = noise(random, 24, 1, 0.7);
  CHECK(image_fit({strong}, true).size() == 1);
  CHECK(image_fit({weak}, true).size() == -1);
  CHECK(image_fit({strong}, true).looks_alike());
  CHECK(image_fit({strong}, false).fits());
}

TEST_CASE("channels of a pixel that are alike are no structure, and pixels that are not compared do not count") {
  std::mt19937_64 random(4);
  WhiteResidual grey = noise(random, 24, 3);
  for (std::size_t i = 0; i < grey.value.size(); ++i) grey.value[i] = grey.value[i - i % 3];
  CHECK(image_fit({grey}, true).fits());
  WhiteResidual masked = sloped(noise(random, 24, 1), 3);
  for (std::size_t i = 0; i < masked.value.size(); ++i)
    if (i % 24 < 8 || i % 24 >= 16) masked.value[i] = 0;
  CHECK(image_fit({masked}, true).values == 24 * 8);
  CHECK(image_fit({WhiteResidual{4, 4, 1, std::vector<double>(16, 0)}}, true).fits());
}

namespace {

// An end at `x` with a standard error of 1, where so much more than the noise is left.
InversionRun ended(double x, double left, bool converged, std::mt19937_64 random) {
  InversionRun run;
  run.end.x = {x};
  run.end.covariance = Eigen::MatrixXd::Identity(1, 1);
  run.end.converged = converged;
  run.end.white = {sloped(noise(random, 20, 1), left)};
  run.end.fit = image_fit(run.end.white, true);
  return run;
}

}  // namespace

TEST_CASE("several ends: the best fits best; one that fits as well elsewhere is a rival, one that fits worse is not") {
  const std::mt19937_64 random(5);
  const std::vector<InversionRun> wrong_first{ended(-30, 1, true, random), ended(0, 0, true, random)};
  Agreement a = agreement(wrong_first);
  CHECK(a.best == 1);
  CHECK(a.same == 1);
  CHECK(a.rivals.empty());
  CHECK_FALSE(a.sure(wrong_first[1].end));

  a = agreement({ended(-30, 1, true, random), ended(0, 0, true, random), ended(0.5, 0, true, random)});
  CHECK(a.same == 2);
  CHECK_FALSE(a.sure(wrong_first[1].end));  // three starts are few
  a.count = least_starts;
  CHECK(a.sure(wrong_first[1].end));
  CHECK_FALSE(a.sure(wrong_first[0].end));  // its image does not fit

  a = agreement({ended(-30, 0, true, random), ended(0, 0.02, true, random)});
  CHECK(a.rivals.size() == 1);
  CHECK(a.sure(wrong_first[1].end));

  // Nor is one that leaves a pattern where the best leaves none, even if pixel by pixel it is as good.
  const InversionRun plain = ended(0, 0.02, true, random);
  InversionRun patterned = ended(-30, 0, true, random);
  patterned.end.fit.chance = 0.001;
  REQUIRE(plain.end.fit.looks_alike());
  a = agreement({patterned, plain});
  CHECK(a.best == 1);
  CHECK(a.rivals.empty());
  CHECK(agreement({plain, patterned}).rivals.empty());
  InversionRun another = plain;
  another.end.fit.chance = 0.001;
  CHECK(agreement({patterned, another}).rivals.size() == 1);  // both leave one

  // One that did not converge is the best only where what did leaves more.
  CHECK(agreement({ended(-30, 0, false, random), ended(0, 0.02, true, random)}).best == 1);
  CHECK(agreement({ended(-30, 0, false, random), ended(0, 1, true, random)}).best == 0);
}
