#include "runtime/inverse/gauss_newton/least_squares.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "itn/error.h"
#include "runtime/inverse/smoothing.h"

namespace itn {
namespace {

constexpr int variance_radius = 1;  // [pixel]
constexpr std::array<int, 4> instrument_radii{0, 1, 2, 4};
constexpr double least_variance = 1e-3;  // of the image's mean: pixels without noise must not rule

std::vector<double> smoothed(const std::vector<double>& data, const TargetImage& shape, int radius,
                             Centre centre = Centre::in) {
  return smoothed(data, shape.width, shape.height, shape.channels, radius, centre);
}

// The unknowns as one image sees them.
struct View {
  View(const std::vector<Coordinate>& coordinates, const std::vector<double>& x, std::size_t image, bool white_balance)
      : unknowns(static_cast<Eigen::Index>(x.size())),
        factors(camera_factors(x, coordinates.size(), image, white_balance)) {
    for (std::size_t p = 0; p < coordinates.size(); ++p) slope.push_back(coordinates[p].slope(x[p]));
    const std::size_t of_channels = white_balance ? 2 : 0;
    if (x.size() > slope.size() + of_channels) own_exposure = static_cast<Eigen::Index>(slope.size() + image);
    if (white_balance) red = unknowns - 2;
  }

  double factor(const Rendering& rendering, std::size_t i) const {
    return factors[i % static_cast<std::size_t>(rendering.channels)];
  }
  double model(const Rendering& rendering, std::size_t i) const {
    return factor(rendering, i) * static_cast<double>(rendering.mean[i]);
  }
  // d (s b T) / d unknown at pixel and channel i.
  void jacobian(const Rendering& rendering, std::size_t i, Eigen::VectorXd& result) const {
    result.setZero(unknowns);
    for (std::size_t p = 0; p < slope.size(); ++p)
      result[static_cast<Eigen::Index>(p)] =
          factor(rendering, i) * slope[p] * static_cast<double>(rendering.derivatives[p].mean[i]);
    if (own_exposure >= 0) result[own_exposure] = model(rendering, i);
    const std::size_t channel = i % static_cast<std::size_t>(rendering.channels);
    if (red >= 0 && channel != 1) result[channel == 0 ? red : red + 1] = model(rendering, i);
  }
  // Standard deviation of an entry of the Jacobian, by the rendering's noise.
  double jacobian_error(const Rendering& rendering, std::size_t i, std::size_t k) const {
    if (k < slope.size())
      return std::fabs(factor(rendering, i) * slope[k]) * static_cast<double>(rendering.derivatives[k].stderr_[i]);
    const auto row = static_cast<Eigen::Index>(k);
    const std::size_t channel = i % static_cast<std::size_t>(rendering.channels);
    const bool depends =
        row == own_exposure || (red >= 0 && row == red && channel == 0) || (red >= 0 && row == red + 1 && channel == 2);
    return depends ? std::sqrt(variance(rendering, i)) : 0;
  }
  // Variance of the mean of s b T.
  double variance(const Rendering& rendering, std::size_t i) const {
    const double error = factor(rendering, i) * static_cast<double>(rendering.stderr_[i]);
    return error * error;
  }
  // Rows of the unknowns that this image says something of.
  std::vector<Eigen::Index> own() const {
    std::vector<Eigen::Index> rows(slope.size());
    std::iota(rows.begin(), rows.end(), 0);
    if (own_exposure >= 0) rows.push_back(own_exposure);
    if (red >= 0) rows.insert(rows.end(), {red, red + 1});
    return rows;
  }

