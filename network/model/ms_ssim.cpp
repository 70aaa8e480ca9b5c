#include "network/model/ms_ssim.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "itn/error.h"

namespace itn {
namespace {

constexpr int WINDOW = 11;
constexpr double SIGMA = 1.5;
constexpr std::array PAPER_WEIGHTS{0.0448, 0.2856, 0.3001, 0.2363, 0.1333};

struct Plane {
  int width = 0, height = 0;
  std::vector<double> values;

  Plane(int w, int h) : width(w), height(h), values(static_cast<std::size_t>(w) * static_cast<std::size_t>(h)) {}
  double& at(int x, int y) {
    return values[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
  }
  double at(int x, int y) const {
    return values[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
  }
};

std::array<double, WINDOW> gaussian() {
  std::array<double, WINDOW> weights;
  double sum = 0;
  for (int i = 0; i < WINDOW; ++i) {
    const double distance = i - 0.5 * (WINDOW - 1);
    sum += weights[static_cast<std::size_t>(i)] = std::exp(-distance * distance / (2 * SIGMA * SIGMA));
  }
  for (double& weight : weights) weight /= sum;
  return weights;
}

// Means under the window at every place where it lies inside; rows, then columns.
Plane windowed_mean(const Plane& plane) {
  static const std::array<double, WINDOW> weights = gaussian();
  Plane rows(plane.width - WINDOW + 1, plane.height), result(rows.width, plane.height - WINDOW + 1);
  for (int y = 0; y < rows.height; ++y)
    for (int x = 0; x < rows.width; ++x)
      for (int i = 0; i < WINDOW; ++i) rows.at(x, y) += weights[static_cast<std::size_t>(i)] * plane.at(x + i, y);
  for (int y = 0; y < result.height; ++y)
    for (int x = 0; x < result.width; ++x)
      for (int i = 0; i < WINDOW; ++i) result.at(x, y) += weights[static_cast<std::size_t>(i)] * rows.at(x, y + i);
  return result;
}

Plane product(Plane a, const Plane& b) {
  for (std::size_t i = 0; i < a.values.size(); ++i) a.values[i] *= b.values[i];
  return a;
}

Plane halved(const Plane& plane) {
  Plane half(plane.width / 2, plane.height / 2);
  for (int y = 0; y < half.height; ++y)
    for (int x = 0; x < half.width; ++x)
      half.at(x, y) = (plane.at(2 * x, 2 * y) + plane.at(2 * x + 1, 2 * y) + plane.at(2 * x, 2 * y + 1) +
                       plane.at(2 * x + 1, 2 * y + 1)) /
                      4;
  return half;
}

// Means over the image of contrast times structure, and of that times luminance (Wang et al. 2004, eq. 6, 13).
struct Similarity {
  double structure = 0, all = 0;
};

Similarity similarity(const Plane& a, const Plane& b, double data_range) {
  const double c1 = std::pow(0.01 * data_range, 2), c2 = std::pow(0.03 * data_range, 2);
  const Plane mean_a = windowed_mean(a), mean_b = windowed_mean(b), square_a = windowed_mean(product(a, a)),
              square_b = windowed_mean(product(b, b)), mixed = windowed_mean(product(a, b));
  Similarity result;
  const auto count = static_cast<double>(mixed.values.size());
  for (std::size_t i = 0; i < mixed.values.size(); ++i) {
    const double m_a = mean_a.values[i], m_b = mean_b.values[i];
    const double variances = square_a.values[i] - m_a * m_a + square_b.values[i] - m_b * m_b;
    const double structure = (2 * (mixed.values[i] - m_a * m_b) + c2) / (variances + c2);
    const double luminance = (2 * m_a * m_b + c1) / (m_a * m_a + m_b * m_b + c1);
    result.structure += structure / count;
    result.all += structure * luminance / count;
  }
  return result;
}

}  // namespace

std::vector<double> ms_ssim_weights(int shorter_side) {
  if (shorter_side < WINDOW)
    throw UsageError("MS-SSIM of an image of " + std::to_string(shorter_side) + " pixels: needs " +
                     std::to_string(WINDOW) + " at least");
  std::vector<double> weights;
  double sum = 0;
  for (std::size_t scale = 0; scale < PAPER_WEIGHTS.size() && shorter_side >> scale >= WINDOW; ++scale) {
    weights.push_back(PAPER_WEIGHTS[scale]);
    sum += PAPER_WEIGHTS[scale];
  }
  if (weights.size() < PAPER_WEIGHTS.size())  // the paper's own sum is 1.0001, which everybody keeps
    for (double& weight : weights) weight /= sum;
  return weights;
}

double ms_ssim(std::span<const float> image, std::span<const float> reference, int width, int height,
               double data_range) {
  const std::vector<double> weights = ms_ssim_weights(std::min(width, height));
  Plane a(width, height), b(width, height);
  if (image.size() != a.values.size() || reference.size() != a.values.size())
    throw UsageError("MS-SSIM: the images do not have " + std::to_string(width) + " x " + std::to_string(height) +
                     " pixels");
  if (!(data_range > 0)) throw UsageError("MS-SSIM: the data range must be above 0");
  std::copy(image.begin(), image.end(), a.values.begin());
  std::copy(reference.begin(), reference.end(), b.values.begin());

  double result = 1;
  for (std::size_t scale = 0; scale < weights.size(); ++scale) {
    const bool coarsest = scale + 1 == weights.size();
    const Similarity found = similarity(a, b, data_range);
    result *= std::pow(std::max(0.0, coarsest ? found.all : found.structure), weights[scale]);
    if (coarsest) break;
    a = halved(a);
    b = halved(b);
  }
  return result;
}

}  // namespace itn
