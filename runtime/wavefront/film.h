// Sums of an image's samples on the device, in the order of the samples: the same bits however the samples were split
// into launches.
#pragma once
#include "runtime/renderer.h"

namespace itn {

class Film {
 public:
  // channels: of the samples. luminance: sums the luminance of 3 channels instead of each.
  Film(const Device& device, int pixels, int channels, bool luminance);

  // Adds the next samples of pixels [first_pixel, first_pixel + pixels), which start at first_sample of the buffer.
  void add(const cl::Buffer& samples, std::size_t first_sample, int first_pixel, int pixels, int samples_a_pixel);

  int channels() const { return luminance_ ? 1 : channels_; }

  // Fills mean, stderr_, mean_of_image and stderr_of_mean; with one sample a pixel the standard error is infinite.
  void develop(int spp, Rendering& rendering) const;

 private:
  const Device& device_;
  int pixels_, channels_;
  bool luminance_;
  cl::Program program_;
  cl::Buffer sums_;
};

}  // namespace itn