  Eigen::Index unknowns, own_exposure = -1, red = -1;  // blue follows red
  std::vector<double> slope;
  std::array<double, 3> factors;
};

double variance_floor(const PixelNoise& noise, double spp) {
  double sum = 0;
  for (std::size_t i = 0; i < noise.sample.size(); ++i) sum += noise.target[i] + noise.sample[i] / spp;
  const double mean = sum / static_cast<double>(noise.sample.size());
  if (!(mean > 0)) throw ResultError("the rendered images are all black, so there is nothing to compare");
  return least_variance * mean;
}

using Columns = std::vector<std::vector<double>>;  // one an unknown, each one number a pixel and channel

Columns smoothed(const Columns& columns, const TargetImage& shape, int radius, Centre centre = Centre::in) {
  Columns result;
  for (const std::vector<double>& column : columns) result.push_back(smoothed(column, shape, radius, centre));
  return result;
}

// sum of w a b^T
Eigen::MatrixXd weighted_product(const Columns& a, const Columns& b, const std::vector<double>& weight) {
  const auto n = static_cast<Eigen::Index>(a.size());
  Eigen::MatrixXd result(n, n);
  for (Eigen::Index k = 0; k < n; ++k)
    for (Eigen::Index l = 0; l < n; ++l) {
      const std::vector<double>&x = a[static_cast<std::size_t>(k)], &y = b[static_cast<std::size_t>(l)];
      double sum = 0;
      for (std::size_t i = 0; i < weight.size(); ++i) sum += weight[i] * x[i] * y[i];
      result(k, l) = sum;
    }
  return result;
}

// J smoothed over as many pixels as tell the unknowns best: the largest determinant of A^T B^-1 A, their information,
// with A = sum of w Z J^T and B = sum of w Z Z^T. Pixels have independent noise, so with the mean over a pixel's
// neighbours in place of its Z, A knows only what Z and J share without it.
Columns instruments_of(const Columns& jacobian, const std::vector<double>& weight, const TargetImage& shape) {
  Columns best = jacobian;
  double most = -std::numeric_limits<double>::infinity();
  for (const int radius : instrument_radii) {
    Columns candidate = radius == 0 ? jacobian : smoothed(jacobian, shape, radius);
    Eigen::MatrixXd a = weighted_product(smoothed(jacobian, shape, std::max(1, radius), Centre::out), jacobian, weight);
    a = (a + a.transpose().eval()) / 2;
    const double least = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(a, Eigen::EigenvaluesOnly).eigenvalues()[0];
    if (!(least > 0)) continue;
    const double told =
        2 * std::log(a.determinant()) - std::log(weighted_product(candidate, candidate, weight).determinant());
    if (told > most) {
      most = told;
      best = std::move(candidate);
    }
  }
  return std::isfinite(most) ? best : smoothed(jacobian, shape, instrument_radii.back());
}

// Over the variance of a pixel and channel, as the reference says it; 0: not compared.
class Weights {
 public:
  Weights(const Rendering& rendering, const TargetImage& target, const Reference& reference)
      : target_(target), noise_(reference.noise), spp_(rendering.spp), floor_(variance_floor(noise_, spp_)) {}
  double operator[](std::size_t i) const {
    return target_.weight[i / static_cast<std::size_t>(target_.channels)] / std::max(floor_, known(i));
  }
  bool has_noise(std::size_t i) const { return known(i) > floor_; }

 private:
  double known(std::size_t i) const { return noise_.target[i] + noise_.sample[i] / spp_; }

