// The posterior through an emulator, on scenes whose images are formulas.
#include "runtime/inverse/posterior/posterior.h"

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

// Ranks of the truth among the samples of many posteriors: simulation-based calibration (Talts et al. 2018).
struct RankCounts {
  static constexpr int bins = 5;
  int photos = 0, settled = 0, joint = 0;
  std::array<std::array<double, bins>, 2> counts{};
  std::array<int, 2> inside{};
  double square = 0;  // sum of (mean - truth)^2 / variance

  void add(const Posterior& posterior, const Eigen::VectorXd& truth) {
    const Eigen::MatrixXd& samples = posterior.samples().at;
    const Eigen::VectorXd off = truth - samples.rowwise().mean();
    const Eigen::MatrixXd centred = samples.colwise() - Eigen::VectorXd(samples.rowwise().mean());
    const Eigen::MatrixXd covariance = centred * centred.transpose() / static_cast<double>(samples.cols());
    for (Eigen::Index p = 0; p < 2; ++p) {
      const auto i = static_cast<std::size_t>(p);
      const double below = (samples.row(p).array() < truth[p]).cast<double>().mean();
      counts[i][std::min<std::size_t>(bins - 1, static_cast<std::size_t>(below * bins))] += 1;
      inside[i] += below > 0.025 && below < 0.975;
      square += off[p] * off[p] / covariance(p, p);
    }
    joint += off.dot(covariance.inverse() * off) < 5.99;
    settled += posterior.rounds().back().settled;
    ++photos;
  }
  double chi_square(std::size_t p) const {
    double sum = 0;
    for (const double c : counts[p]) sum += std::pow(c - photos / double(bins), 2) / (photos / double(bins));
    return sum;
  }
};

RankCounts measure(int photos, unsigned seed) {
  RankCounts ranks;
  for (int k = 0; k < photos; ++k) {
    MadeUpScene scene{spot};
    scene.random.seed(1000 * seed + static_cast<unsigned>(k));
    std::uniform_real_distribution<double> uniform(-1, 1);
    const Eigen::VectorXd truth = Eigen::VectorXd::NullaryExpr(2, [&] { return uniform(scene.random); });
    const std::vector<TargetImage> targets{scene.photo(truth, 64)};
    PosteriorOptions how;
    how.samples = 1000;
    how.seed = static_cast<std::uint64_t>(k);
    Posterior posterior(2, targets, even, how);
    scene.run(posterior);
    ranks.add(posterior, truth);
  }
  return ranks;
}

}  // namespace

TEST_CASE("ranks of the truth among the samples of 300 posteriors are even", "[.calibration]") {
  const RankCounts r = measure(300, 1);
  WARN("intervals of 95 % hold " << r.inside[0] << " and " << r.inside[1] << ", jointly " << r.joint << " of "
                                 << r.photos << "; settled " << r.settled << "; mean square of error over deviation "
                                 << r.square / (2 * r.photos) << "; chi-square of ranks, 4 degrees of freedom: "
                                 << r.chi_square(0) << ", " << r.chi_square(1));
  CHECK(r.settled >= 0.95 * r.photos);
  for (const std::size_t p : {0U, 1U}) {
    CHECK(r.chi_square(p) < 16.9);  // 0.2 %
    CHECK(r.inside[p] >= 0.92 * r.photos);
  }
}

namespace {

// The posterior on a grid, from the formula itself.
struct GridPosterior {
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(2);
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(2, 2);
  double first_negative = 0;  // probability that the first number is below 0

