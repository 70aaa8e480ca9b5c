// What a network's answer means in a scene, where the scene is a formula.
#include "network/prediction/answer_emulator.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "runtime/base/error.h"
#include "runtime/inverse/posterior/low_discrepancy.h"

using namespace itn;

namespace {

Eigen::MatrixXd cube(const Eigen::MatrixXd& shares) { return 2 * shares.array() - 1; }

// Two outputs for two numbers: bent, of different scales, with noise that they share.
struct MadeUpNetwork {
  std::mt19937_64 random{7};
  double noise = 0.2;

  Eigen::VectorXd answer(const Eigen::VectorXd& shares) {
    std::normal_distribution<double> normal;
    const double shared = noise * normal(random);
    Eigen::VectorXd result(2);
    result << 30 * (shares[0] + 0.5 * shares[1] * shares[1] + shared),
        -4 + 2 * shares[1] - shares[0] + shared + 0.5 * noise * normal(random);
    return result;
  }

  // Its derivatives by a share, with noise of their own.
  Eigen::VectorXd derivative(const Eigen::VectorXd& shares, int by) {
    std::normal_distribution<double> normal(0, noise);
    Eigen::VectorXd result(2);
    result << 30 * ((by == 0 ? 1 : shares[1]) + normal(random)), (by == 0 ? -1 : 2) + normal(random);
    return result;
  }

  // Of some exemplars.
  AnswerEmulator shown(int exemplars) {
    Eigen::MatrixXd shares(2, exemplars), answers(3 * exemplars, 2);
    for (int k = 0; k < exemplars; ++k) {
      shares.col(k) = (low_discrepancy_point(2, k).array() + 1) / 2;
      answers.row(3 * k) = answer(shares.col(k));
      for (int by = 0; by < 2; ++by) answers.row(3 * k + 1 + by) = derivative(shares.col(k), by) / 2;
    }
    return {cube(shares), answers};
  }
};

struct Moments {
  Eigen::VectorXd mean, deviation;
};

Moments moments(const Eigen::MatrixXd& points, const Eigen::VectorXd& weight) {
  const Eigen::VectorXd mean = points * weight / weight.sum();
  const Eigen::MatrixXd off = points.colwise() - mean;
  return {mean, (off.cwiseAbs2() * weight / weight.sum()).cwiseSqrt()};
}

Moments moments(const Eigen::MatrixXd& samples) { return moments(samples, Eigen::VectorXd::Ones(samples.cols())); }

// The middles of side x side squares.
struct Grid {
  Eigen::MatrixXd points;

  explicit Grid(int side) : points(2, side * side) {
    for (int k = 0; k < side * side; ++k) points.col(k) << (k % side + 0.5) / side, (k / side + 0.5) / side;
  }
  // Of the posterior; its sum is 1.
  Eigen::VectorXd density(const AnswerEmulator& emulator, const Eigen::VectorXd& answer) const {
    Eigen::VectorXd result(points.cols());
    for (Eigen::Index k = 0; k < result.size(); ++k)
      result[k] = std::exp(emulator.log_likelihood(answer, cube(points.col(k))));
    return result / result.sum();
  }
};

}  // namespace

TEST_CASE("a network that is shown a scene says intervals of 95 % that hold the truth so often") {
  MadeUpNetwork network;
  std::uniform_real_distribution<double> uniform;
  const Grid grid(30);
  int held = 0, asked = 0;
  for (int scene = 0; scene < 60; ++scene) {
    const AnswerEmulator emulator = network.shown(24);
    for (int photo = 0; photo < 5; ++photo) {
      const Eigen::Vector2d truth(uniform(network.random), uniform(network.random));
      const Eigen::VectorXd density = grid.density(emulator, network.answer(truth));
      for (Eigen::Index i = 0; i < 2; ++i, ++asked) {
        const double below = (grid.points.row(i).array() < truth[i]).select(density.transpose().array(), 0).sum();
        held += below > 0.025 && below < 0.975;
      }
    }
  }
  // Photos of a scene share its emulator, so the 600 are worth fewer: the spread of 60 scenes' shares is some .02.
  CHECK(std::fabs(static_cast<double>(held) / asked - 0.95) < 0.03);
}

