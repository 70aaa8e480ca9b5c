// Common code of the transport tests: one device for the executable, scenes by name, averages with standard errors.
#pragma once
#include <cmath>
#include <map>
#include <string>

#include "itn/device.h"
#include "itn/load_scene.h"
#include "itn/renderer.h"

namespace itn::test {

inline Device& device() {
  static Device shared;
  return shared;
}

// For tests that trace little: a program of one lane, which is what GPUs run, compiles a quarter faster than one of 16,
// which traces two to three times as fast.
inline RenderOptions one_lane() {
  RenderOptions options;
  options.width = 1;
  return options;
}

inline std::string test_scene(const std::string& name) { return ITN_SOURCE_DIR "/scenes/test/" + name; }

using Definitions = std::map<std::string, std::string>;

struct Estimate {
  double value = 0, stderr_ = 0;
};

// Mean over the pixels of a grey image.
inline Estimate image_mean(const Rendering& image) { return {image.mean_of_image[0], image.stderr_of_mean[0]}; }

inline double z_score(const Estimate& estimate, double expected) {
  const double difference = estimate.value - expected;
  // Float sums of equal samples have no spread, but are right to some 1e-6 only.
  const double rounding = 2e-6 * std::abs(expected);
  return difference / std::sqrt(estimate.stderr_ * estimate.stderr_ + rounding * rounding);
}

}  // namespace itn::test
