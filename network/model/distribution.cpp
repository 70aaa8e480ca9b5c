#include "itn/distribution.h"

#include <array>
#include <cmath>
#include <numbers>

#include "itn/error.h"
#include "runtime/base/parameter_chain.h"
#include "runtime/base/statistics.h"

namespace itn {
namespace {

// The formulas of distribution.h, once, for numbers and for their derivatives.
template <class Real>
class Said {
 public:
  Said(std::vector<Real> raw, std::vector<double> spread) : raw_(std::move(raw)), spread_(std::move(spread)) {}

  std::size_t count() const { return spread_.size(); }
  Real mean(std::size_t i) const { return FromLogit{0, 1}(Numbers<Real, 1>{raw_[i]})[0]; }
  Real deviation(std::size_t i) const {
    using std::exp;
    return Real(spread_[i] / std::sqrt(12.0)) * exp(raw_[count() + i]);
  }
  // An element of the factor's row before it is scaled, and the row's length.
  Real entry(std::size_t i, std::size_t j) const { return raw_[2 * count() + i * (i - 1) / 2 + j]; }
  Real length(std::size_t i) const {
    using std::sqrt;
    Real square = 1;
    for (std::size_t j = 0; j < i; ++j) square += entry(i, j) * entry(i, j);
    return sqrt(square);
  }
  // The independent standard normal numbers that make these shares.
  std::vector<Real> whitened(const std::vector<double>& shares) const {
    std::vector<Real> w;
    for (std::size_t i = 0; i < count(); ++i) {
      Real number = (Real(shares[i]) - mean(i)) / deviation(i) * length(i);
      for (std::size_t j = 0; j < i; ++j) number -= entry(i, j) * w[j];
      w.push_back(number);
    }
    return w;
  }
  Real minus_log_density(const std::vector<double>& shares) const {
    using std::log;
    Real sum = 0;
    for (const Real& number : whitened(shares)) sum += Real(0.5) * number * number;
    for (std::size_t i = 0; i < count(); ++i)
      sum += log(deviation(i) / length(i)) + Real(0.5 * std::log(2 * std::numbers::pi));
    return sum;
  }

 private:
  std::vector<Real> raw_;
  std::vector<double> spread_;
};

Said<double> said(std::span<const float> raw, const NetworkDescription& network) {
  if (!network.distribution) throw UsageError("this network says parameters, and no distribution of them");
  return {{raw.begin(), raw.end()}, network.spread};
}

std::vector<double> shares_of(std::span<const double> truth, const std::vector<OutputRange>& ranges) {
  std::vector<double> shares;
  for (std::size_t i = 0; i < truth.size(); ++i) shares.push_back(ranges[i].share(truth[i]));
  return shares;
}

// Cumulative distribution of chi-square with n degrees of freedom, at x > 0: the series of the incomplete gamma
// function (Abramowitz and Stegun 6.5.29).
double chi_square_cdf(std::size_t n, double x) {
  const double a = static_cast<double>(n) / 2;
  double term = 1 / a, sum = term;
  for (double k = 1; term > 1e-16 * sum; ++k) sum += term *= (x / 2) / (a + k);
  return sum * std::exp(a * std::log(x / 2) - x / 2 - std::lgamma(a));
}

}  // namespace

ShareDistribution share_distribution(std::span<const float> raw, const NetworkDescription& network) {
  const Said<double> numbers = said(raw, network);
  const std::size_t n = numbers.count();
  ShareDistribution result{{}, {}, std::vector<double>(n * n)};
  for (std::size_t i = 0; i < n; ++i) {
    result.mean.push_back(numbers.mean(i));
    result.deviation.push_back(numbers.deviation(i));
    for (std::size_t j = 0; j <= i; ++j)
      result.factor[i * n + j] = (j < i ? numbers.entry(i, j) : 1) / numbers.length(i);
  }
  return result;
}

std::vector<ParameterEstimate> estimates_of(std::span<const float> raw, const NetworkDescription& network) {
  std::vector<ParameterEstimate> result;
  const double half = normal_quantile(0.975);
  for (std::size_t i = 0; i < network.outputs.size(); ++i) {
    const OutputRange& range = network.outputs[i];
    ParameterEstimate estimate{range.parameter(raw[i]), NAN, NAN};
    if (network.distribution) {
      const Said<double> numbers = said(raw, network);
      const double mean = numbers.mean(i), way = half * numbers.deviation(i);
      estimate.low = range.parameter_of_share(std::max(0.0, mean - way));
      estimate.high = range.parameter_of_share(std::min(1.0, mean + way));
    }
    result.push_back(estimate);
  }
  return result;
}

OutputLoss likelihood_loss(std::span<const float> outputs, std::span<const double> truth,
                           const std::vector<OutputRange>& ranges) {
  const std::size_t n = ranges.size(), batch = truth.size() / n, raw_count = outputs.size() / batch;
  const std::vector<double> spread(n, 1);
  const auto count = static_cast<double>(truth.size());
  OutputLoss result{0, std::vector<float>(outputs.size())};
  for (std::size_t example = 0; example < batch; ++example) {
    const std::vector<double> shares = shares_of(truth.subspan(example * n, n), ranges);
    const std::span<const float> raw = outputs.subspan(example * raw_count, raw_count);
    for (std::size_t k = 0; k < raw_count; ++k) {
      std::vector<Dual<1>> x(raw.begin(), raw.end());
      x[k] = Dual<1>::variable(raw[k], 0);
      const Dual<1> loss = Said<Dual<1>>(std::move(x), spread).minus_log_density(shares);
      if (k == 0) result.loss += loss.value / count;
      result.gradient[example * raw_count + k] = static_cast<float>(loss.derivative[0] / count);
    }
  }
  return result;
}

Calibration calibration_of(std::span<const float> raw, std::span<const double> truth,
                           const NetworkDescription& network) {
  const Said<double> numbers = said(raw, network);
  const std::vector<double> shares = shares_of(truth, network.outputs);
  Calibration result;
  for (std::size_t i = 0; i < numbers.count(); ++i)
    result.score.push_back((shares[i] - numbers.mean(i)) / numbers.deviation(i));
  for (const double number : numbers.whitened(shares)) result.distance += number * number;
  return result;
}

double joint_region(std::size_t n) {
  double low = 0, high = 20 + 4 * static_cast<double>(n);
  for (int halving = 0; halving < 60; ++halving) {
    const double middle = (low + high) / 2;
    (chi_square_cdf(n, middle) < 0.95 ? low : high) = middle;
  }
  return low;
}

}  // namespace itn
