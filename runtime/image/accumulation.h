// Renderings of different samples of one image become one.
#pragma once
#include <vector>

#include "itn/rendering.h"

namespace itn {

class Accumulation {
 public:
  // Adds a part with the same film and derivatives as the parts before.
  void add(const Rendering& part);

  // Mean and standard error of all samples so far, up to rounding as if they had been rendered at once: however many
  // parts there are, one rounding of each value. Of no part: spp 0.
  const Rendering& rendering() const { return sum_; }

 private:
  // Moments of the samples so far. Floats would stop moving where a part's share of the mean is below their last digit.
  struct Moments {
    double mean = 0, squares = 0;  // squares: sum of squared distances from the mean
  };

  void add(Image& sum, const Image& part, std::vector<Moments>& moments, double n, double m) const;

  Rendering sum_;
  std::vector<std::vector<Moments>> moments_;  // of the image and its derivatives, a value each
};

}  // namespace itn