  GridPosterior(const MadeUpScene& scene, const TargetImage& photo) {
    constexpr int cells = 160;
    Eigen::ArrayXXd log_density(cells, cells);
    const auto at = [](int i) { return (2 * i + 1.0) / cells - 1; };
    for (int i = 0; i < cells; ++i)
      for (int j = 0; j < cells; ++j) {
        double sum = 0;
        for (std::size_t k = 0; k < photo.value.size(); ++k)
          if (photo.error[k] > 0)
            sum -= 0.5 * std::pow((double(photo.value[k]) - scene.at_pixel(int(k), Eigen::Vector2d(at(i), at(j)))) /
                                      double(photo.error[k]),
                                  2);
        log_density(i, j) = sum;
      }
    const Eigen::ArrayXXd density = (log_density - log_density.maxCoeff()).exp();
    const double all = density.sum();
    Eigen::MatrixXd square = covariance;
    for (int i = 0; i < cells; ++i)
      for (int j = 0; j < cells; ++j) {
        const Eigen::VectorXd t = Eigen::Vector2d(at(i), at(j));
        mean += density(i, j) / all * t;
        square += density(i, j) / all * (t * t.transpose());
        if (at(i) < 0) first_negative += density(i, j) / all;
      }
    covariance = square - mean * mean.transpose();
  }
};

Eigen::MatrixXd covariance_of(const Eigen::MatrixXd& samples) {
  const Eigen::MatrixXd centred = samples.colwise() - Eigen::VectorXd(samples.rowwise().mean());
  return centred * centred.transpose() / static_cast<double>(samples.cols());
}

}  // namespace

TEST_CASE("a bent posterior is that of a grid of the formula") {
  // Images know t0^2 + t1 well and t0 badly: a crescent.
  MadeUpScene scene{[](double x, double y, const Eigen::VectorXd& t) {
    return 1 + 0.25 * (t[1] + 1.2 * t[0] * t[0]) * std::cos(2 * x) + 0.012 * t[0] * std::sin(3 * y);
  }};
  const TargetImage photo = scene.photo(Eigen::Vector2d(0.1, -0.3), 64);
  const GridPosterior grid(scene, photo);
  const std::vector<TargetImage> targets{photo};
  Posterior posterior(2, targets, even, PosteriorOptions());
  scene.run(posterior);
  const Eigen::MatrixXd& samples = posterior.samples().at;
  const Eigen::VectorXd mean = samples.rowwise().mean();
  const Eigen::MatrixXd covariance = covariance_of(samples);
  CAPTURE(mean, grid.mean, covariance, grid.covariance);
  for (Eigen::Index p = 0; p < 2; ++p) {
    const double deviation = std::sqrt(grid.covariance(p, p));
    CHECK(std::fabs(mean[p] - grid.mean[p]) < 0.35 * deviation);
    CHECK(std::sqrt(covariance(p, p)) == Approx(deviation).epsilon(0.25));
  }
  // the bend: the second number goes down with the square of the first
  const Eigen::ArrayXd a = samples.row(0).transpose(), b = samples.row(1).transpose(), s = a.square();
  const double bend = ((s - s.mean()) * (b - b.mean())).mean() /
                      std::sqrt((s - s.mean()).square().mean() * (b - b.mean()).square().mean());
  CHECK(bend < -0.8);
}

TEST_CASE("surroundings without noise make no interval narrower") {
  // Nothing is seen but in a disc, a fifth of the picture. What is left of the rest is 0, and was taken for small
  // noise.
  MadeUpScene scene{
      [](double x, double y, const Eigen::VectorXd& t) { return x * x + y * y < 0.25 ? spot(x, y, t) : 0; }};
  scene.pixels = 32;
  const TargetImage photo = scene.photo(Eigen::Vector2d(0.1, -0.3), 64);
  const GridPosterior grid(scene, photo);
  const std::vector<TargetImage> targets{photo};
  Posterior posterior(2, targets, even, PosteriorOptions());
  scene.run(posterior);
  CHECK(posterior.rounds().back().residual == Approx(1).margin(0.25));  // 4.5 standard errors of 208 squares over 2
  const Eigen::MatrixXd covariance = covariance_of(posterior.samples().at);
  CAPTURE(covariance, grid.covariance);
  for (Eigen::Index p = 0; p < 2; ++p)
    CHECK(std::sqrt(covariance(p, p)) == Approx(std::sqrt(grid.covariance(p, p))).epsilon(0.25));
}

