// The images that a scene is compared with, and how noisy they are.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "itn/photo.h"

namespace itn {

struct TargetImage {
  int width = 0, height = 0, channels = 3;  // 1: luminance
  std::vector<float> value;                 // row-major, row 0 on top, channels interleaved
  std::vector<float> weight;                // one a pixel, >= 0
  std::vector<float> error;                 // standard errors, as `value`; empty: not known
  std::vector<float> noise = {};            // the same of a camera: each is taken as it is; empty: none
  std::string note = {};                    // what was done to a photo, for people
};

// Reads the channels R G B of an OpenEXR file, or Y where channels is 1; standard errors: channels stderr.R and so on.
// Other files are photos (include/itn/photo.h): larger ones are averaged down, saturated pixels weigh 0, and alpha
// weighs. mask: an OpenEXR file of the same size whose channel Y, R or else first weighs the pixels, or a picture whose
// grey or red does, 0 to 1, averaged down as photos are; empty: all weigh 1. Throws InputError: another size, channels
// missing, a weight below 0, only weights of 0, NaN or infinite pixels that have a weight, or values that
// image/radiance.h refuses.
TargetImage read_target(const std::string& file, const std::string& mask, int width, int height, int channels,
                        const PhotoOptions& photo = {});

struct TargetNoise {
  double relative = 0;  // standard deviation over the radiance, of all targets, beside what they say of their own
  bool known = true;    // said or given, for each target
  double measured = 0;  // else: median of a pixel's noise over its value; the mean over these targets
};

// Sets the noise of the targets. Without a given relative noise, that of targets without standard errors is measured in
// them (image/noise.h), at least a thousandth of the value, and becomes their standard error. Throws UsageError:
// relative below 0, or not finite.
TargetNoise settle_noise(std::vector<TargetImage>& targets, std::optional<double> relative);

// The consequence of measured noise for intervals, for people.
std::string measured_noise_words();

}  // namespace itn
