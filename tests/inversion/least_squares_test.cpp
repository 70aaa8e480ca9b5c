// The equations of made-up renderings whose answer is known.
#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "itn/error.h"
#include "runtime/inverse/gauss_newton/normal_equations.h"

using namespace itn;

namespace {

constexpr int side = 16, pixels = side * side;
const std::vector<double> truth{0.3, -0.2};

// T = 5 + a(i) x0 + second b(i) x1 with log coordinates of numbers near 1, so that slopes matter; derivatives five
// times as noisy as the image.
struct Made {
  std::mt19937 random{7};
  std::normal_distribution<double> normal;
  double second = 1;

  static double a(int i) { return std::sin(0.05 * i); }
  static double b(int i) { return std::cos(0.11 * i); }

  Rendering render(const std::vector<double>& x, int spp) {
    Rendering r;
    r.width = r.height = side;
    r.channels = 1;
    r.spp = spp;
    r.derivatives.resize(2);
    const double noise = 0.4 / std::sqrt(spp);
    for (int i = 0; i < pixels; ++i) {
      const double p[2] = {std::exp(x[0]), std::exp(x[1])};
      r.mean.push_back(static_cast<float>(5 + a(i) * x[0] + second * b(i) * x[1] + noise * normal(random)));
      r.stderr_.push_back(static_cast<float>(noise));
      for (std::size_t k = 0; k < 2; ++k) {
        r.derivatives[k].mean.push_back(
            static_cast<float>(((k == 0 ? a(i) : second * b(i)) + 5 * noise * normal(random)) / p[k]));
        r.derivatives[k].stderr_.push_back(static_cast<float>(5 * noise / p[k]));
      }
    }
    return r;
  }

  TargetImage target(double noise, const std::vector<double>& x = truth) {
    TargetImage t{side, side, 1, {}, std::vector<float>(pixels, 1.0F), std::vector<float>(pixels, float(noise))};
    for (int i = 0; i < pixels; ++i)
      t.value.push_back(static_cast<float>(5 + a(i) * x[0] + second * b(i) * x[1] + noise * normal(random)));
    return t;
  }
};

std::vector<Coordinate> coordinates() {
  std::vector<Coordinate> result;
  for (const char* name : {"first", "second"}) {
    Parameter p;
    p.name = name;
    p.high = INFINITY;
    result.emplace_back(p);
  }
  return result;
}

}  // namespace

TEST_CASE("solutions of pooled equations are unbiased and as far off as their covariance says", "[stat]") {
  Made made;
  const std::vector<double> from{0.303, -0.197};
  const int repeats = 400;
  double mean[2] = {0, 0}, square[2] = {0, 0}, share = 0;
  for (int k = 0; k < repeats; ++k) {
    const std::vector<TargetImage> targets{made.target(0.05)};
    const std::vector<Reference> references{reference_of(made.render(from, 64), targets[0], 0, 0, coordinates(), from)};
    NormalEquations pool(2);
    for (int m = 0; m < 4; ++m)
      pool.add(least_squares({made.render(from, 64)}, targets, references, coordinates(), from), from);
    const NormalEquations::Solution solution = pool.solve(from, {"first", "second"});
    CHECK(solution.determined);
    share += solution.monte_carlo_share / repeats;
    for (Eigen::Index i = 0; i < 2; ++i) {
      const double z = (solution.x[i] - truth[static_cast<std::size_t>(i)]) / std::sqrt(solution.covariance(i, i));
      mean[i] += z / repeats;
      square[i] += z * z / repeats;
    }
  }
  for (int i = 0; i < 2; ++i) {
    CAPTURE(i, mean[i], square[i]);
    CHECK(std::fabs(mean[i]) < 3.3 / std::sqrt(repeats));
    CHECK(std::fabs(square[i] - 1) < 3.5 * std::sqrt(2.0 / repeats));
  }
  // four renderings of variance 0.4^2 / 64 beside a target of 0.05^2
  CHECK(share == Approx(0.2).margin(0.03));
}

