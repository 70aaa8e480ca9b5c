// The 95 % intervals of inversions hold the truth as often as they say.
#include <Eigen/Cholesky>
#include <array>
#include <catch2/catch.hpp>
#include <chrono>

#include "runtime/inverse/gauss_newton/uncertainty.h"
#include "runtime/inverse/posterior/posterior_outcome.h"
#include "tests/inversion/small_scene.h"
#include "tests/support/temporary_folder.h"

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

// Results of both methods for the same photos, without a start: the posterior knows the distribution that materials are
// drawn from, Gauss-Newton starts from a material drawn like the photo's.
struct Comparison {
  int photos = 0, settled = 0, joint = 0, covered = 0;
  int converged = 0, gauss_newton_intervals = 0, gauss_newton_covered = 0;
  std::array<double, 3> square{}, gauss_newton_square{}, converged_square{};  // of errors of values
  double renderings = 0, seconds = 0, gauss_newton_seconds = 0;
};

Comparison compare(int photos, std::uint64_t seed) {
  const Device& device = test::device();
  const std::vector<std::string> names{"fog.sigma_t", "fog.albedo", "phase.g"};
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  Comparison result;
  const TemporaryFolder folder;
  ForwardModel model(device, fog_ball(2, 0.7, 0.3), names, {0}, RenderOptions());
  const std::vector<Coordinate>& coordinates = model.coordinates();
  const std::vector<NaturalRange> ranges{{coordinates[0].parameter(), 1, 6},
                                         {coordinates[1].parameter(), 0.4, 0.95},
                                         {coordinates[2].parameter(), -0.2, 0.8}};
  // even in the value where the prior is
  const auto draw = [&](std::size_t p) {
    const double u = (uniform(random) + 1) / 2, low = ranges[p].low(), high = ranges[p].high();
    return p == 0 ? low * std::pow(high / low, u) : low + u * (high - low);
  };
  const auto now = [] { return std::chrono::steady_clock::now(); };
  const auto since = [&](auto start) { return std::chrono::duration<double>(now() - start).count(); };
  RenderingStore store(folder / "renderings", {{"scene", "fog ball"}}, 3);
  for (int k = 0; k < photos; ++k) {
    const std::array<double, 3> truth{draw(0), draw(1), draw(2)};
    const std::vector<TargetImage> targets{rendered_target(device, fog_ball(truth[0], truth[1], truth[2]), 1024,
                                                           1000 * seed + static_cast<std::uint64_t>(k))};
    std::vector<double> start;
    for (std::size_t p = 0; p < 3; ++p) start.push_back(coordinates[p].of(draw(p)));
    ++result.photos;

    PosteriorOptions how;
    how.seed = static_cast<std::uint64_t>(k);
    auto clock = now();
    StoredPosterior stored(folder / std::to_string(k), {{"photo", k}}, store, model, ranges, targets, how);
    while (!stored.done()) stored.advance();
    result.seconds += since(clock);
    result.settled += stored.posterior().rounds().back().settled;
    result.renderings += static_cast<double>(stored.made());
    const Eigen::MatrixXd& samples = stored.posterior().samples().at;
    Eigen::VectorXd at(3);
    for (std::size_t p = 0; p < 3; ++p) {
      const auto i = static_cast<Eigen::Index>(p);
      at[i] = ranges[p].of(truth[p]);
      const double below = (samples.row(i).array() < at[i]).cast<double>().mean();
      result.covered += below >= 0.025 && below <= 0.975;
      double mean = 0;
      for (Eigen::Index s = 0; s < samples.cols(); ++s) mean += ranges[p].value(samples(i, s));
      result.square[p] += std::pow(mean / static_cast<double>(samples.cols()) - truth[p], 2);
    }
    // Jointly: nearer to the middle, by the samples' covariance, than 95 % of them.
    const Eigen::VectorXd middle = samples.rowwise().mean();
    const Eigen::MatrixXd centred = samples.colwise() - middle;
    const Eigen::LLT<Eigen::MatrixXd> root(Eigen::MatrixXd(centred * centred.transpose()));
    const Eigen::VectorXd way = root.matrixL().solve(Eigen::VectorXd(at - middle));
    const Eigen::MatrixXd ways = root.matrixL().solve(centred);
    result.joint += (ways.colwise().squaredNorm().array() < way.squaredNorm()).cast<double>().mean() <= 0.95;

    InversionOptions newton;
    newton.spp = 4096;
    clock = now();
    Inversion inversion(model, targets, newton);
    const Inversion::Conclusion end = invert(inversion, start);
    result.gauss_newton_seconds += since(clock);
    result.converged += end.converged;
    const std::vector<Interval> found = intervals(coordinates, end.x, end.covariance);
    for (std::size_t p = 0; p < 3; ++p) {
      result.gauss_newton_square[p] += std::pow(found[p].value - truth[p], 2);
      if (!end.converged) continue;
      ++result.gauss_newton_intervals;
      result.gauss_newton_covered += found[p].low <= truth[p] && truth[p] <= found[p].high;
      result.converged_square[p] += std::pow(found[p].value - truth[p], 2);
    }
  }
  return result;
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

TEST_CASE("the posterior's intervals hold, beside Gauss-Newton from far starts", "[.coverage_posterior]") {
  const Comparison c = compare(40, 3);
  const auto error = [](const std::array<double, 3>& square, int count) {
    std::string text;
    for (const double s : square) text += " " + std::to_string(std::sqrt(s / std::max(1, count)));
    return text;
  };
  WARN("posterior: " << c.settled << " of " << c.photos << " settled; " << c.covered << " of " << 3 * c.photos
                     << " intervals hold, " << c.joint << " jointly; root mean square errors"
                     << error(c.square, c.photos) << "; " << c.renderings / c.photos << " renderings and "
                     << c.seconds / c.photos << " s a photo");
  WARN("Gauss-Newton: " << c.converged << " converged; " << c.gauss_newton_covered << " of " << c.gauss_newton_intervals
                        << " of their intervals hold; root mean square errors of all"
                        << error(c.gauss_newton_square, c.photos) << ", of those that converged"
                        << error(c.converged_square, c.converged) << "; " << c.gauss_newton_seconds / c.photos
                        << " s a photo");
  CHECK(c.settled >= 0.95 * c.photos);
  CHECK(c.covered >= 0.90 * 3 * c.photos);
  CHECK(c.joint >= 0.87 * c.photos);
}
