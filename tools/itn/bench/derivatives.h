// The cost of derivatives, beside the image alone and beside Mitsuba's prbvolpath.
#pragma once
#include <array>
#include <string>

#include "itn/renderer.h"
#include "tools/itn/bench/mitsuba_peer.h"

namespace itn {

// A derivative of the mean over pixels and channels, by sigma_t, albedo (the sum over its components) or g of the
// scene's medium: the mean over the runs, its standard error, and the variance of one run.
struct MeanDerivative {
  double value = 0, stderr_ = 0, variance = 0;
};

struct DerivativeCost {
  double value_s = 0, derivatives_s = 0;  // an image alone; with the three derivatives
  std::array<MeanDerivative, 3> ours;
  double peer_s = 0;  // prbvolpath's value and gradient; 0: no peer
  std::array<MeanDerivative, 3> peer;
};

inline constexpr std::array derivative_names{"sigma_t", "albedo", "g"};

// Medians of `runs` runs after one that does not count. peer: may be null.
DerivativeCost derivative_cost(const Device& device, const Scene& scene, const std::string& file, RenderOptions options,
                               int runs, MitsubaPeer* peer);

}  // namespace itn