  const TargetImage& target_;
  const PixelNoise& noise_;
  double spp_, floor_;
};

Eigen::VectorXd instrument_at(const Reference& reference, std::size_t i) {
  return reference.instruments.col(static_cast<Eigen::Index>(i)).cast<double>();
}

Eigen::MatrixXd scale_of(const Rendering& rendering, const TargetImage& target, const Reference& reference) {
  const Weights weights(rendering, target, reference);
  const Eigen::Index unknowns = reference.instruments.rows();
  Eigen::MatrixXd scale = Eigen::MatrixXd::Zero(unknowns, unknowns);
  for (std::size_t i = 0; i < target.value.size(); ++i) {
    if (weights[i] == 0) continue;
    const Eigen::VectorXd instrument = instrument_at(reference, i);
    scale.noalias() += weights[i] * instrument * instrument.transpose();
  }
  return scale;
}

// Inverse of the sum of w Z Z^T, regularised since it is singular where an unknown has no effect on the image.
Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& scale) {
  const Eigen::VectorXd unit = scale.diagonal().cwiseSqrt().cwiseMax(1e-300).cwiseInverse();
  Eigen::MatrixXd relative = unit.asDiagonal() * scale * unit.asDiagonal();
  relative.diagonal().array() += 1e-9;
  return unit.asDiagonal() * Eigen::MatrixXd(relative.inverse()) * unit.asDiagonal();
}

// A fit bends towards a pixel by the share `leverage` of its noise, so that its residual's variance is smaller by it.
constexpr double most_leverage = 0.99;

void add(const Rendering& rendering, const TargetImage& target, const Reference& reference, const View& view,
         const Eigen::MatrixXd& inverse_scale, double loss_weight, LeastSquares& sum) {
  const auto channels = static_cast<std::size_t>(target.channels);
  const Weights weights(rendering, target, reference);
  Eigen::VectorXd jacobian, part(view.unknowns), random(view.unknowns);
  Eigen::MatrixXd of_information(view.unknowns, view.unknowns);  // a column an unknown
  for (std::size_t pixel = 0; pixel < target.weight.size(); ++pixel) {
    const double of_pixel = target.weight[pixel];
    if (of_pixel == 0) continue;
    part.setZero();
    random.setZero();
    of_information.setZero();
    double loss_noise = 0, leverage = 0;
    for (std::size_t c = 0; c < channels; ++c) {
      const std::size_t i = pixel * channels + c;
      const double weight = weights[i], variance = view.variance(rendering, i);
      const double r = view.model(rendering, i) - static_cast<double>(target.value[i]);
      const Eigen::VectorXd instrument = instrument_at(reference, i);
      view.jacobian(rendering, i, jacobian);
      part += weight * r * instrument;
      random += weight * std::sqrt(variance) * instrument;
      sum.information.noalias() += weight * instrument * jacobian.transpose();
      for (Eigen::Index k = 0; k < view.unknowns; ++k)
        of_information.col(k) += weight * view.jacobian_error(rendering, i, static_cast<std::size_t>(k)) * instrument;
      leverage += weight * instrument.dot(inverse_scale * instrument);
      sum.loss += loss_weight * of_pixel * (r * r - variance);
      // the standard deviation of a squared mean whose noise is normal
      const double spread = std::sqrt(4 * r * r * variance + 2 * variance * variance);
      loss_noise += loss_weight * of_pixel * spread;
      if (!weights.has_noise(i)) continue;
      sum.cost += weight * r * r;
      sum.residuals += 1;
    }
    sum.gradient += part;
    leverage = std::min(leverage / static_cast<double>(channels), most_leverage);
    sum.spread.noalias() += part * part.transpose() / (1 - leverage);
    sum.monte_carlo.noalias() += random * random.transpose();
    for (Eigen::Index k = 0; k < view.unknowns; ++k)
      sum.information_noise[static_cast<std::size_t>(k)].noalias() +=
          of_information.col(k) * of_information.col(k).transpose();
    sum.loss_stderr += loss_noise * loss_noise;
  }
}

}  // namespace

std::array<double, 3> camera_factors(const std::vector<double>& x, std::size_t parameters, std::size_t image,
                                     bool white_balance) {
  const std::size_t exposures = x.size() - parameters - (white_balance ? 2 : 0);
  const double exposure = exposures > 0 ? std::exp(x[parameters + image]) : 1;
  if (!white_balance) return {exposure, exposure, exposure};
  return {exposure * std::exp(x[x.size() - 2]), exposure, exposure * std::exp(x[x.size() - 1])};
}

PixelNoise noise_of(const Rendering& rendering, const TargetImage& target, const std::array<double, 3>& factors,
                    double relative_noise) {
  const std::size_t size = target.value.size();
  std::vector<double> sample(size), mean(size);
  for (std::size_t i = 0; i < size; ++i) {
    const double factor = factors[i % static_cast<std::size_t>(target.channels)];
    const double error = factor * static_cast<double>(rendering.stderr_[i]);
    mean[i] = factor * static_cast<double>(rendering.mean[i]);
    sample[i] = error * error * rendering.spp;
  }
  PixelNoise noise{smoothed(sample, target, variance_radius), smoothed(mean, target, variance_radius)};
  double wanted = 0, have = 0;
  for (std::size_t i = 0; i < target.error.size(); ++i) {
    if (target.weight[i / static_cast<std::size_t>(target.channels)] == 0) continue;
    wanted += static_cast<double>(target.error[i]);
    have += std::sqrt(noise.sample[i]);
  }
  const double scale = have > 0 ? wanted * wanted / (have * have) : 0;
  for (std::size_t i = 0; i < size; ++i) {
    const double relative = relative_noise * noise.target[i];  // of the radiance, until now
    const double camera = target.noise.empty() ? 0 : static_cast<double>(target.noise[i]);
    noise.target[i] = scale * noise.sample[i] + relative * relative + camera * camera;
  }
  return noise;
}

