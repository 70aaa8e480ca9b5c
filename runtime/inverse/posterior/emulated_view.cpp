#include "runtime/inverse/posterior/emulated_view.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "itn/error.h"
#include "runtime/inverse/posterior/low_discrepancy.h"
#include "runtime/inverse/smoothing.h"

namespace itn {
namespace {

constexpr double least_variance = 1e-3;   // of the image's mean: pixels without noise must not rule
constexpr Eigen::Index most_images = 35;  // coefficients of a fitted image
constexpr Eigen::Index most_sums = 20;
constexpr double least_moves = 0.02;  // variance of a sum over the materials in question, over its noise
constexpr std::array<int, 4> radii{0, 1, 2, 4};
// How small what is left of a target may be, over its noise. Noise that is measured in a target may well be ten times
// too great where all that there is are edges.
double least_residual(const WhiteTarget& target) { return target.noise_known ? 0.5 : 0.005; }
constexpr double chance = 3;  // how much more than by noise on the mean some direction seems to move
constexpr int wide_degree = 4, local_degree = 2;  // of fitted images

using Rows = ImageRows;

// Compiled once.
Eigen::MatrixXd product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) { return a * b; }
Rows image_product(const Rows& a, const Rows& b) { return a * b; }
Eigen::MatrixXd gram(const Rows& a, const Rows& b) { return Rows(a * b.transpose()).cast<double>(); }
// Of images that are nearly each other's combinations: what is left between them must not be rounding.
Eigen::MatrixXd exact_gram(const Rows& a, const Rows& b) {
  return product(a.cast<double>(), b.cast<double>().transpose());
}

std::vector<std::size_t> inside(const std::vector<Exemplar>& exemplars, const Frame& frame) {
  std::vector<std::size_t> result;
  for (std::size_t i = 0; i < exemplars.size(); ++i)
    if (frame.near(exemplars[i].at)) result.push_back(i);
  return result;
}

// The images of some exemplars and their derivatives, as the rows of DesignRows, over the target's noise.
struct Stack {
  std::vector<Eigen::VectorXd> points;
  std::array<Rows, 2> value, error;

  Stack(const std::vector<Exemplar>& exemplars, const std::vector<std::size_t>& chosen, std::size_t view,
        const WhiteTarget& target) {
    const Eigen::Index block = exemplars.front().views[view].half[0].value.rows();
    for (std::size_t h = 0; h < 2; ++h) {
      value[h].resize(block * static_cast<Eigen::Index>(chosen.size()), target.weight.size());
      error[h].resizeLike(value[h]);
    }
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      const Exemplar& exemplar = exemplars[chosen[i]];
      points.push_back(exemplar.at);
      for (std::size_t h = 0; h < 2; ++h) {
        const auto first = block * static_cast<Eigen::Index>(i);
        value[h].middleRows(first, block) = exemplar.views[view].half[h].value * target.weight.asDiagonal();
        error[h].middleRows(first, block) = exemplar.views[view].half[h].error * target.weight.asDiagonal();
      }
    }
  }
};

// The matrix that turns a stack into the coefficients of the fitted image.
Eigen::MatrixXd fitting(const DesignRows& design, const Polynomials& polynomials, const Stack& stack) {
  constexpr double decay = 0.5;  // by degree, of the coefficients that are expected
  const auto pixels = static_cast<double>(stack.value[0].cols());
  Eigen::VectorXd weight(design.rows.rows());
  double square = 0;
  for (Eigen::Index m = 0; m < weight.size(); ++m) {
    const double noise =
        static_cast<double>(stack.error[0].row(m).squaredNorm() + stack.error[1].row(m).squaredNorm()) / (2 * pixels);
    weight[m] = 1 / std::max(1e-12, noise);
    if (m % design.block == 0) square += static_cast<double>(stack.value[0].row(m).squaredNorm()) / pixels;
  }
  square = std::max(1e-12, square * static_cast<double>(design.block) / static_cast<double>(weight.size()));
  Eigen::MatrixXd weighted = weight.asDiagonal() * design.rows;
  Eigen::MatrixXd normal = product(design.rows.transpose(), weighted);
  for (Eigen::Index k = 0; k < normal.rows(); ++k) {
    double degree = 0;
    for (const int power : polynomials.powers()[static_cast<std::size_t>(k)]) degree += power;
    normal(k, k) += 1 / (square * std::pow(decay, 2 * degree) * (k == 0 ? 1e4 : 1));
  }
  return Eigen::LLT<Eigen::MatrixXd>(normal).solve(Eigen::MatrixXd(weighted.transpose()));
}

