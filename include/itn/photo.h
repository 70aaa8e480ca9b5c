// Pictures as cameras write them, as linear values: what the transfer curve hides, which pixels are of no use, and how
// noisy the others are.
#pragma once
#include <string>
#include <vector>

namespace itn {

// From a sample in [0, 1] to a value that is proportional to the radiance.
struct TransferCurve {
  enum class Kind { automatic, srgb, linear, power } kind = Kind::automatic;
  double exponent = 1;  // of power
};

// "auto" (TIFF files of 16 bits are linear, all else is sRGB), "srgb", "linear", or an exponent from 0.2 to 5 such
// as 2.2 (value = sample^2.2). Throws UsageError.
TransferCurve transfer_curve(const std::string& text);

struct PhotoOptions {
  TransferCurve curve;
  double saturation = 0.99;  // samples of so much of the file's largest and more say nothing
  double white = 1;          // value of the file's largest sample
};

struct Photo {
  int width = 0, height = 0, channels = 3;  // 1: grey
  std::vector<float> value;                 // row-major, row 0 on top
  // One a pixel: alpha, 0 where one of the channels is saturated.
  std::vector<float> weight;
  std::vector<float> noise;  // standard deviations, as `value`
  double saturated = 0;      // share of the pixels that alpha leaves
  bool has_alpha = false;
};

// PNG, JPEG, TIFF and the other files of samples.h, rotated as EXIF says. Primaries are taken for those of sRGB. Throws
// InputError.
//
// The noise's variance is that of rounding, a twelfth of a step squared, plus that of counted photons, as estimated
// from the picture (noise.h).
Photo read_photo(const std::string& path, const PhotoOptions& options);

// Averaged over boxes (pixels at a box's edge count by their share in it) to this size, which is not larger and has the
// same shape to half a pixel. A pixel has the smallest weight of those that it is made of: a part of it is not the
// whole. path: for messages. Throws InputError: another shape, or larger.
Photo averaged_down(const Photo& photo, int width, int height, const std::string& path);

// Red, green and blue as luminance.
Photo luminance_of(const Photo& photo);

}  // namespace itn
