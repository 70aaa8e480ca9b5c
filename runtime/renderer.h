// The public interface: a scene in, an image with its standard error out.
#pragma once
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "runtime/device/device.h"
#include "runtime/scene/scene.h"

namespace itn {

enum class Operator {
  full,   // all scattering
  single  // paths that scatter exactly once in a medium
};

// How paths are scheduled: never changes what they compute.
enum class Schedule {
  automatic,  // fused on CPUs, staged on GPUs
  fused,      // every work-item runs all stages over a pool of its own
  staged      // one kernel a stage over queues in global memory
};

// Whether derivatives are made quieter, at the same mean (kernels/README.md, "Quiet derivatives").
enum class Baselines {
  automatic,  // where that takes less time than more samples would
  on,
  off
};

struct RenderOptions {
  int sensor = 0;          // index into Scene::sensors
  int spp = 0;             // samples a pixel; 0: the scene's
  std::uint64_t seed = 0;  // images of different seeds are independent
  Operator op = Operator::full;
  // Names of scene parameters: the image is differentiated by each, from the same paths (paper, section 4).
  std::vector<std::string> derivatives;
  Baselines baselines = Baselines::automatic;
  int width = 0;  // paths a work-item: 1, 4, 8, 16; 0: the device's default
  Schedule schedule = Schedule::automatic;
  int paths_a_launch = 0;                     // 0: as many as take about a quarter of a second
  std::function<void(double)> progress;       // called between launches with the fraction done
  const std::atomic<bool>* cancel = nullptr;  // polled between launches; set: render throws Interrupted
  bool time_stages = false;                   // staged only: fills Rendering::stages, waiting for every launch
};

// What all launches of one stage (kernels/README.md) took.
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
  double build_s = 0, render_s = 0;  // scene to device and kernel build; path tracing alone
  std::uint64_t paths = 0;
  // Arrivals at surfaces from the side where the path cannot be: positions off by rounding (a few in 10^9), or shapes
  // that overlap or are not closed, and then the image is wrong.
  std::uint64_t misplaced = 0;
  std::vector<StageTime> stages;  // those that ran
};

// A scene on a device, ready to render its samples in parts.
class Renderer {
 public:
  // Options as for render(), but that spp is not looked at. Throws as render().
  Renderer(const Device& device, const Scene& scene, const RenderOptions& options);
  ~Renderer();
  // Samples first_sample ... first_sample + samples - 1 of every pixel: parts of one seed make up the whole.
  // first_sample >= 0, samples >= 1.
  Rendering render(int first_sample, int samples);
  // From now on renders this scene: the one of before with other values of its parameters (scene/parameters.h), the
  // same shapes, sensors and files. Quick: the geometry stays on the device.
  void replace(const Scene& scene);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// Throws UsageError (no such sensor, spp < 1, a parameter that is unknown or not differentiable), DeviceError,
// Interrupted.
Rendering render(const Device& device, const Scene& scene, const RenderOptions& options);

}  // namespace itn
