// The cost of the gradient by every texel of a texture or voxel of a grid, beside Mitsuba's prb and prbvolpath.
#pragma once
#include <string>

#include "itn/renderer.h"
#include "tools/itn/bench/mitsuba_peer.h"

namespace itn {

// A gradient of the image's mean over pixels and channels by the texels of a texture, or the voxels of a grid.
struct TexelGradient {
  double seconds = 0;  // with the image itself
  // Value times gradient, summed over the texels, which is the derivative by a factor on them all: the mean of the runs
  // and its standard error.
  double sum = 0, stderr_ = 0;
  // The variance of one run, summed over the texels but those of 0: where a grid is empty, Mitsuba's derivative lacks
  // the light that a little of the medium would scatter, so that the noise of the two is not that of the same number.
  double variance = 0;
};

struct TextureGradientCost {
  double value_s = 0;        // an image alone
  TexelGradient ours, peer;  // peer.seconds is 0: no peer
};

// Medians of `runs` runs, 2 or more, after one that does not count. peer: may be null.
TextureGradientCost texture_gradient_cost(const Device& device, const Scene& scene, const std::string& file,
                                          const std::string& texture, RenderOptions options, int runs,
                                          MitsubaPeer* peer);

}  // namespace itn
