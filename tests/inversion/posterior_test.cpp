// The posterior through an emulator, on scenes whose images are formulas.
#include "runtime/inversion/posterior/posterior.h"

#include <Eigen/LU>
#include <catch2/catch.hpp>

#include "tests/inversion/made_up_scene.h"

using namespace itn;
using namespace itn::test;

namespace {

// Two materials make a picture: a bright spot whose width and height they change, not each alone.
double spot(double x, double y, const Eigen::VectorXd& t) {
  const double width = 0.5 + 0.2 * t[0] + 0.05 * t[1];
  return 0.2 + (1 + 0.3 * t[1] + 0.1 * t[0] * t[0]) * std::exp(-(x * x + y * y) / (2 * width * width));
}

}  // namespace

TEST_CASE("ranks of the truth among the posterior's samples are even", "[.calibration]") {
  constexpr int photos = 40, bins = 5;
  std::array<std::array<double, bins>, 2> counts{};
  std::array<double, 2> inside{};
  int settled = 0;
  double joint = 0;
  for (int k = 0; k < photos; ++k) {
    MadeUpScene scene{spot};
    scene.random.seed(static_cast<unsigned>(100 + k));
    std::uniform_real_distribution<double> uniform(-1, 1);
    const Eigen::VectorXd truth = Eigen::VectorXd::NullaryExpr(2, [&] { return uniform(scene.random); });
    const std::vector<TargetImage> targets{scene.photo(truth, 64)};
    PosteriorOptions how;
    how.samples = 400;
    how.seed = static_cast<std::uint64_t>(k);
    Posterior posterior(2, targets, even, how);
    scene.run(posterior);
    settled += posterior.rounds().back().settled;
    const Eigen::MatrixXd& samples = posterior.samples().at;
    for (Eigen::Index p = 0; p < 2; ++p) {
      const double below = (samples.row(p).array() < truth[p]).cast<double>().mean();
      counts[static_cast<std::size_t>(p)][std::min<std::size_t>(bins - 1, static_cast<std::size_t>(below * bins))] += 1;
      inside[static_cast<std::size_t>(p)] += below > 0.025 && below < 0.975;
    }
    const Eigen::VectorXd mean = samples.rowwise().mean();
    const Eigen::MatrixXd centred = samples.colwise() - mean;
    const Eigen::MatrixXd covariance = centred * centred.transpose() / 400;
    joint += (truth - mean).dot(covariance.inverse() * (truth - mean)) < 5.99;
    if (k < 10) { for (const PosteriorRound& q : posterior.rounds()) std::printf("   shift %.2f growth %.2f share %.2f sd %.3f %.3f local %d\n", q.shift, q.growth, q.emulator_share, q.deviation[0], q.deviation[1], q.local);
      const PosteriorRound& r = posterior.rounds().back();
      std::printf("%d rounds %zu exemplars %d local %d share %.2f loo %.2f residual %.2f sd %.4f %.4f z %.2f %.2f\n", k,
                  posterior.rounds().size(), r.exemplars, r.local, r.emulator_share, r.leave_one_out, r.residual,
                  r.deviation[0], r.deviation[1], (truth[0] - r.mean[0]) / r.deviation[0],
                  (truth[1] - r.mean[1]) / r.deviation[1]);
      std::fflush(stdout);
    }
  }
  for (const auto& of : counts) {
    double chi = 0;
    for (const double c : of) chi += std::pow(c - photos / double(bins), 2) / (photos / double(bins));
    std::printf("ranks %g %g %g %g %g chi2 %g\n", of[0], of[1], of[2], of[3], of[4], chi);
  }
  std::printf("inside %g %g joint %g settled %d of %d\n", inside[0], inside[1], joint, settled, photos);
}
