// Says how a scene is rendered: plain data, which the rooms below renderer.h read too.
#pragma once
#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace itn {

class Ranks;

enum class Operator {
  full,   // all scattering
  single  // paths that scatter exactly once in a medium
};

// Scheduling of paths: never changes what they compute.
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
  Ranks* ranks = nullptr;                     // share the pixels of every image; all get it whole. null: none to share
  bool time_stages = false;                   // staged only: fills Rendering::stages, waiting for every launch
};

}  // namespace itn