WhiteResidual white_residual(const Rendering& rendering, const TargetImage& target,
                             const std::array<double, 3>& factors, const PixelNoise& noise) {
  WhiteResidual result{target.width, target.height, target.channels, {}};
  const double floor = variance_floor(noise, rendering.spp);
  for (std::size_t i = 0; i < target.value.size(); ++i) {
    const bool compared = target.weight[i / static_cast<std::size_t>(target.channels)] > 0;
    const double model =
        factors[i % static_cast<std::size_t>(target.channels)] * static_cast<double>(rendering.mean[i]);
    const double left = model - static_cast<double>(target.value[i]);
    const double known = noise.target[i] + noise.sample[i] / rendering.spp, variance = std::max(floor, known);
    // That a pixel without noise is right says nothing of how strong the noise is.
    const bool tells = known > floor || left * left > floor;
    result.value.push_back(compared && tells ? left / std::sqrt(variance) : 0);
    result.deviation.push_back(std::sqrt(variance));
  }
  return result;
}

Reference reference_of(const Rendering& rendering, const TargetImage& target, std::size_t image, double relative_noise,
                       const std::vector<Coordinate>& coordinates, const std::vector<double>& x, bool white_balance) {
  const View view(coordinates, x, image, white_balance);
  const std::size_t size = target.value.size();
  Reference reference{noise_of(rendering, target, view.factors, relative_noise), {}};
  Columns jacobians(x.size(), std::vector<double>(size));
  std::vector<double> weight(size);
  Eigen::VectorXd jacobian;
  const Weights weights(rendering, target, reference);
  for (std::size_t i = 0; i < size; ++i) {
    view.jacobian(rendering, i, jacobian);
    for (std::size_t k = 0; k < x.size(); ++k) jacobians[k][i] = jacobian[static_cast<Eigen::Index>(k)];
    weight[i] = weights[i];
  }
  // This image knows nothing about another one's exposure, which stays out of the choice.
  const std::vector<Eigen::Index> rows = view.own();
  Columns own;
  for (const Eigen::Index row : rows) own.push_back(jacobians[static_cast<std::size_t>(row)]);
  own = instruments_of(own, weight, target);
  reference.instruments.setZero(view.unknowns, static_cast<Eigen::Index>(size));
  for (std::size_t k = 0; k < own.size(); ++k)
    for (std::size_t i = 0; i < size; ++i)
      reference.instruments(rows[k], static_cast<Eigen::Index>(i)) = static_cast<float>(own[k][i]);
  return reference;
}

LeastSquares least_squares(const std::vector<Rendering>& images, const std::vector<TargetImage>& targets,
                           const std::vector<Reference>& references, const std::vector<Coordinate>& coordinates,
                           const std::vector<double>& x, bool white_balance) {
  LeastSquares sum;
  const auto n = static_cast<Eigen::Index>(x.size());
  sum.gradient = Eigen::VectorXd::Zero(n);
  sum.information = sum.scale = sum.spread = sum.monte_carlo = Eigen::MatrixXd::Zero(n, n);
  sum.information_noise.assign(x.size(), sum.scale);
  for (std::size_t t = 0; t < targets.size(); ++t) sum.scale += scale_of(images[t], targets[t], references[t]);
  const Eigen::MatrixXd inverse_scale = inverse_of(sum.scale);
  for (std::size_t t = 0; t < targets.size(); ++t) {
    double weights = 0;
    for (const float weight : targets[t].weight) weights += static_cast<double>(weight);
    const double all = weights * targets[t].channels * static_cast<double>(targets.size());
    add(images[t], targets[t], references[t], View(coordinates, x, t, white_balance), inverse_scale, 1 / all, sum);
  }
  sum.cost /= sum.residuals;
  sum.loss_stderr = std::sqrt(sum.loss_stderr);
  return sum;
}

}  // namespace itn
