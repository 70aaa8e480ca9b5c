// The 95 % intervals of inversions hold the truth as often as they say.
#include <catch2/catch.hpp>

#include "runtime/inversion/uncertainty.h"
#include "tests/inversion/small_scene.h"

using namespace itn;
using namespace itn::test;

namespace {

struct Coverage {
  int inversions = 0, converged = 0, intervals = 0, covered = 0;
  double square = 0;  // of (found - truth) / standard error, in coordinates
};

// Materials drawn from where the ball is neither clear nor opaque, each with a target of its own and a start within
// half a unit of each coordinate (sigma_t: a factor of 1.6): from farther away some end in another minimum.
Coverage measure(int inversions, std::uint64_t seed) {
  const Device& device = test::device();
  const std::vector<std::string> names{"fog.sigma_t", "fog.albedo", "phase.g"};
  std::mt19937_64 random(seed);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  Coverage coverage;
  for (int k = 0; k < inversions; ++k) {
    const double truth[3] = {uniform(1, 6), uniform(0.4, 0.95), uniform(-0.2, 0.8)};
    const std::vector<TargetImage> targets{rendered_target(device, fog_ball(truth[0], truth[1], truth[2]), 1024,
                                                           seed * 1000 + 2 * static_cast<std::uint64_t>(k))};
    RenderOptions options;
    options.seed = seed * 1000 + 2 * static_cast<std::uint64_t>(k) + 1;
    ForwardModel model(device, fog_ball(truth[0], truth[1], truth[2]), names, {0}, options);
    std::vector<double> start = model.start();
    for (double& x : start) x += uniform(-0.5, 0.5);
    InversionOptions how;
    how.spp = 4096;
    Inversion inversion(model, targets, how);
    const Inversion::Conclusion end = invert(inversion, start);
    coverage.inversions += 1;
    coverage.converged += end.converged;
    if (!end.converged) continue;
    const std::vector<Interval> found = intervals(model.coordinates(), end.x, end.covariance);
    for (std::size_t p = 0; p < 3; ++p) {
      coverage.intervals += 1;
      coverage.covered += found[p].low <= truth[p] && truth[p] <= found[p].high;
      const auto i = static_cast<Eigen::Index>(p);
      const double off = end.x[p] - model.coordinates()[p].of(truth[p]);
      coverage.square += off * off / end.covariance(i, i);
    }
  }
  return coverage;
}

}  // namespace

TEST_CASE("95 % intervals hold the truth in 90 to 98 % of 200 inversions", "[.coverage]") {
  const Coverage c = measure(200, 1);
  WARN(c.converged << " of " << c.inversions << " converged; " << c.covered << " of " << c.intervals
                   << " intervals hold the truth; mean square of the error over its standard error "
                   << c.square / c.intervals);
  CHECK(c.converged >= 190);
  CHECK(c.covered >= 0.90 * c.intervals);
  CHECK(c.covered <= 0.98 * c.intervals);
}

TEST_CASE("95 % intervals hold the truth", "[stat]") {
  const Coverage c = measure(6, 2);
  CAPTURE(c.converged, c.covered, c.intervals, c.square / c.intervals);
  CHECK(c.converged == 6);
  CHECK(c.covered >=
        13);  // of 18: fewer in one of 500 sets of intervals that hold with 95 %, the three of an image alone
}
