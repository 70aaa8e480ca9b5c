// Networks that say how sure they are.
#include "itn/distribution.h"

#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "itn/error.h"
#include "layer_support.h"
#include "network/training/prediction.h"
#include "runtime/base/statistics.h"

namespace {

using namespace itn;
using reference::Numbers;

const Numbers some_raw{0.3, -1.1, 2.0, -0.4, 0.2, -1.0, 0.7, -1.5, 0.4};

NetworkDescription description(const std::vector<double>& spread = {1, 1, 1}) {
  NetworkDescription result;
  result.size = 4;
  result.width = 1;
  result.distribution = true;
  result.spread = spread;
  return result;
}

Eigen::MatrixXd covariance(const ShareDistribution& said) {
  const auto n = static_cast<Eigen::Index>(said.mean.size());
  const Eigen::MatrixXd factor =
      Eigen::Map<const Eigen::Matrix<double, -1, -1, Eigen::RowMajor>>(said.factor.data(), n, n);
  const auto deviation = Eigen::Map<const Eigen::VectorXd>(said.deviation.data(), n).asDiagonal();
  return deviation * factor * factor.transpose() * deviation;
}

// Minus the log of the density by the covariance itself.
double minus_log_density(const ShareDistribution& said, const std::vector<double>& truth,
                         const std::vector<OutputRange>& ranges) {
  Eigen::VectorXd difference(static_cast<Eigen::Index>(truth.size()));
  for (std::size_t i = 0; i < truth.size(); ++i)
    difference[static_cast<Eigen::Index>(i)] = ranges[i].share(truth[i]) - said.mean[i];
  const Eigen::MatrixXd c = covariance(said);
  return (difference.dot(c.inverse() * difference) + std::log(c.determinant()) +
          static_cast<double>(truth.size()) * std::log(2 * std::numbers::pi)) /
         2;
}

// Parameters drawn from what the raw outputs say; shares may lie outside of [0, 1].
std::vector<double> draw(const ShareDistribution& said, const std::vector<OutputRange>& ranges, std::uint64_t index) {
  const std::size_t n = said.mean.size();
  std::vector<double> truth;
  for (std::size_t i = 0; i < n; ++i) {
    double share = said.mean[i];
    for (std::size_t j = 0; j <= i; ++j)
      share += said.deviation[i] * said.factor[i * n + j] * random_normal(7, index, j);
    truth.push_back(ranges[i].parameter_of_share(share));
  }
  return truth;
}

// Images of nothing, and truths that a given distribution draws.
class Drawn : public Examples {
 public:
  Drawn(std::size_t count, ShareDistribution from) : count_(count), from_(std::move(from)) {}
  std::size_t count() const override { return count_; }
  void read(std::size_t index, std::uint64_t, std::span<float> image, std::span<double> truth) const override {
    std::fill(image.begin(), image.end(), 0.0F);
    const std::vector<double> drawn = draw(from_, default_outputs(), index);
    std::copy(drawn.begin(), drawn.end(), truth.begin());
  }

 private:
  std::size_t count_;
  ShareDistribution from_;
};

}  // namespace

TEST_CASE("The likelihood loss is minus the log of the normal density, and its gradient the finite difference") {
  const std::vector<OutputRange> ranges = default_outputs();
  const std::vector<double> truth{40, 0.8, 0.5, 300, 0.35, -0.05};  // the second at the ends of the ranges
  Numbers raw = some_raw;
  for (const double more : {-0.6, 1.3, 0.1, 0.0, -2.0, 0.3, 1.1, 0.0, -0.8}) raw.push_back(more);
  raw = rounded(raw);
  const auto loss = [&] {
    const std::vector<float> both = as_floats(raw);
    double sum = 0;
    for (std::size_t example = 0; example < 2; ++example)
      sum += minus_log_density(share_distribution(std::span(both).subspan(9 * example, 9), description()),
                               {truth.begin() + 3 * static_cast<std::ptrdiff_t>(example),
                                truth.begin() + 3 * static_cast<std::ptrdiff_t>(example + 1)},
                               ranges);
    return sum / 6;
  };
  const OutputLoss result = likelihood_loss(as_floats(raw), truth, ranges);
  CHECK(result.loss == Approx(loss()).epsilon(1e-6));
  // Raw outputs are floats: steps that they can take.
  for (std::size_t i = 0; i < raw.size(); ++i) {
    INFO(i);
    CHECK(result.gradient[i] == Approx(difference(raw, i, loss, 0x1p-9)).epsilon(2e-3).margin(1e-4));
  }
}

TEST_CASE("Where raw outputs are 0 a network says what an even distribution over its ranges has for moments") {
  const ShareDistribution said = share_distribution(std::vector<float>(9, 0.0F), description());
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(said.mean[i] == 0.5);
    CHECK(said.deviation[i] == Approx(1 / std::sqrt(12.0)));
    for (std::size_t j = 0; j < 3; ++j) CHECK(said.factor[3 * i + j] == (i == j ? 1 : 0));
  }
}

