#include "runtime/image/accumulation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace itn {
namespace {

// Of n samples the sum of squared distances from their mean, which the standard error of the mean tells.
double squares(double error, double n) { return n > 1 ? error * error * n * (n - 1) : 0; }

// Chan, Golub and LeVeque 1983: of two sets of samples, their means and sums of squares.
template <class Number>
void accumulate(Number& mean, Number& error, double n, Number other_mean, Number other_error, double m) {
  const double way = static_cast<double>(other_mean) - static_cast<double>(mean), all = n + m;
  const double sum =
      squares(static_cast<double>(error), n) + squares(static_cast<double>(other_error), m) + way * way * n * m / all;
  mean = static_cast<Number>(static_cast<double>(mean) + way * m / all);
  error = static_cast<Number>(std::sqrt(sum / (all * (all - 1))));
}

void accumulate(Image& sum, const Image& part, double n, double m) {
  if (sum.mean.size() != part.mean.size()) throw std::logic_error("accumulate: images of different sizes");
  for (std::size_t i = 0; i < sum.mean.size(); ++i)
    accumulate(sum.mean[i], sum.stderr_[i], n, part.mean[i], part.stderr_[i], m);
  // Pixels have independent noise.
  const std::size_t channels = sum.mean_of_image.size();
  const double pixels = static_cast<double>(sum.mean.size()) / static_cast<double>(channels);
  for (std::size_t c = 0; c < channels; ++c) {
    sum.mean_of_image[c] = (n * sum.mean_of_image[c] + m * part.mean_of_image[c]) / (n + m);
    double square = 0;
    for (std::size_t i = c; i < sum.mean.size(); i += channels)
      square += static_cast<double>(sum.stderr_[i]) * static_cast<double>(sum.stderr_[i]);
    sum.stderr_of_mean[c] = std::sqrt(square) / pixels;
  }
}

}  // namespace

void accumulate(Rendering& sum, const Rendering& part) {
  if (sum.spp == 0) {
    sum = part;
    return;
  }
  if (sum.derivatives.size() != part.derivatives.size())
    throw std::logic_error("accumulate: renderings of different derivatives");
  accumulate(static_cast<Image&>(sum), static_cast<const Image&>(part), sum.spp, part.spp);
  for (std::size_t k = 0; k < sum.derivatives.size(); ++k)
    accumulate(sum.derivatives[k], part.derivatives[k], sum.spp, part.spp);
  sum.spp += part.spp;
  sum.render_s += part.render_s;
  sum.paths += part.paths;
  sum.misplaced = std::max(sum.misplaced, part.misplaced);  // a renderer counts over all that it renders
  sum.endless = std::max(sum.endless, part.endless);
}

}  // namespace itn
