// The speed of renderings and the noise of the images, beside Mitsuba when asked.
#pragma once
#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "itn/device.h"
#include "tools/itn/bench/mitsuba_peer.h"
#include "tools/itn/bench/scenes.h"

namespace itn {

// Several images of one scene, of independent seeds: how long they took and how much they differ. Both renderers are
// measured by this alone, whatever they say about themselves.
class Repeats {
 public:
  void add(double seconds, const std::vector<float>& pixels);

  double seconds() const;  // the median

  // Variance of one sample of a pixel over the squared mean, both summed over pixels and channels first: a mean over
  // pixels weighted by brightness, which is what the error of the image as a whole is made of.
  double relative_variance(int spp) const;

  double image_mean() const;
  // The standard error of image_mean(). Few runs tell little of their own spread: the pixels, which are independent,
  // tell it better.
  double image_mean_stderr() const;

 private:
  std::vector<double> seconds_, mean_, square_, image_means_;
};

struct BenchRow {
  BenchScene scene;
  int spp = 0;
  double paths = 0;  // an image
  Repeats ours;
  std::optional<Repeats> peer;

  double speed_ratio() const;
  double efficiency_ratio() const;  // efficiency is 1 / (variance x time)
  double mean_z() const;
};

struct BenchOptions {
  int runs = 5;  // images of each scene and renderer, 2 or more
  int spp = 0;   // 0: the scene's
  std::uint64_t seed = 0;
  const std::atomic<bool>* cancel = nullptr;
};

// Both renderers take turns, so that whatever else the machine does hits both. The first image of each, which compiles
// kernels, counts for nothing. peer: may be null. Throws Interrupted.
BenchRow measure(const Device& device, MitsubaPeer* peer, const BenchScene& scene, const BenchOptions& options);

struct GeometricMean {
  std::string group;  // empty: all rows
  double speed = 0, efficiency = 0;
};

// Ratios to the peer: of each group of scenes, and of all.
std::vector<GeometricMean> geometric_means(const std::vector<BenchRow>& rows);

}  // namespace itn