TEST_CASE("two peaks are found, said, and as probable as on a grid of the formula") {
  MadeUpScene scene{[](double x, double y, const Eigen::VectorXd& t) {
    return 1 + 0.5 * t[0] * t[0] * std::cos(2 * x) + 0.3 * t[1] * std::sin(2 * y);
  }};
  const TargetImage photo = scene.photo(Eigen::Vector2d(0.6, 0.2), 64);
  const GridPosterior grid(scene, photo);
  const std::vector<TargetImage> targets{photo};
  Posterior posterior(2, targets, even, PosteriorOptions());
  scene.run(posterior);
  REQUIRE(posterior.peaks().size() == 2);
  const double negative = (posterior.samples().at.row(0).array() < 0).cast<double>().mean();
  CAPTURE(grid.first_negative, negative);
  CHECK(std::fabs(negative - grid.first_negative) < 0.12);
  CHECK(posterior.peaks()[0].top[0] * posterior.peaks()[1].top[0] < 0);
  CHECK(posterior.peaks()[0].share + posterior.peaks()[1].share == Approx(1).margin(0.02));
}

TEST_CASE("a pattern far below the noise of a pixel tells which of two peaks is the likelier") {
  MadeUpScene scene{[](double x, double y, const Eigen::VectorXd& t) {
    return 1 + 0.5 * t[0] * t[0] * std::cos(2 * x) + 0.3 * t[1] * std::sin(2 * y) + 0.011 * t[0] * std::sin(3 * x);
  }};
  const TargetImage photo = scene.photo(Eigen::Vector2d(0.6, 0.2), 64);
  const GridPosterior grid(scene, photo);
  REQUIRE(grid.first_negative < 0.15);
  const std::vector<TargetImage> targets{photo};
  Posterior posterior(2, targets, even, PosteriorOptions());
  scene.run(posterior);
  const double negative = (posterior.samples().at.row(0).array() < 0).cast<double>().mean();
  CAPTURE(grid.first_negative, negative);
  CHECK(std::fabs(negative - grid.first_negative) < 0.12);
}

TEST_CASE("of photos of four pixels each pixel counts: posteriors are those of grids of the formula") {
  MadeUpScene scene{[](double x, double y, const Eigen::VectorXd& t) {
    return 1 + 0.25 * t[0] * x + 0.2 * t[1] * y + 0.15 * (t[0] - 0.5) * (t[1] + t[0]);
  }};
  scene.pixels = 2;
  constexpr int photos = 8;
  double log_ratio = 0, distance = 0;
  for (int k = 0; k < photos; ++k) {
    scene.random.seed(static_cast<unsigned>(k));
    std::uniform_real_distribution<double> uniform(-0.9, 0.9);
    const double first = uniform(scene.random), second = uniform(scene.random);
    const TargetImage photo = scene.photo(Eigen::Vector2d(first, second), 64);
    const GridPosterior grid(scene, photo);
    const std::vector<TargetImage> targets{photo};
    Posterior posterior(2, targets, even, PosteriorOptions());
    scene.run(posterior);
    const Eigen::VectorXd mean = posterior.samples().at.rowwise().mean();
    const Eigen::MatrixXd covariance = covariance_of(posterior.samples().at);
    UNSCOPED_INFO(k << ": " << mean.transpose() << " (" << grid.mean.transpose() << "), "
                    << covariance.diagonal().cwiseSqrt().transpose() << " ("
                    << grid.covariance.diagonal().cwiseSqrt().transpose() << ")");
    log_ratio += 0.5 * std::log(covariance.determinant() / grid.covariance.determinant()) / photos;
    distance += std::sqrt((mean - grid.mean).dot(grid.covariance.inverse() * (mean - grid.mean))) / photos;
  }
  CHECK(std::fabs(log_ratio) < 0.15);
  CHECK(distance < 0.35);
}