struct FittedImages {
  Polynomials polynomials;
  Eigen::MatrixXd matrix;  // of a stack
  std::array<Rows, 2> coefficients;

  FittedImages(const Frame& frame, const Stack& stack, int most_degree)
      : polynomials(frame, std::min(most_degree,
                                    Polynomials::degree_for(frame.centre.size(),
                                                            std::min(most_images, stack.value[0].rows() * 2 / 3)))) {
    matrix = fitting(DesignRows(polynomials, stack.points), polynomials, stack);
    for (std::size_t h = 0; h < 2; ++h) coefficients[h] = image_product(matrix.cast<float>(), stack.value[h]);
  }
};

Rows smooth(const Rows& images, const WhiteTarget& shape, int radius) {
  if (radius == 0) return images;
  Rows result(images.rows(), images.cols());
  for (Eigen::Index k = 0; k < images.rows(); ++k) {
    std::vector<double> image(static_cast<std::size_t>(images.cols()));
    for (std::size_t i = 0; i < image.size(); ++i)
      image[i] =
          static_cast<double>(images(k, static_cast<Eigen::Index>(i))) * shape.deviation[static_cast<Eigen::Index>(i)];
    image = smoothed(image, shape.width, shape.height, shape.channels, radius);
    for (std::size_t i = 0; i < image.size(); ++i)
      result(k, static_cast<Eigen::Index>(i)) =
          static_cast<float>(image[i]) * shape.weight[static_cast<Eigen::Index>(i)];
  }
  return result;
}

// The share of a pixel in its own smoothed value.
Eigen::VectorXf own_share(const WhiteTarget& shape, int radius) {
  Eigen::VectorXf share(shape.weight.size());
  for (int y = 0; y < shape.height; ++y)
    for (int x = 0; x < shape.width; ++x) {
      const int tall = std::min(shape.height - 1, y + radius) - std::max(0, y - radius) + 1;
      const int wide = std::min(shape.width - 1, x + radius) - std::max(0, x - radius) + 1;
      share.segment((static_cast<Eigen::Index>(y) * shape.width + x) * shape.channels, shape.channels)
          .setConstant(1.0F / static_cast<float>(tall * wide));
    }
  return share;
}

struct Sums {
  Rows weights;           // orthonormal rows
  Eigen::VectorXd moves;  // variance of each over the materials in question
  double told = 0;
};

// Those combinations of the candidates, smoothed, that materials move most over their noise. Products of an image with
// itself are without the noise that it shares with itself.
Sums best_sums(const Rows& candidates, const Rows& images, const Eigen::MatrixXd& spread, const WhiteTarget& shape,
               int radius, const Eigen::MatrixXd& from, const Eigen::MatrixXd& to, const Rows& errors,
               Eigen::Index unknowns) {
  const Rows smooth_candidates = smooth(candidates, shape, radius);
  const Eigen::VectorXd noise =
      (errors.cwiseAbs2() * own_share(shape, radius)).cast<double>();  // of each row of the stack, with itself
  const Eigen::MatrixXd shared = product(from * noise.asDiagonal(), to.transpose());
  const Eigen::MatrixXd seen = exact_gram(smooth_candidates, images) - shared;
  Eigen::MatrixXd scale = exact_gram(smooth_candidates, smooth_candidates);
  scale.diagonal().array() += 1e-9 * scale.trace() + 1e-30;
  const Eigen::LLT<Eigen::MatrixXd> root(scale);
  const Eigen::MatrixXd relative = root.matrixL().solve(seen);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(product(product(relative, spread), relative.transpose()));
  // What the images' noise makes of itself along any direction, on the mean.
  const Eigen::VectorXd of_pixel = errors.rowwise().squaredNorm().cast<double>() / static_cast<double>(errors.cols());
  const double by_noise = product(product(to * of_pixel.asDiagonal(), to.transpose()), spread).trace();
  Sums sums;
  const Eigen::VectorXd values = eigen.eigenvalues().array() - by_noise;
  const Eigen::Index all = values.size(), least = std::min(all, unknowns);
  Eigen::Index kept = 0;
  while (kept < std::min(all, most_sums) &&
         (kept < least || values[all - 1 - kept] > std::max(least_moves, chance * by_noise)))
    ++kept;
  const Eigen::MatrixXd chosen = eigen.eigenvectors().rightCols(kept);
  const Eigen::MatrixXd combination = root.matrixU().solve(chosen);
  sums.weights = image_product(Rows(combination.transpose().cast<float>()), smooth_candidates);
  sums.moves = values.tail(kept).cwiseMax(0.0);
  sums.told = (1 + (values.array() - chance * by_noise).max(0.0)).log().sum();
  return sums;
}

