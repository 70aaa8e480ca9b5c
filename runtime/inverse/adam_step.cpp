#include "runtime/inverse/adam_step.h"

#include <cmath>
#include <cstddef>
#include <numbers>

namespace itn {

void adam_step(std::vector<double>& x, const std::vector<double>& gradient, AdamMoments& moments, int iteration,
               int iterations, double learning_rate) {
  constexpr double beta1 = 0.9, beta2 = 0.999, epsilon = 1e-8;
  moments.first.resize(gradient.size());
  moments.second.resize(gradient.size());
  const int t = iteration + 1;
  const double rate = learning_rate / 2 * (1 + std::cos(std::numbers::pi * iteration / iterations));
  for (std::size_t p = 0; p < gradient.size(); ++p) {
    const double g = gradient[p];
    moments.first[p] = beta1 * moments.first[p] + (1 - beta1) * g;
    moments.second[p] = beta2 * moments.second[p] + (1 - beta2) * g * g;
    const double mean = moments.first[p] / (1 - std::pow(beta1, t));
    const double square = moments.second[p] / (1 - std::pow(beta2, t));
    x[p] -= rate * mean / (std::sqrt(square) + epsilon);
  }
}

}  // namespace itn