TEST_CASE("of photos that do not say their noise, small or great, posteriors are those of grids that know it") {
  for (const int spp : {4, 32, 256}) {
    MadeUpScene scene{spot};
    const TargetImage photo = scene.photo(Eigen::Vector2d(0.2, -0.4), spp);
    const GridPosterior grid(scene, photo);
    std::vector<TargetImage> targets{photo};
    targets[0].error.clear();
    PosteriorOptions how;
    how.noise = settle_noise(targets, {});
    REQUIRE_FALSE(how.noise.known);
    Posterior posterior(2, targets, even, how);
    scene.run(posterior);
    const Eigen::VectorXd mean = posterior.samples().at.rowwise().mean();
    const Eigen::MatrixXd covariance = covariance_of(posterior.samples().at);
    CAPTURE(spp, how.noise.measured, mean, grid.mean, covariance, grid.covariance);
    for (Eigen::Index p = 0; p < 2; ++p) {
      const double deviation = std::sqrt(grid.covariance(p, p));
      CHECK(std::fabs(mean[p] - grid.mean[p]) < deviation);
      CHECK(std::sqrt(covariance(p, p)) == Approx(deviation).epsilon(0.3));
    }
  }
}

TEST_CASE("renderings of few pixels have many samples, but no more than a million in all") {
  MadeUpScene scene{spot};
  const auto first_spp = [&](int pixels, int compared) {
    scene.pixels = pixels;
    std::vector<TargetImage> targets{scene.photo(Eigen::Vector2d(0, 0), 64)};
    for (std::size_t i = static_cast<std::size_t>(compared); i < targets[0].weight.size(); ++i)
      targets[0].weight[i] = 0;
    return Posterior(2, targets, even, PosteriorOptions()).wanted().front().spp;
  };
  CHECK(first_spp(2, 4) == 1024);
  CHECK(first_spp(8, 1) == 4096);
  CHECK(first_spp(32, 1) == 1024);
  CHECK(first_spp(64, 64 * 64) == 32);
}

TEST_CASE("what images do not tell stays as wide as it was before") {
  MadeUpScene scene{[](double x, double, const Eigen::VectorXd& t) { return 1 + 0.3 * t[0] * std::cos(2 * x); }};
  const std::vector<TargetImage> targets{scene.photo(Eigen::Vector2d(0.4, 0.8), 64)};
  Posterior posterior(2, targets, even, PosteriorOptions());
  scene.run(posterior);
  CHECK(posterior.rounds().back().settled);
  const Eigen::MatrixXd& samples = posterior.samples().at;
  CHECK(std::sqrt(covariance_of(samples)(1, 1)) == Approx(1 / std::sqrt(3.0)).epsilon(0.12));
  CHECK(std::fabs(samples.row(0).mean() - 0.4) < 4 * std::sqrt(covariance_of(samples)(0, 0)));
}

TEST_CASE("an unknown exposure is found along with the posterior") {
  MadeUpScene scene{[](double x, double y, const Eigen::VectorXd& t) {
    return 1 + 0.5 * t[0] * std::cos(2 * x) + 0.3 * t[1] * std::sin(2 * y);
  }};
  const std::vector<TargetImage> targets{scene.photo(Eigen::Vector2d(0.3, -0.4), 64, 2.5)};
  PosteriorOptions how;
  how.exposure = true;
  Posterior posterior(2, targets, even, how);
  scene.run(posterior);
  const Eigen::VectorXd mean = posterior.samples().at.rowwise().mean();
  const Eigen::MatrixXd covariance = covariance_of(posterior.samples().at);
  CAPTURE(mean, covariance);
  CHECK(std::fabs(mean[0] - 0.3) < 4 * std::sqrt(covariance(0, 0)));
  CHECK(std::fabs(mean[1] + 0.4) < 4 * std::sqrt(covariance(1, 1)));
  CHECK(std::sqrt(covariance(0, 0)) < 0.05);
  const EmulatedView::Exposure e = posterior.exposure(0, mean);
  CHECK(std::fabs(e.mean - 2.5) < 0.05);
  CHECK(e.deviation < 0.05);
}