TEST_CASE("the information of repeated renderings varies as its noise says", "[stat]") {
  Made made;
  const std::vector<TargetImage> targets{made.target(0.05)};
  const std::vector<Reference> references{reference_of(made.render(truth, 64), targets[0], 0, 0, coordinates(), truth)};
  const Eigen::Vector2d u(0.6, -0.3), v(0.2, 0.9);
  const int repeats = 400;
  double sum = 0, square = 0, said = 0;
  for (int k = 0; k < repeats; ++k) {
    const LeastSquares e = least_squares({made.render(truth, 64)}, targets, references, coordinates(), truth);
    const double told = u.dot(e.information * v);
    sum += told / repeats;
    square += told * told / repeats;
    for (Eigen::Index i = 0; i < 2; ++i)
      said += v[i] * v[i] * u.dot(e.information_noise[static_cast<std::size_t>(i)] * u) / repeats;
  }
  CHECK((square - sum * sum) / said == Approx(1).margin(3.5 * std::sqrt(2.0 / repeats)));
}

// A reflectance and a transmittance, say: nothing is left of them, and all pixels of a set are one.
TEST_CASE("as many values as unknowns tell them, with the noise that the values are said to have", "[stat]") {
  Made made;
  const std::vector<double> from{0.31, -0.19};
  const int repeats = 400;
  double square[2] = {0, 0};
  for (int k = 0; k < repeats; ++k) {
    std::vector<TargetImage> targets{made.target(0.01)};
    targets[0].weight.assign(pixels, 0.0F);
    targets[0].weight[30] = targets[0].weight[200] = 1;
    const std::vector<Reference> references{
        reference_of(made.render(from, 4096), targets[0], 0, 0, coordinates(), from)};
    NormalEquations pool(2);
    for (int m = 0; m < 2; ++m)
      pool.add(least_squares({made.render(from, 4096)}, targets, references, coordinates(), from), from);
    const NormalEquations::Solution solution = pool.solve(from, {"first", "second"});
    CHECK(solution.determined);
    CHECK_FALSE(solution.hidden);
    for (Eigen::Index i = 0; i < 2; ++i)
      square[i] +=
          std::pow(solution.x[i] - truth[static_cast<std::size_t>(i)], 2) / solution.covariance(i, i) / repeats;
  }
  for (const double s : square) CHECK(s == Approx(1).margin(3.5 * std::sqrt(2.0 / repeats)));
}

TEST_CASE("with a prior that truths are drawn from, solutions are the posterior's means and as far off as it says",
          "[stat]") {
  Made made;
  const double deviation = 0.005;  // about what the image tells
  const Prior prior{truth, Eigen::Matrix2d(Eigen::Matrix2d::Identity() / (deviation * deviation))};
  const int repeats = 400;
  double mean[2] = {0, 0}, square[2] = {0, 0}, error = 0, without = 0;
  for (int k = 0; k < repeats; ++k) {
    const std::vector<double> x{truth[0] + deviation * made.normal(made.random),
                                truth[1] + deviation * made.normal(made.random)};
    const std::vector<TargetImage> targets{made.target(0.05, x)};
    const std::vector<Reference> references{
        reference_of(made.render(truth, 64), targets[0], 0, 0, coordinates(), truth)};
    NormalEquations pool(2);
    for (int m = 0; m < 4; ++m)
      pool.add(least_squares({made.render(truth, 64)}, targets, references, coordinates(), truth), truth);
    const NormalEquations::Solution solution = pool.solve(truth, {"first", "second"}, prior),
                                    image_alone = pool.solve(truth, {"first", "second"});
    CHECK(solution.determined);
    for (Eigen::Index i = 0; i < 2; ++i) {
      const double off = solution.x[i] - x[static_cast<std::size_t>(i)], z = off / std::sqrt(solution.covariance(i, i));
      mean[i] += z / repeats;
      square[i] += z * z / repeats;
      error += off * off;
      without += std::pow(image_alone.x[i] - x[static_cast<std::size_t>(i)], 2);
    }
  }
  for (int i = 0; i < 2; ++i) {
    CAPTURE(i, mean[i], square[i]);
    CHECK(std::fabs(mean[i]) < 3.3 / std::sqrt(repeats));
    CHECK(std::fabs(square[i] - 1) < 3.5 * std::sqrt(2.0 / repeats));
  }
  CHECK(error < 0.7 * without);
}

TEST_CASE("what noise hides a prior tells") {
  Made made;
  made.second = 1e-4;
  const std::vector<TargetImage> targets{made.target(0.05)};
  const std::vector<Reference> references{reference_of(made.render(truth, 64), targets[0], 0, 0, coordinates(), truth)};
  NormalEquations pool(2);
  pool.add(least_squares({made.render(truth, 64)}, targets, references, coordinates(), truth), truth);
  CHECK_FALSE(pool.solve(truth, {"first", "second"}).determined);
  const Prior prior{{0, -0.25}, Eigen::Vector2d(0, 1 / 1e-4).asDiagonal().toDenseMatrix()};
  const NormalEquations::Solution solution = pool.solve(truth, {"first", "second"}, prior);
  CHECK((solution.hidden && solution.determined));
  CHECK(solution.x[0] == Approx(truth[0]).margin(0.05));
  CHECK(solution.x[1] == Approx(-0.25).margin(0.003));
  CHECK(std::sqrt(solution.covariance(1, 1)) == Approx(0.01).epsilon(0.1));
}

