#include "runtime/image/halves.h"

#include <cmath>

namespace itn {

Rendering whole_of(const Rendering& a, const Rendering& b) {
  Rendering whole = a;
  whole.spp = a.spp + b.spp;
  const double n = a.spp;
  for (std::size_t k = 0; k < whole.mean.size(); ++k) {
    // Squares about their own means, then about the mean of both.
    const double squares = (n - 1) * n * (std::pow(a.stderr_[k], 2) + std::pow(b.stderr_[k], 2)) +
                           n / 2 * std::pow(a.mean[k] - b.mean[k], 2);
    whole.mean[k] = (a.mean[k] + b.mean[k]) / 2;
    whole.stderr_[k] = static_cast<float>(std::sqrt(squares / (2 * n * (2 * n - 1))));
  }
  return whole;
}

}  // namespace itn