// Each value that is compared by itself, where there are no more than sums.
bool are_few(const WhiteTarget& target) { return (target.weight.array() > 0).count() <= most_sums; }

Sums each_value(const WhiteTarget& target, const Rows& images, const Eigen::MatrixXd& spread) {
  const Eigen::Index count = (target.weight.array() > 0).count();
  Sums sums;
  sums.weights = Rows::Zero(count, target.weight.size());
  sums.moves.resize(count);
  for (Eigen::Index i = 0, k = 0; i < target.weight.size(); ++i) {
    if (!(target.weight[i] > 0)) continue;
    const Eigen::VectorXd coefficients = images.col(i).cast<double>();
    sums.weights(k, i) = 1;
    sums.moves[k++] = coefficients.dot(spread * coefficients);
  }
  return sums;
}

Eigen::MatrixXd values_at(const Polynomials& polynomials, const Eigen::MatrixXd& points) {
  Eigen::MatrixXd values(polynomials.size(), points.cols());
  Eigen::VectorXd one;
  for (Eigen::Index s = 0; s < points.cols(); ++s) {
    polynomials.evaluate(points.col(s), one);
    values.col(s) = one;
  }
  return values;
}

// Covariance of the polynomials over the samples. exposure: the mean image moves too, as a whole.
Eigen::MatrixXd spread_of(const Polynomials& polynomials, const Eigen::MatrixXd& samples, bool exposure) {
  constexpr double by_exposure = 0.1;  // standard deviation
  Eigen::MatrixXd values = values_at(polynomials, samples);
  const Eigen::VectorXd mean = values.rowwise().mean();
  values.colwise() -= mean;
  Eigen::MatrixXd spread = product(values, values.transpose()) / static_cast<double>(samples.cols());
  if (exposure) spread += by_exposure * by_exposure * mean * mean.transpose();
  return spread;
}

// Turns the coefficients of the wide images into those of polynomials that are nearest to them at the samples.
Eigen::MatrixXd local_view(const Polynomials& wide, const Polynomials& local, const Eigen::MatrixXd& samples) {
  const Eigen::MatrixXd from = values_at(wide, samples), to = values_at(local, samples);
  Eigen::MatrixXd normal = product(to, to.transpose());
  normal.diagonal().array() += 1e-6 * normal.trace() / static_cast<double>(normal.rows());
  return Eigen::LLT<Eigen::MatrixXd>(normal).solve(product(to, from.transpose()));
}

// Images of which sums over pixels are made. Few: of many, some look good by chance.
struct Candidates {
  std::array<Rows, 2> images;  // of each half
  Eigen::MatrixXd from;        // what each takes of the local stack's rows
};

Candidates candidate_images(const Stack& wide, const FittedImages& local_images, const Stack& local,
                            const Regions& regions) {
  const FittedImages wide_images(regions.wide, wide, wide_degree);
  const Eigen::MatrixXd turned =
      product(local_view(wide_images.polynomials, local_images.polynomials, regions.samples), wide_images.matrix);
  const Eigen::Index own = local_images.matrix.rows(), all = own + turned.rows();
  Candidates result;
  for (std::size_t h = 0; h < 2; ++h) {
    result.images[h].resize(all, local.value[h].cols());
    result.images[h] << local_images.coefficients[h], image_product(turned.cast<float>(), wide.value[h]);
  }
  // The local stack's rows among the wide one's: both are in the exemplars' order, the local ones a part of them.
  result.from = Eigen::MatrixXd::Zero(all, local.value[0].rows());
  result.from.topRows(own) = local_images.matrix;
  const Eigen::Index block = local.value[0].rows() / static_cast<Eigen::Index>(local.points.size());
  for (std::size_t l = 0, w = 0; l < local.points.size(); ++l, ++w) {
    while (wide.points[w] != local.points[l]) ++w;
    result.from.block(own, block * static_cast<Eigen::Index>(l), own, block) =
        turned.middleCols(block * static_cast<Eigen::Index>(w), block);
  }
  return result;
}

