// Adam (Kingma and Ba 2015) for a few unknowns in double precision, with a step size that falls to 0 as half a cosine
// wave.
#pragma once
#include <vector>

namespace itn {

struct AdamMoments {
  std::vector<double> first, second;  // decaying means of gradient and squared gradient; empty before the first step
};

// Step `iteration` of 0 ... iterations - 1: x moves against the gradient, by about the step size at most.
void adam_step(std::vector<double>& x, const std::vector<double>& gradient, AdamMoments& moments, int iteration,
               int iterations, double learning_rate);

}  // namespace itn