TEST_CASE("loss and cost leave out what the rendering's noise adds", "[stat]") {
  Made made;
  const std::vector<TargetImage> targets{made.target(0.05)};
  const std::vector<Reference> references{reference_of(made.render(truth, 64), targets[0], 0, 0, coordinates(), truth)};
  double loss = 0, cost = 0;
  for (int k = 0; k < 200; ++k) {
    const LeastSquares e = least_squares({made.render(truth, 4)}, targets, references, coordinates(), truth);
    loss += e.loss / 200;
    cost += e.cost / 200;
  }
  double noise = 0;
  for (int i = 0; i < pixels; ++i)
    noise +=
        std::pow(targets[0].value[static_cast<std::size_t>(i)] - 5 - Made::a(i) * truth[0] - Made::b(i) * truth[1], 2) /
        pixels;
  CHECK(loss == Approx(noise).margin(4 * 0.04 * std::sqrt(2.0 / pixels / 200) + 0.0003));
  CHECK(cost == Approx(1).margin(0.05));
}

TEST_CASE("an unknown that no pixel depends on is named") {
  Made made;
  const std::vector<TargetImage> targets{made.target(0.05)};
  Rendering still = made.render(truth, 16);
  std::fill(still.derivatives[1].mean.begin(), still.derivatives[1].mean.end(), 0.0F);
  const std::vector<Reference> references{reference_of(still, targets[0], 0, 0, coordinates(), truth)};
  NormalEquations pool(2);
  pool.add(least_squares({still}, targets, references, coordinates(), truth), truth);
  CHECK_THROWS_AS(pool.solve(truth, {"first", "second"}), ResultError);
  CHECK_THROWS_WITH(pool.solve(truth, {"first", "second"}),
                    Catch::StartsWith("second: no compared pixel depends on it"));
}

TEST_CASE("stored equations are the same equations") {
  Made made;
  const std::vector<TargetImage> targets{made.target(0.05)};
  const std::vector<Reference> references{reference_of(made.render(truth, 64), targets[0], 0, 0, coordinates(), truth)};
  NormalEquations pool(2);
  pool.add(least_squares({made.render(truth, 64)}, targets, references, coordinates(), truth), truth);
  const NormalEquations again = NormalEquations::from_numbers(2, pool.numbers());
  CHECK(again.solve(truth, {"", ""}).x == pool.solve(truth, {"", ""}).x);
  CHECK(again.solve(truth, {"", ""}).covariance == pool.solve(truth, {"", ""}).covariance);
}

TEST_CASE("a prior with a correlation counts with it beside the image, as precisions add up") {
  Made made;
  const std::vector<TargetImage> targets{made.target(0.05)};
  const std::vector<Reference> references{reference_of(made.render(truth, 64), targets[0], 0, 0, coordinates(), truth)};
  NormalEquations pool(2);
  pool.add(least_squares({made.render(truth, 64)}, targets, references, coordinates(), truth), truth);
  const NormalEquations::Solution alone = pool.solve(truth, {"first", "second"});
  Eigen::Matrix2d known;
  known << 4, 3.6, 3.6, 4;
  known *= 0.5 / alone.covariance.trace();
  const Prior prior{{truth[0] + 0.01, truth[1]}, known};
  const NormalEquations::Solution both = pool.solve(truth, {"first", "second"}, prior);
  CHECK_FALSE(both.hidden);
  // In units of the image's noise.
  const Eigen::Matrix2d added = both.information - alone.information;
  CHECK((added - known * (added.trace() / known.trace())).norm() < 1e-9 * added.norm());
  const Eigen::Vector2d mean =
      alone.x + both.information.inverse() * (added * (Eigen::Vector2d(prior.mean[0], prior.mean[1]) - alone.x));
  CHECK((both.x - mean).norm() < 1e-9);
  for (Eigen::Index k = 0; k < 2; ++k) CHECK(both.covariance(k, k) < alone.covariance(k, k));
}
