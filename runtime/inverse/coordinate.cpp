#include "runtime/inverse/coordinate.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "itn/error.h"
#include "kernels/model/obstacle.h"
#include "runtime/base/parameter_chain.h"

namespace itn {
namespace {

constexpr double logit_edge = 12;       // float knows 1 from 1 - 6e-6
constexpr double logit_start_edge = 6;  // where a start on the edge begins
constexpr double log_edge = 1e-6;       // the same share of the bound
constexpr double largest_log = 30;      // 10^13

template <class Call>
auto evaluate(const Parameter& p, bool logarithmic, double x, Call&& call) {
  return logarithmic ? call(jacobian(from_log, std::array{x}))
                     : call(jacobian(FromLogit{p.low, p.high}, std::array{x}));
}

}  // namespace

Coordinate::Coordinate(const Parameter& parameter) : parameter_(parameter) {
  // Below it the image does not change with alpha.
  const double low = parameter.member.rfind("alpha", 0) == 0 ? least_alpha : parameter.low;
  logarithmic_ = low > 0 || !std::isfinite(parameter.high);
  least_ = !logarithmic_ ? -logit_edge : low > 0 ? std::log(low) + log_edge : -largest_log;
  most_ = !logarithmic_                   ? logit_edge
          : std::isfinite(parameter.high) ? std::log(parameter.high) - log_edge
                                          : largest_log;
}

double Coordinate::of(double value) const {
  if (!parameter_.contains(value))
    throw UsageError(
        fmt::format("parameter {}: the start is {}, need a number in {}", parameter_.name, value, parameter_.range()));
  if (logarithmic_) return clamp(std::log(value));
  return std::clamp(std::log((value - parameter_.low) / (parameter_.high - value)), -logit_start_edge,
                    logit_start_edge);
}

double Coordinate::value(double x) const {
  return evaluate(parameter_, logarithmic_, x, [](const auto& j) { return j.value[0]; });
}

double Coordinate::slope(double x) const {
  return evaluate(parameter_, logarithmic_, x, [](const auto& j) { return j.by[0][0]; });
}

double Coordinate::start(double u) const {
  if (logarithmic_) return clamp(of(parameter_.value) + std::log(4.0) * (2 * u - 1));
  return of(parameter_.low + (parameter_.high - parameter_.low) * (0.1 + 0.8 * u));
}

double Coordinate::clamp(double x) const { return std::clamp(x, least_, most_); }

bool Coordinate::at_edge(double x) const { return x <= least_ || x >= most_; }

}  // namespace itn
