// What paths are expected to gather, learnt from a pilot: the table of kernels/lib/baseline.h.
#pragma once
#include <Eigen/Core>
#include <array>
#include <vector>

#include "kernels/shared/baseline_layout.h"

namespace itn {

class BaselineTable {
 public:
  BaselineTable(int cells, int throughput_channels, int radiance_channels);

  // samples: of each path what it gathered, `stride` floats a path of which the first are radiance; visits: of each path,
  // as kernels/lib/baseline.h writes them.
  void add(const std::vector<float>& samples, int stride, const std::vector<float>& visits);

  // [cell][throughput channel][V, A_i]: least squares of what paths of weight 1 gathered over the outcomes.
  std::vector<float> futures() const;
  // Of the radiance channels that share a throughput channel: what each gathered over what they gathered on average, since
  // the last call.
  std::array<float, 3> take_tint();

 private:
  using Numbers = Eigen::Matrix<double, BASELINE_NUMBERS, 1>;
  struct Sums {
    Eigen::Matrix<double, BASELINE_NUMBERS, BASELINE_NUMBERS> squares = decltype(squares)::Zero();
    Numbers products = Numbers::Zero();
  };

  std::size_t throughput_channels_, radiance_channels_;
  std::vector<Sums> sums_;  // [cell][throughput channel]
  std::array<double, 3> gathered_{};
};

}  // namespace itn
