// Single samples of many scenes from one program, which takes seconds to build: their spread gives standard errors,
// also of differences between scenes that are traced with the same random numbers.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "runtime/render/wavefront/wavefront.h"
#include "transport.h"

namespace itn::test {

// Mean of a stream of numbers and its standard error.
class Moments {
 public:
  void add(double x) {
    // Welford: no cancellation where the spread is small.
    ++count_;
    const double d = x - mean_;
    mean_ += d / count_;
    square_ += d * (x - mean_);
  }
  Estimate estimate() const { return {mean_, std::sqrt(square_ / (count_ * (count_ - 1)))}; }
  double count() const { return count_; }

 private:
  double count_ = 0, mean_ = 0, square_ = 0;
};

// Whether scenes have the shapes of the first, which then are prepared once, or shapes of their own.
enum class Shapes { of_the_first, own };

// Scenes with the same features, channels and differentiated parameters, seen by their first sensors.
class SampledScenes {
 public:
  // derivatives: names of parameters of the first scene; the others are differentiated by the same places. Scenes of
  // the same seed have common random numbers.
  SampledScenes(const std::vector<Scene>& scenes, const std::vector<std::string>& derivatives, Operator op,
                const std::vector<std::uint64_t>& seeds, Shapes shapes)
      : images_(1 + derivatives.size()) {
    LaunchData data;
    data.geometry.box_width = 8;
    std::vector<JobRecord> jobs;
    for (std::size_t i = 0; i < scenes.size(); ++i) {
      jobs.push_back(i > 0 && shapes == Shapes::of_the_first ? append_scene(scenes[i], 0, 0, data)
                                                             : append_scene(scenes[i], 0, data));
      jobs.back().seed_low = static_cast<unsigned>(seeds[i]);
      const Sensor& sensor = scenes[i].sensors[0];
      pixels_.push_back(sensor.crop_width * sensor.crop_height);
    }
    wavefront_.emplace(device(), data, jobs, derivative_data(scenes[0], derivatives, jobs[0], data), op, 0,
                       Schedule::automatic);
  }

  std::size_t channels() const { return static_cast<std::size_t>(wavefront_->channels()); }
  std::size_t images() const { return images_; }
  int pixels(int scene) const { return pixels_[static_cast<std::size_t>(scene)]; }

  // Samples [first, first + count) of every pixel of each scene: [scene][pixel][sample][image][channel]; image 0 is the
  // radiance, then the derivatives in their order.
  std::vector<float> trace(const std::vector<int>& scenes, int first, int count) {
    std::vector<JobSlice> slices;
    std::size_t paths = 0;
    for (const int scene : scenes) {
      slices.push_back({scene, 0, pixels(scene), first, count});
      paths += static_cast<std::size_t>(pixels(scene) * count);
    }
    wavefront_->trace(slices);
    std::vector<float> samples(paths * images_ * channels());
    device().download(wavefront_->samples(), samples);
    return samples;
  }

 private:
  std::size_t images_;
  std::vector<int> pixels_;
  std::optional<Wavefront> wavefront_;
};

}  // namespace itn::test