// Products of what is left of the target by two halves, pixel by pixel and channel with channel: the noise of the
// halves has no part in it.
Eigen::MatrixXd residual_covariance(const WhiteTarget& target, const std::array<Eigen::VectorXf, 2>& model,
                                    bool exposure, double unknowns) {
  double scale = 1;
  if (exposure) {
    const double both = static_cast<double>(model[0].dot(model[1]));
    const double own = static_cast<double>((model[0] + model[1]).dot(target.value)) / 2;
    scale = both > 0 && own > 0 ? own / both : 1;
  }
  const Eigen::Index channels = target.channels;
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(channels, channels);
  double count = 0;
  for (Eigen::Index i = 0; i < target.value.size(); i += channels) {
    // Where the target has next to no noise, as behind the object, what is left says nothing of how large its noise is.
    if (target.weight[i] == 0 || !target.is_noisy[static_cast<std::size_t>(i / channels)]) continue;
    const Eigen::VectorXd a =
        (target.value.segment(i, channels) - static_cast<float>(scale) * model[0].segment(i, channels)).cast<double>();
    const Eigen::VectorXd b =
        (target.value.segment(i, channels) - static_cast<float>(scale) * model[1].segment(i, channels)).cast<double>();
    sum += (a * b.transpose() + b * a.transpose()) / 2;
    ++count;
  }
  // Of few pixels materials explain much of what is left, and what the noise is said to be counts as some pixels do.
  constexpr double as_said = 10;
  sum.diagonal().array() += as_said;
  sum /= as_said + std::max(0.0, count - unknowns / static_cast<double>(channels));
  // Of few pixels or great noise it may come out as no covariance.
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(sum);
  const Eigen::VectorXd values = eigen.eigenvalues().cwiseMax(least_residual(target) * 0.1);
  return eigen.eigenvectors() * values.asDiagonal() * eigen.eigenvectors().transpose();
}

Eigen::MatrixXd noise_of_sums(const Rows& weights, const Eigen::MatrixXd& of_pixel) {
  const Eigen::Index channels = of_pixel.rows();
  if (channels == 1) return of_pixel(0, 0) * gram(weights, weights);
  Rows mixed(weights.rows(), weights.cols());
  const Eigen::MatrixXf mix = of_pixel.cast<float>();
  for (Eigen::Index i = 0; i < weights.cols(); i += channels)
    mixed.middleCols(i, channels) = weights.middleCols(i, channels) * mix;
  return gram(weights, mixed);
}

// Variances of the sums of each row of a stack. Channels of a pixel come from the same paths: the greater of what they
// have independently and all alike.
Eigen::MatrixXd errors_of_sums(const Rows& errors, const Rows& weights, Eigen::Index channels) {
  Eigen::MatrixXd alone = gram(errors.cwiseAbs2(), weights.cwiseAbs2());
  if (channels == 1) return alone;
  Eigen::MatrixXd together = Eigen::MatrixXd::Zero(alone.rows(), alone.cols());
  for (Eigen::Index m = 0; m < errors.rows(); ++m)
    for (Eigen::Index k = 0; k < weights.rows(); ++k) {
      double sum = 0;
      for (Eigen::Index i = 0; i < weights.cols(); i += channels) {
        const float part = errors.row(m).segment(i, channels).dot(weights.row(k).segment(i, channels));
        sum += static_cast<double>(part) * static_cast<double>(part);
      }
      together(m, k) = sum;
    }
  return alone.cwiseMax(together);
}

// Of the errors of several numbers, as the exemplars show them; of few exemplars less than that.
Eigen::MatrixXd correlation_of(const std::vector<PolynomialFit>& fits) {
  const auto count = static_cast<Eigen::Index>(fits.size());
  Eigen::MatrixXd errors(fits.front().left_out().size(), count);
  for (Eigen::Index k = 0; k < count; ++k) errors.col(k) = fits[static_cast<std::size_t>(k)].left_out();
  const Eigen::MatrixXd products = product(errors.transpose(), errors);
  const Eigen::VectorXd norm = products.diagonal().cwiseSqrt().cwiseMax(1e-30).cwiseInverse();
  const double seen = static_cast<double>(errors.rows()) / static_cast<double>(errors.rows() + count);
  Eigen::MatrixXd correlation = seen * Eigen::MatrixXd(norm.asDiagonal() * products * norm.asDiagonal());
  correlation.diagonal().setOnes();
  return correlation;
}

