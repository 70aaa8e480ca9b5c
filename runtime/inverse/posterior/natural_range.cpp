#include "runtime/inverse/posterior/natural_range.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "itn/error.h"
#include "runtime/base/statistics.h"

namespace itn {
namespace {

constexpr double edge = 1e-4;           // share of the range that is left out at a bound, where images are singular
constexpr double decade = 10;           // to both sides of a number without bounds
constexpr double cut_off = 1.0 / 2000;  // of a normal prior, on each side

bool two_bounds(const Parameter& p) { return std::isfinite(p.low) && std::isfinite(p.high); }

}  // namespace

NaturalRange::NaturalRange(const Parameter& parameter, double low, double high)
    : parameter_(parameter), low_(low), high_(high) {
  const bool inside = low >= parameter.low && high <= parameter.high;
  if (!inside || !(low < high))
    throw UsageError(fmt::format("{}: the range is {} to {}, need two numbers in {}, the smaller first", parameter.name,
                                 low, high, parameter.range()));
  logarithmic_ = parameter.low >= 0 && (parameter.low > 0 || !two_bounds(parameter));
  if (logarithmic_ && !(low > 0))
    throw UsageError(
        fmt::format("{}: the range is {} to {}, need numbers above 0, which are spread evenly in their "
                    "logarithm",
                    parameter.name, low, high));
  if (!logarithmic_ && two_bounds(parameter)) {
    const double margin = edge * (parameter.high - parameter.low);
    low_ = std::max(low, parameter.low + margin);
    high_ = std::min(high, parameter.high - margin);
  }
  const double from = natural(low_), to = natural(high_);
  centre_ = (from + to) / 2;
  half_ = (to - from) / 2;
}

NaturalRange NaturalRange::of_scene(const Parameter& parameter) {
  if (two_bounds(parameter) && !(parameter.low > 0)) return {parameter, parameter.low, parameter.high};
  if (parameter.low >= 0 && parameter.value > 0)
    return {parameter, std::max(parameter.low, parameter.value / decade),
            std::min(parameter.high, parameter.value * decade)};
  throw UsageError(fmt::format("{} has no bounds to spread materials between; give some: range {}=LOW,HIGH",
                               parameter.name, parameter.name));
}

NaturalRange NaturalRange::of_prior(const Coordinate& coordinate, double mean, double precision) {
  const double way = normal_quantile(1 - cut_off) / std::sqrt(precision);
  NaturalRange range(coordinate.parameter(), coordinate.value(coordinate.clamp(mean - way)),
                     coordinate.value(coordinate.clamp(mean + way)));
  range.mean_ = mean;
  range.precision_ = precision;
  return range;
}

double NaturalRange::natural(double value) const {
  if (logarithmic_) return std::log(value);
  if (!two_bounds(parameter_)) return value;
  const double share = (value - parameter_.low) / (parameter_.high - parameter_.low);
  return std::asin(std::sqrt(std::clamp(share, 0.0, 1.0)));
}

double NaturalRange::of(double value) const { return (natural(value) - centre_) / half_; }

double NaturalRange::value(double t) const {
  const double n = centre_ + half_ * t;
  if (logarithmic_) return std::exp(n);
  if (!two_bounds(parameter_)) return n;
  return parameter_.low + (parameter_.high - parameter_.low) * std::pow(std::sin(n), 2);
}

double NaturalRange::slope(double t) const {
  const double n = centre_ + half_ * t;
  if (logarithmic_) return half_ * std::exp(n);
  if (!two_bounds(parameter_)) return half_;
  return half_ * (parameter_.high - parameter_.low) * std::sin(2 * n);
}

double NaturalRange::log_prior(double t) const {
  if (precision_ > 0) {
    const Coordinate coordinate(parameter_);
    const double v = value(t), x = coordinate.of(v);
    return -0.5 * precision_ * (x - mean_) * (x - mean_) + std::log(slope(t) / coordinate.slope(x));
  }
  return logarithmic_ ? 0 : std::log(slope(t));
}

std::vector<NaturalRange> natural_ranges(const std::vector<Coordinate>& coordinates, const Prior& prior,
                                         const std::map<std::string, std::pair<double, double>>& given) {
  for (const auto& [name, range] : given)
    if (std::none_of(coordinates.begin(), coordinates.end(),
                     [&, wanted = name](const Coordinate& c) { return c.parameter().name == wanted; }))
      throw UsageError(
          fmt::format("range {}={},{}: {} is no parameter that is asked for", name, range.first, range.second, name));
  std::vector<NaturalRange> ranges;
  for (std::size_t p = 0; p < coordinates.size(); ++p) {
    const Coordinate& c = coordinates[p];
    const auto range = given.find(c.parameter().name);
    const auto k = static_cast<Eigen::Index>(p);
    const double precision = prior.mean.empty() ? 0 : prior.precision(k, k);
    const bool known = precision > 0;
    if (known && range != given.end())
      throw UsageError(fmt::format("{}: both a range and a prior; need one of them", c.parameter().name));
    ranges.push_back(known                  ? NaturalRange::of_prior(c, prior.mean[p], precision)
                     : range != given.end() ? NaturalRange(c.parameter(), range->second.first, range->second.second)
                                            : NaturalRange::of_scene(c.parameter()));
  }
  return ranges;
}

}  // namespace itn
