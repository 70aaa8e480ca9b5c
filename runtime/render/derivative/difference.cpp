#include "runtime/render/derivative/difference.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>

#include "runtime/base/statistics.h"

namespace itn {
namespace {

// |t| that Student's t with that many degrees of freedom exceeds with probability 0.05: the Cornish-Fisher expansion
// (Abramowitz and Stegun 26.7.5), within 1 % for 3 degrees and more.
double t_limit_95(double degrees) {
  const double x = normal_quantile(0.975), x2 = x * x;
  return x * (1 + (x2 + 1) / (4 * degrees) + ((5 * x2 + 16) * x2 + 3) / (96 * degrees * degrees) +
              (((3 * x2 + 19) * x2 + 17) * x2 - 15) / (384 * degrees * degrees * degrees));
}

// Variance of the mean of n numbers from their sum and the sum of their squares.
double variance_of_mean(double sum, double sum_2, double n) {
  return std::max(0.0, (sum_2 - sum * sum / n) / (n - 1) / n);
}

// Distance by which the parameter may move before the image has a kink; 0: it is at one.
double distance_to_kink(const Scene& scene, const Parameter& p) {
  // The sky's tables are linear between whole turbidities.
  if (p.member == "turbidity") return std::fabs(p.value - std::round(p.value));
  if (p.member != "int_ior" && p.member != "ext_ior") return std::numeric_limits<double>::infinity();
  const Bsdf& b = scene.bsdfs.at(static_cast<std::size_t>(p.indices.front()));
  const auto index = [&](const char* name) { return b.values[b.values_called(p.id, name).at(0)].value[0]; };
  return std::fabs(index("int_ior") - index("ext_ior"));
}

}  // namespace

DifferenceStencil difference_stencil(const Scene& scene, const Parameter& p) {
  const double below = p.value - p.low, above = p.high - p.value;
  const double width = std::isfinite(p.high - p.low) ? p.high - p.low : 1;
  DifferenceStencil s;
  if (std::min(below, above) < 1e-5 * width) {
    const double d = (below < above ? 0.005 : -0.005) * width;
    s.offset = {0, d, 2 * d, 3 * d};
    s.weight = {-11 / (6 * d), 3 / d, -3 / (2 * d), 1 / (3 * d)};
    s.step = std::fabs(3 * d);
    return s;
  }
  double h = 0.1 * std::min({below, above, std::isfinite(p.low) ? below : std::max(1.0, std::fabs(p.value))});
  const double kink = distance_to_kink(scene, p);
  h = kink > 0 ? std::min(h, 0.2 * kink) : 0.1 * h;
  s.offset = {-h, -h / 2, h / 2, h};
  if (kink > 0)
    s.weight = {1 / (6 * h), -4 / (3 * h), 4 / (3 * h), -1 / (6 * h)};
  else
    s.weight = {1 / (2 * h), -2 / h, 2 / h, -1 / (2 * h)};
  s.step = h;
  return s;
}

Scene moved_scene(const Scene& scene, const Parameter& p, double offset) {
  Scene moved = scene;
  moved.lights_sampled_as = scene.lights;
  if (moved.environment) moved.environment->sampled_as = std::make_shared<Environment>(*scene.environment);
  set_parameter(moved, p, p.value + offset);
  return moved;
}

double rounding_error(const DifferenceStencil& stencil, double mean_of_image) {
  double sum = 0;
  for (const double w : stencil.weight) sum += std::fabs(w);
  return 0.5 * static_cast<double>(std::numeric_limits<float>::epsilon()) * std::fabs(mean_of_image) * sum;
}

DerivativeComparison::DerivativeComparison(std::size_t pixels, std::size_t channels)
    : channels_(channels), sums_(pixels * channels) {}

void DerivativeComparison::add(const std::vector<float>& derivative, const std::vector<double>& difference) {
  if (derivative.size() != sums_.size() || difference.size() != sums_.size())
    throw std::logic_error("DerivativeComparison: images of another size");
  for (std::size_t i = 0; i < sums_.size(); ++i) {
    const double a = static_cast<double>(derivative[i]), b = difference[i], d = a - b;
    Sums& s = sums_[i];
    s.derivative += a;
    s.derivative_2 += a * a;
    s.difference += b;
    s.difference_2 += b * b;
    s.between += d;
    s.between_2 += d * d;
  }
  ++batches_;
}

std::vector<DerivativeComparison::Channel> DerivativeComparison::result(double rounding) const {
  if (batches_ < 2) throw std::logic_error("DerivativeComparison: fewer than two batches");
  const double n = static_cast<double>(batches_), limit = t_limit_95(n - 1);
  const double pixels = static_cast<double>(sums_.size()) / static_cast<double>(channels_);
  std::vector<Channel> result(channels_);
  std::vector<std::size_t> beyond(channels_, 0);
  for (std::size_t i = 0; i < sums_.size(); ++i) {
    const Sums& s = sums_[i];
    Channel& c = result[i % channels_];
    c.derivative += s.derivative / n;
    c.difference += s.difference / n;
    c.derivative_stderr += variance_of_mean(s.derivative, s.derivative_2, n);
    c.difference_stderr += variance_of_mean(s.difference, s.difference_2, n);
    const double variance = variance_of_mean(s.between, s.between_2, n);
    c.stderr_between += variance;
    if (s.derivative_2 == 0 && std::sqrt(s.difference_2 / n) <= 4 * rounding) continue;
    ++c.pixels;
    beyond[i % channels_] += std::fabs(s.between / n) > limit * std::hypot(std::sqrt(variance), rounding);
  }
  for (std::size_t k = 0; k < channels_; ++k) {
    Channel& c = result[k];
    c.derivative /= pixels;
    c.difference /= pixels;
    c.derivative_stderr = std::sqrt(c.derivative_stderr) / pixels;
    c.difference_stderr = std::hypot(std::sqrt(c.difference_stderr) / pixels, rounding);
    c.stderr_between = std::hypot(std::sqrt(c.stderr_between) / pixels, rounding);
    const double between = c.derivative - c.difference;
    c.z = between == 0 ? 0 : between / c.stderr_between;
    c.beyond_95 = c.pixels ? static_cast<double>(beyond[k]) / static_cast<double>(c.pixels) : 0;
  }
  return result;
}

}  // namespace itn