// 1 where a variance is more than next to none, else 0.
std::vector<double> are_noisy(const std::vector<double>& variance) {
  double mean = 0;
  for (const double v : variance) mean += v / static_cast<double>(variance.size());
  std::vector<double> result;
  for (const double v : variance) result.push_back(v > least_variance * mean ? 1 : 0);
  return result;
}

}  // namespace

WhiteTarget white_target(const TargetImage& target, const std::vector<const ExemplarView*>& exemplars,
                         const TargetNoise& noise) {
  WhiteTarget result{target.width, target.height, target.channels, {}, {}, {}, {}};
  result.noise_known = noise.known;
  const auto size = target.value.size(), channels = static_cast<std::size_t>(target.channels);
  const auto smooth_image = [&](const std::vector<double>& image, int radius, Centre centre) {
    return smoothed(image, target.width, target.height, target.channels, radius, centre);
  };
  // Pixels with noise are smoothed among themselves: at the edge of what is seen it is as large as inside.
  const auto smooth_variance = [&](const std::vector<double>& image, int radius, Centre centre) {
    const std::vector<double> noisy = are_noisy(image);
    std::vector<double> smooth = smooth_image(image, radius, centre);
    const std::vector<double> share = smooth_image(noisy, radius, centre);
    for (std::size_t i = 0; i < size; ++i)
      if (noisy[i] > 0 && share[i] > 0) smooth[i] /= share[i];
    return smooth;
  };
  std::vector<double> variance(size, 0), radiance(target.value.begin(), target.value.end());
  radiance = smooth_image(radiance, 1, Centre::out);
  if (!target.error.empty()) {
    for (std::size_t i = 0; i < size; ++i) variance[i] = std::pow(static_cast<double>(target.error[i]), 2);
    if (exemplars.empty()) {
      variance = smooth_variance(variance, 2, Centre::out);
    } else {
      std::vector<double> sample(size, 0);
      for (const ExemplarView* view : exemplars)
        for (const HalfImages& half : view->half)
          for (std::size_t i = 0; i < size; ++i)
            sample[i] += view->spp * std::pow(static_cast<double>(half.error(0, static_cast<Eigen::Index>(i))), 2);
      const std::vector<double> noisy = are_noisy(variance);
      sample = smooth_variance(sample, 1, Centre::in);
      double wanted = 0, have = 0;
      for (std::size_t i = 0; i < size; ++i) {
        if (target.weight[i / channels] == 0 || noisy[i] == 0) continue;
        wanted += static_cast<double>(target.error[i]);
        have += std::sqrt(sample[i]);
      }
      const double scale = have > 0 ? wanted * wanted / (have * have) : 0;
      for (std::size_t i = 0; i < size; ++i) variance[i] = scale * sample[i];
    }
  }
  double mean = 0;
  std::vector<double> own(size, 0);  // of the pixel alone
  for (std::size_t i = 0; i < size; ++i) {
    double given = std::pow(noise.relative * radiance[i], 2);
    if (!target.noise.empty()) given += std::pow(static_cast<double>(target.noise[i]), 2);
    own[i] = given + (target.error.empty() ? 0 : std::pow(static_cast<double>(target.error[i]), 2));
    variance[i] += given;
    mean += variance[i] / static_cast<double>(size);
  }
  if (!(mean > 0)) throw ResultError("the targets have no noise at all: say what they have (noise)");
  const auto count = static_cast<Eigen::Index>(size);
  result.value.resize(count);
  result.weight.resize(count);
  result.deviation.resize(count);
  for (std::size_t i = 0; i < size; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const double weight = target.weight[i / channels];
    result.deviation[k] = std::sqrt(std::max(variance[i], least_variance * mean));
    result.weight[k] = static_cast<float>(std::sqrt(weight) / result.deviation[k]);
    result.value[k] = weight > 0 ? target.value[i] * result.weight[k] : 0.0F;
  }
  const std::vector<double> noisy = are_noisy(own);
  result.is_noisy.assign(size / channels, true);
  for (std::size_t i = 0; i < size; ++i)
    if (noisy[i] == 0) result.is_noisy[i / channels] = false;
  return result;
}

