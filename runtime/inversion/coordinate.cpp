#include "runtime/inversion/coordinate.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "runtime/derivative/parameter_chain.h"
#include "runtime/error.h"

namespace itn {
namespace {

constexpr double edge = 12;         // float knows 1 from 1 - 6e-6
constexpr double start_edge = 6;    // where a start on the edge begins
constexpr double largest_log = 30;  // 10^13

template <class Call>
auto evaluate(const Parameter& p, bool bounded, double x, Call&& call) {
  return bounded ? call(jacobian(FromLogit{p.low, p.high}, std::array{x})) : call(jacobian(from_log, std::array{x}));
}

}  // namespace

Coordinate::Coordinate(const Parameter& parameter) : parameter_(parameter) {}

bool Coordinate::bounded() const { return std::isfinite(parameter_.high); }

double Coordinate::of(double value) const {
  if (!parameter_.contains(value))
    throw UsageError(
        fmt::format("parameter {}: the start is {}, need a number in {}", parameter_.name, value, parameter_.range()));
  if (!bounded()) return std::clamp(std::log(value), -largest_log, largest_log);
  return std::clamp(std::log((value - parameter_.low) / (parameter_.high - value)), -start_edge, start_edge);
}

double Coordinate::value(double x) const {
  return evaluate(parameter_, bounded(), x, [](const auto& j) { return j.value[0]; });
}

double Coordinate::slope(double x) const {
  return evaluate(parameter_, bounded(), x, [](const auto& j) { return j.by[0][0]; });
}

double Coordinate::clamp(double x) const {
  const double most = bounded() ? edge : largest_log;
  return std::clamp(x, -most, most);
}

bool Coordinate::at_edge(double x) const { return std::fabs(x) >= (bounded() ? edge : largest_log); }

}  // namespace itn
