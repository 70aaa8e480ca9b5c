// Mean and standard error of a made-up pixel's samples, from all of them and from two halves.
#include "runtime/image/halves.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <vector>

using namespace itn;

namespace {

Rendering of(const std::vector<double>& samples) {
  const auto n = static_cast<double>(samples.size());
  double sum = 0, squares = 0;
  for (const double sample : samples) sum += sample;
  for (const double sample : samples) squares += std::pow(sample - sum / n, 2);
  Rendering result;
  result.spp = static_cast<int>(samples.size());
  result.mean = {static_cast<float>(sum / n)};
  result.stderr_ = {static_cast<float>(std::sqrt(squares / (n * (n - 1))))};
  return result;
}

}  // namespace

TEST_CASE("mean and standard error from two halves of the samples are those of all samples") {
  std::mt19937_64 random(4);
  std::exponential_distribution<double> draw;
  for (const std::size_t count : {4, 10, 64}) {
    std::vector<double> all(count);
    for (double& sample : all) sample = draw(random);
    const auto middle = all.begin() + static_cast<std::ptrdiff_t>(count / 2);
    const Rendering whole = whole_of(of({all.begin(), middle}), of({middle, all.end()})), expected = of(all);
    CHECK(whole.spp == expected.spp);
    CHECK(whole.mean[0] == Approx(expected.mean[0]).epsilon(1e-6));
    CHECK(whole.stderr_[0] == Approx(expected.stderr_[0]).epsilon(1e-5));
  }
}