EmulatedView::EmulatedView(const std::vector<Exemplar>& exemplars, std::size_t view, const WhiteTarget& target,
                           const Regions& regions, const Polynomials& polynomials, bool exposure)
    : exposure_(exposure) {
  const Stack local(exemplars, inside(exemplars, regions.local), view, target);
  const bool first = regions.best.size() == 0;  // the local images are as wide then
  const FittedImages local_images(regions.local, local, first ? wide_degree : local_degree);
  const Eigen::MatrixXd spread = spread_of(local_images.polynomials, regions.samples, exposure);
  const DesignRows design(polynomials, local.points);

  Eigen::MatrixXd of_pixel = Eigen::MatrixXd::Identity(target.channels, target.channels);
  if (!first) {
    Eigen::VectorXd values;
    local_images.polynomials.evaluate(regions.best, values);
    const Rows at_best = values.transpose().cast<float>();
    std::array<Eigen::VectorXf, 2> model;
    for (std::size_t h = 0; h < 2; ++h)
      model[h] = image_product(at_best, local_images.coefficients[h]).row(0).transpose();
    of_pixel = residual_covariance(target, model, exposure, static_cast<double>(regions.best.size()));
    residual_ = of_pixel.trace() / target.channels;
    if (residual_ < least_residual(target)) of_pixel *= least_residual(target) / residual_;
  }

  const bool few = are_few(target);
  Candidates candidates;
  if (first && !few) candidates = {local_images.coefficients, local_images.matrix};
  if (!first && !few) {
    const Stack wide(exemplars, inside(exemplars, regions.wide), view, target);
    candidates = candidate_images(wide, local_images, local, regions);
  }
  for (std::size_t h = 0; h < 2; ++h) {
    const Rows& images = local_images.coefficients[h];
    Sums sums;
    if (few) {
      sums = each_value(target, images, spread);
    } else {
      for (const int radius : radii) {
        Sums found = best_sums(candidates.images[h], images, spread, target, radius, candidates.from,
                               local_images.matrix, local.error[h], regions.local.centre.size() + (exposure ? 1 : 0));
        if (sums.weights.rows() == 0 || found.told > sums.told) sums = std::move(found);
      }
    }
    Half& half = halves_[h];
    // Combined once more, so that the target's noise is of variance 1 in each and independent.
    const Eigen::LLT<Eigen::MatrixXd> noise(noise_of_sums(sums.weights, of_pixel));
    const Eigen::MatrixXd to_unit =
        noise.matrixL().solve(Eigen::MatrixXd::Identity(sums.moves.size(), sums.moves.size()));
    const Rows weights = image_product(to_unit.cast<float>(), sums.weights);
    half.target = (weights * target.value).cast<double>();
    half.moves = sums.moves;
    const Eigen::MatrixXd values = gram(local.value[1 - h], weights);
    const Eigen::MatrixXd errors = errors_of_sums(local.error[1 - h], weights, target.channels);
    std::vector<PolynomialFit> fits;
    for (Eigen::Index k = 0; k < values.cols(); ++k)
      fits.emplace_back(polynomials, design, values.col(k), errors.col(k).cwiseMax(1e-12));
    fit(half, fits, polynomials, regions);
  }
}

