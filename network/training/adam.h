// Adam (Kingma and Ba 2015, algorithm 1), with PyTorch's defaults, and decoupled weight decay (AdamW: Loshchilov and
// Hutter 2019, algorithm 2).
#pragma once
#include <cstdint>
#include <vector>

#include "itn/tensor.h"

namespace itn {

struct AdamOptions {
  double beta1 = 0.9, beta2 = 0.999, epsilon = 1e-8;
  double weight_decay = 0;  // a step takes this times the learning rate, as a share, off each weight but the biases
};

class Adam {
 public:
  explicit Adam(const std::vector<Tensor>& weights, AdamOptions options = {});

  // One step of every weight against its gradient, which is laid out as the weights.
  void step(std::vector<Tensor>& weights, const std::vector<Tensor>& gradients, double learning_rate);

  // All that steps leave behind, for checkpoints.
  struct State {
    std::vector<Tensor> mean, mean_square;  // decaying means of gradient and squared gradient, before bias correction
    std::uint64_t steps = 0;
  };
  const State& state() const { return state_; }
  State& state() { return state_; }

 private:
  AdamOptions options_;
  State state_;
};

// Half a cosine wave from `first` at step 0 down to `last` at step `steps` and after it (Loshchilov and Hutter 2017),
// in the first tenth of the steps times a factor that rises to 1: Adam's first steps know no gradients' sizes yet,
// and whole ones would undo much of what a network that is trained further has learnt.
double scheduled_learning_rate(double first, double last, std::uint64_t step, std::uint64_t steps);

}  // namespace itn