TEST_CASE("samples of a network's posterior have the moments of its density by quadrature") {
  MadeUpNetwork network;
  const AnswerEmulator emulator = network.shown(24);
  const Eigen::VectorXd answer = network.answer(Eigen::Vector2d(0.3, 0.7));
  constexpr int count = 4000;
  const Grid grid(80);
  const Moments expected = moments(grid.points, grid.density(emulator, answer)),
                found = moments((emulator.posterior(answer, count, 1).array() + 1) / 2);
  for (Eigen::Index i = 0; i < 2; ++i) {
    const double chance = expected.deviation[i] / std::sqrt(count / 4.0);  // neighbours in a chain are alike
    CHECK(std::fabs(found.mean[i] - expected.mean[i]) < 4 * chance);
    CHECK(std::fabs(found.deviation[i] - expected.deviation[i]) < 4 * chance);
  }
}

TEST_CASE("a network's posterior does not depend on the unit of its outputs") {
  MadeUpNetwork network;
  Eigen::MatrixXd shares(2, 20), answers(60, 2), other(60, 2);
  for (int k = 0; k < 20; ++k) {
    shares.col(k) = (low_discrepancy_point(2, k).array() + 1) / 2;
    answers.row(3 * k) = network.answer(shares.col(k));
    other.row(3 * k) = -1000 * answers.row(3 * k).array() + 7;
    for (int by = 0; by < 2; ++by) {
      answers.row(3 * k + 1 + by) = network.derivative(shares.col(k), by) / 2;
      other.row(3 * k + 1 + by) = -1000 * answers.row(3 * k + 1 + by);
    }
  }
  const Eigen::VectorXd answer = network.answer(Eigen::Vector2d(0.4, 0.2));
  const AnswerEmulator one(cube(shares), answers), two(cube(shares), other);
  for (const double x : {0.1, 0.5, 0.9})
    CHECK(one.log_likelihood(answer, cube(Eigen::Vector2d(x, 1 - x))) ==
          Approx(two.log_likelihood(-1000 * answer.array() + 7, cube(Eigen::Vector2d(x, 1 - x)))).epsilon(1e-6));
}

TEST_CASE("outputs that tell nothing of the material leave every share as likely as before") {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd shares(2, 64), answers = Eigen::MatrixXd::Zero(3 * 64, 2);
  for (int k = 0; k < 64; ++k) {
    shares.col(k) = (low_discrepancy_point(2, k).array() + 1) / 2;
    answers.row(3 * k) << normal(random), 1;  // noise, and what never changes
    for (int by = 0; by < 2; ++by) answers(3 * k + 1 + by, 0) = normal(random);
  }
  const AnswerEmulator emulator(cube(shares), answers);
  const Moments found = moments((emulator.posterior(Eigen::Vector2d(0.1, 1), 4000, 1).array() + 1) / 2);
  for (Eigen::Index i = 0; i < 2; ++i) {
    CHECK(std::fabs(found.mean[i] - 0.5) < 0.05);
    CHECK(std::fabs(found.deviation[i] - 1 / std::sqrt(12.0)) < 0.03);
  }
}

TEST_CASE("fewer exemplars than can tell anything are refused, and more than can be waited for") {
  const auto of = [](int count) {
    return AnswerEmulator(Eigen::MatrixXd::Zero(3, count),
                          Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(4) * count, 3));
  };
  CHECK_THROWS_AS(of(least_exemplars - 1), UsageError);
  CHECK_THROWS_AS(require_exemplars(most_exemplars + 1), UsageError);
  CHECK_NOTHROW(require_exemplars(most_exemplars));
}