void EmulatedView::fit(Half& half, const std::vector<PolynomialFit>& fits, const Polynomials& polynomials,
                       const Regions& regions) const {
  const auto count = static_cast<Eigen::Index>(fits.size());
  half.mean.resize(count, polynomials.size());
  for (Eigen::Index k = 0; k < count; ++k) {
    half.mean.row(k) = fits[static_cast<std::size_t>(k)].coefficients().transpose();
    half.leave_one_out += fits[static_cast<std::size_t>(k)].leave_one_out();
  }
  half.correlation = correlation_of(fits);
  // The variance takes a product of matrices at each point: often asked for, so looked up instead.
  const Eigen::Index dimensions = polynomials.frame().centre.size();
  const Polynomials low(polynomials.frame(), Polynomials::degree_for(dimensions, most_images));
  const Eigen::Index terms = std::min(low.size(), polynomials.size()), even = 3 * terms;
  const Eigen::Index step = std::max<Eigen::Index>(1, regions.samples.cols() / (2 * terms));
  std::vector<Eigen::VectorXd> points;
  for (Eigen::Index i = 0; i < 20 * even && static_cast<Eigen::Index>(points.size()) < even; ++i) {
    const Eigen::VectorXd t =
        polynomials.frame().centre + polynomials.frame().axes * low_discrepancy_point(dimensions, static_cast<int>(i));
    if (t.cwiseAbs().maxCoeff() <= 1) points.push_back(t);
  }
  for (Eigen::Index s = 0; s < regions.samples.cols(); s += step) points.emplace_back(regions.samples.col(s));
  Eigen::MatrixXd basis(static_cast<Eigen::Index>(points.size()), terms), logs(basis.rows(), count);
  double sum = 0, all = 0;
  for (Eigen::Index i = 0; i < basis.rows(); ++i) {
    const DesignPoint at(polynomials, points[static_cast<std::size_t>(i)]);
    basis.row(i) = at.values.head(terms).transpose();
    for (Eigen::Index k = 0; k < count; ++k) {
      const double variance = fits[static_cast<std::size_t>(k)].variance(at);
      logs(i, k) = std::log(variance);
      if (i < even) continue;
      sum += half.moves[k] * variance / (variance + 1);
      all += half.moves[k];
    }
  }
  half.typical_error = all > 0 ? sum / all : 1;
  Eigen::MatrixXd normal = product(basis.transpose(), basis);
  normal.diagonal().array() += 1e-3;
  half.log_variance = Eigen::LLT<Eigen::MatrixXd>(normal).solve(product(basis.transpose(), logs)).transpose();
  half.least = logs.colwise().minCoeff().transpose();
  half.most = logs.colwise().maxCoeff().transpose();
}

struct EmulatedView::Compared {
  double log_determinant = 0;
  double from_target = 0, both = 0, from_model = 0;  // products over the covariance
};

EmulatedView::Compared EmulatedView::compare(const Half& half, const DesignPoint& at) const {
  const Eigen::VectorXd mean = half.mean * at.values;
  const Eigen::VectorXd deviation = (half.log_variance * at.values.head(half.log_variance.cols()) / 2)
                                        .cwiseMin(half.most / 2)
                                        .cwiseMax(half.least / 2)
                                        .array()
                                        .exp();
  Compared result;
  double scale = 1;  // the exposure, which the emulator's error is multiplied by, too
  for (int pass = 0; pass < (exposure_ ? 2 : 1); ++pass) {
    Eigen::MatrixXd covariance = half.correlation;
    covariance.array().colwise() *= scale * deviation.array();
    covariance.array().rowwise() *= scale * deviation.transpose().array();
    covariance.diagonal().array() += 1;
    const Eigen::LLT<Eigen::MatrixXd> root(covariance);
    const Eigen::VectorXd target = root.matrixL().solve(half.target), model = root.matrixL().solve(mean);
    result.from_target = target.squaredNorm();
    result.both = target.dot(model);
    result.from_model = model.squaredNorm();
    result.log_determinant = 2 * root.matrixLLT().diagonal().array().log().sum();
    if (exposure_ && result.both > 0) scale = result.both / result.from_model;
  }
  return result;
}

double EmulatedView::log_likelihood(const DesignPoint& at) const {
  double sum = 0;
  for (const Half& half : halves_) {
    const Compared c = compare(half, at);
    sum -= c.log_determinant;
    if (!exposure_) {
      sum -= c.from_target - 2 * c.both + c.from_model;
      continue;
    }
    const double scale = std::max(1e-30, c.both / c.from_model);
    sum -= c.from_target - 2 * scale * c.both + scale * scale * c.from_model;
    sum -= std::log(c.from_model) + 2 * std::log(scale);
  }
  return sum / 4;  // a half of each half's
}

EmulatedView::Exposure EmulatedView::exposure(const DesignPoint& at) const {
  double mean = 0, variance = 0;
  for (const Half& half : halves_) {
    const Compared c = compare(half, at);
    mean += c.both / c.from_model / 2;
    variance += 1 / c.from_model / 2;
  }
  return {mean, std::sqrt(variance)};
}

double EmulatedView::emulator_share() const { return (halves_[0].typical_error + halves_[1].typical_error) / 2; }

double EmulatedView::leave_one_out() const {
  const auto sums = static_cast<double>(halves_[0].target.size() + halves_[1].target.size());
  return (halves_[0].leave_one_out + halves_[1].leave_one_out) / sums;
}

}  // namespace itn
