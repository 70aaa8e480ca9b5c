// An image with its standard error, and all that a rendering gives.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace itn {

// The time that all launches of one stage (kernels/README.md) took.
struct StageTime {
  std::string stage;
  double seconds = 0;
  std::uint64_t launches = 0, paths = 0;  // paths: in the stage's queue, summed over its launches
};

struct Image {
  std::vector<float> mean, stderr_;                   // row-major, row 0 on top, channels interleaved
  std::vector<double> mean_of_image, stderr_of_mean;  // a channel each; over all pixels
};

struct Rendering : Image {
  int width = 0, height = 0, channels = 3;  // channels 1: luminance
  int spp = 0;
  std::vector<Image> derivatives;    // one for each of RenderOptions::derivatives
  std::vector<Image> other_albedos;  // one for each of BatchImage::other_albedos
  double build_s = 0, render_s = 0;  // scene to device and kernel build; path tracing alone
  std::uint64_t paths = 0;
  // Arrivals at surfaces from the side where the path cannot be: positions off by rounding (a few in 10^9), or shapes
  // that overlap or are not closed, and then the image is wrong.
  std::uint64_t misplaced = 0;
  std::uint64_t endless = 0;      // paths that were ended though the scene sets no max_depth
  std::vector<StageTime> stages;  // those that ran
};

}  // namespace itn