TEST_CASE("Truths that a distribution draws lie in its intervals and in its joint region 95 % of the time", "[stat]") {
  const NetworkDescription network = description({0.4, 0.8, 0.3});
  const std::vector<float> raw = as_floats(some_raw);
  const ShareDistribution said = share_distribution(raw, network);
  const std::vector<ParameterEstimate> estimates = estimates_of(raw, network);
  constexpr int count = 4000;
  std::vector<double> held(3), square(3);
  double jointly = 0, covered_by_chance = 3.3 * std::sqrt(0.95 * 0.05 / count);
  for (int k = 0; k < count; ++k) {
    const std::vector<double> truth = draw(said, network.outputs, static_cast<std::uint64_t>(k));
    const Calibration c = calibration_of(raw, truth, network);
    for (std::size_t p = 0; p < 3; ++p) {
      // An interval that is cut off at the range's end holds what lies beyond it, too: no material does.
      const double inside = std::clamp(truth[p], network.outputs[p].low, network.outputs[p].high);
      held[p] += (inside >= estimates[p].low && inside <= estimates[p].high) / double(count);
      square[p] += c.score[p] * c.score[p] / count;
    }
    jointly += (c.distance <= joint_region(3)) / double(count);
  }
  CHECK(jointly == Approx(0.95).margin(covered_by_chance));
  for (std::size_t p = 0; p < 3; ++p) {
    INFO(p);
    CHECK(square[p] == Approx(1).margin(3.5 * std::sqrt(2.0 / count)));
    const bool cut = estimates[p].high == network.outputs[p].high || estimates[p].low == network.outputs[p].low;
    if (cut)
      CHECK(held[p] > 0.95 - covered_by_chance);
    else
      CHECK(held[p] == Approx(0.95).margin(covered_by_chance));
    CHECK(estimates[p].value == Approx(network.outputs[p].parameter_of_share(said.mean[p])));
  }
}

TEST_CASE("The joint region is chi-square's quantile") {
  CHECK(joint_region(1) == Approx(std::pow(normal_quantile(0.975), 2)));
  CHECK(joint_region(2) == Approx(-2 * std::log(0.05)));
  CHECK(joint_region(3) == Approx(7.814728));
}

TEST_CASE("Calibration finds by how much a network is too sure, of each output", "[stat]") {
  Network network(description());
  for (std::size_t i = 0; i < some_raw.size(); ++i)
    network.weights().back().values[i] = static_cast<float>(some_raw[i]);  // whatever it sees
  ShareDistribution wider = share_distribution(as_floats(some_raw), network.description());
  const std::vector<double> factor{2, 0.5, 1};
  for (std::size_t p = 0; p < 3; ++p) wider.deviation[p] *= factor[p];
  const Drawn held_out(1000, wider);
  const std::vector<double> spread = calibrated_spread(network, held_out);
  // The quantile's deviation: sqrt(.95 .05 / 1000) over twice the density at 1.96.
  for (std::size_t p = 0; p < 3; ++p) CHECK(spread[p] / factor[p] == Approx(1).margin(3.3 * 0.0069 / 0.117 / 1.96));
  network.set_spread(spread);
  for (std::size_t p = 0; p < 3; ++p)  // whatever it was before
    CHECK(calibrated_spread(network, held_out)[p] == Approx(spread[p]).epsilon(1e-12));
  std::size_t held = 0;
  for (std::size_t k = 0; k < held_out.count(); ++k) {
    std::vector<float> image(16);
    std::vector<double> truth(3);
    held_out.read(k, 0, image, truth);
    held += std::fabs(calibration_of(network.forward(image, 1), truth, network.description()).score[0]) <=
            normal_quantile(0.975) * (1 + 1e-9);
  }
  CHECK(held == 951);                                                                // 95 % of 1001
  CHECK(calibrated_spread(network, Drawn(18, wider)) == std::vector<double>(3, 1));  // too few to tell
}

TEST_CASE("A network without a distribution says its parameters alone") {
  NetworkDescription plain = description();
  plain.distribution = false;
  plain.spread.clear();
  const std::vector<ParameterEstimate> estimates = estimates_of(std::vector<float>{0, 1, -1}, plain);
  REQUIRE(estimates.size() == 3);
  CHECK(estimates[1].value == Approx(plain.outputs[1].parameter(1)));
  CHECK(std::isnan(estimates[1].low));
  CHECK_THROWS_AS(share_distribution(std::vector<float>{0, 1, -1}, plain), UsageError);
}

TEST_CASE("Descriptions of distributions that cannot be are usage errors") {
  NetworkDescription network = description();
  CHECK_NOTHROW(Network(network));
  network.spread = {1, 1};
  CHECK_THROWS_AS(Network(network), UsageError);
  network.spread = {1, 0, 1};
  CHECK_THROWS_AS(Network(network), UsageError);
  network = description();
  network.kind = "itn";
  CHECK_THROWS_AS(Network(network), UsageError);
  network = description();
  network.distribution = false;
  CHECK_THROWS_AS(Network(network), UsageError);
}
