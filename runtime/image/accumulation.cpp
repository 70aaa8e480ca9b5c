#include "runtime/image/accumulation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace itn {

// Chan, Golub and LeVeque 1983: of two sets of n and m samples, their means and sums of squares.
void Accumulation::add(Image& sum, const Image& part, std::vector<Moments>& moments, double n, double m) const {
  if (n > 0 && sum.mean.size() != part.mean.size()) throw std::logic_error("accumulate: images of different sizes");
  const double all = n + m;
  const std::size_t channels = part.mean_of_image.size();
  std::vector<double> square_of(channels);
  if (n == 0) sum = part;
  moments.resize(part.mean.size());
  for (std::size_t i = 0; i < part.mean.size(); ++i) {
    Moments& of = moments[i];
    const auto error = static_cast<double>(part.stderr_[i]);
    const double way = static_cast<double>(part.mean[i]) - of.mean;
    of.squares += (m > 1 ? error * error * m * (m - 1) : 0) + way * way * n * m / all;
    of.mean += way * m / all;
    if (n == 0) continue;  // the part as it is
    sum.mean[i] = static_cast<float>(of.mean);
    const double square = of.squares / (all * (all - 1));
    sum.stderr_[i] = static_cast<float>(std::sqrt(square));
    square_of[i % channels] += square;
  }
  if (n == 0) return;
  // Pixels have independent noise.
  const double pixels = static_cast<double>(part.mean.size()) / static_cast<double>(channels);
  for (std::size_t c = 0; c < channels; ++c) {
    sum.mean_of_image[c] += (part.mean_of_image[c] - sum.mean_of_image[c]) * m / all;
    sum.stderr_of_mean[c] = std::sqrt(square_of[c]) / pixels;
  }
}

void Accumulation::add(const Rendering& part) {
  const double n = sum_.spp, m = part.spp;
  if (sum_.spp == 0) {
    sum_ = part;
    moments_.assign(1 + part.derivatives.size(), {});
  }
  if (sum_.derivatives.size() != part.derivatives.size())
    throw std::logic_error("accumulate: renderings of different derivatives");
  add(sum_, part, moments_[0], n, m);
  for (std::size_t k = 0; k < sum_.derivatives.size(); ++k)
    add(sum_.derivatives[k], part.derivatives[k], moments_[1 + k], n, m);
  if (n == 0) return;
  sum_.spp += part.spp;
  sum_.render_s += part.render_s;
  sum_.paths += part.paths;
  sum_.misplaced = std::max(sum_.misplaced, part.misplaced);  // a renderer counts over all that it renders
  sum_.endless = std::max(sum_.endless, part.endless);
}

}  // namespace itn
