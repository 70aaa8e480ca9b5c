// Sums of the samples of a band of pixels on the device, in the order of the samples: the same bits however the samples
// were split into launches, and the image into bands.
#pragma once
#include "itn/device.h"
#include "itn/rendering.h"

namespace itn {

class Film {
 public:
  // Room for that many pixels, or fewer where the device's memory is short.
  // A sample begins with `images` pixels of `channels` channels: radiance, derivatives, other albedos. luminance: sums
  // the luminance of 3 channels instead of each.
  Film(const Device& device, int pixels, int images, int channels, bool luminance);

  int pixels() const { return pixels_; }  // of a band
  int images() const { return images_; }
  int channels() const { return luminance_ ? 1 : channels_; }  // of an image

  // Adds the next samples of pixels [first_pixel, first_pixel + pixels) of the band, which start at first_sample of the
  // buffer, of sample_size floats a sample. fresh: the pixels' first samples, what was there is forgotten.
  void add(const cl::Buffer& samples, int sample_size, std::size_t first_sample, int first_pixel, int pixels,
           int samples_a_pixel, bool fresh);

  // Appends the means and standard errors of the band's first `pixels` pixels to an image each, of which there are as
  // many as a sample holds; with one sample a pixel the standard error is infinite.
  void develop(int spp, int pixels, std::vector<Image>& images);

 private:
  const Device& device_;
  int pixels_, images_, channels_;
  bool luminance_;
  cl::Program program_;
  cl::Buffer sums_;
};

}  // namespace itn
