// The radiance that paths are expected to gather, learnt from a pilot: the table of kernels/derivative/baseline.h.
#pragma once
#include <array>
#include <span>
#include <vector>

#include "kernels/shared/baseline_layout.h"

namespace itn {

class BaselineTable {
 public:
  BaselineTable(int cells, int throughput_channels, int radiance_channels);

  // samples: of each path what it gathered, `stride` floats a path of which the first are radiance; visits: of each
  // path, as kernels/derivative/baseline.h writes them.
  void add(const std::vector<float>& samples, int stride, std::span<const float> visits);

  // [cell][throughput channel]: V, the expected radiance of a path of weight 1; 0 where no path came.
  std::vector<float> futures() const;
  // For the radiance channels that share a throughput channel: the radiance gathered in each over their mean, since the
  // last call.
  std::array<float, 3> take_tint();

 private:
  struct Sums {
    double products = 0, squares = 0;  // of weight * what the path then gathered, of weight^2
  };

  std::size_t throughput_channels_, radiance_channels_;
  std::vector<Sums> sums_;  // [cell][throughput channel]
  std::array<double, 3> gathered_{};
};

}  // namespace itn
