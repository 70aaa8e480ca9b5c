// A scene on the device whose stages run one at a time over paths given by the test.
#pragma once
#include <array>
#include <map>
#include <string>
#include <vector>

#include "runtime/render/compile/launch_data.h"
#include "runtime/render/wavefront/launch_buffers.h"
#include "runtime/render/wavefront/path_fields.h"
#include "runtime/render/wavefront/wavefront.h"

namespace itn::test {

// The queues that scenes of the tests have; a program has some of them, in an order of its own.
enum class Queue { free, ray, null, diffuse, dielectric, rough_beckmann, rough_ggx, medium, connect, escape };

// One path between two stages: the members of path_state.h.
struct Path {
  Vec3 position{}, direction{0, 0, 1};
  Rgb throughput{1, 1, 1}, radiance{};
  double refraction_scale = 1;
  int pixel = 0, sample = 0, event = 1, depth = 0, medium = -1, skip = -1, passed = 0, hit = -1;
  double hit_u = 0, hit_v = 0, last_pdf = 0;
  int job = 0;
  Rgb spectral_weight{1, 1, 1};
  int hero = 0;
  Vec3 arrival{};
  double chance = 1;
  Vec3 origin{};
  double last_pdf_divisor = 1;
  Queue queue = Queue::free;  // where it waits; free: it has ended
  Rgb sample_radiance{};      // what it gave to its pixel when it ended
};

class PathBench {
 public:
  struct Options {
    Operator op = Operator::full;
    int width = 1;               // unless the environment variable ITN_TEST_WIDTH says another (tools/lab/oclgrind)
    int medium_events = 1;       // a launch of stage medium
    bool light_sampling = true;  // false: light is met by chance alone
    std::uint64_t seed = 1;
  };
  PathBench(const Device& device, const Scene& scene, const Options& options);

  // Paths of pixels 0 ... pixels - 1 with that many samples each, pixel by pixel, made by stage generate.
  std::vector<Path> generate(int pixels, int samples = 1);

  // Runs a stage over the paths that wait for it; the others stay as they are. Members are rounded to float on the way.
  // No two paths of the same pixel and sample.
  void run(Queue stage, std::vector<Path>& paths);

  // Stage after stage until all paths have ended.
  void run_all(std::vector<Path>& paths);

  // The queue where paths wait at surfaces of the BSDF.
  Queue queue_of(const Bsdf& bsdf) const;

  bool has(const char* feature) const { return definitions_.at(feature) != "0"; }
  const LaunchData& data() const { return data_; }
  const JobRecord& job() const { return job_; }
  // Arrivals at surfaces from the wrong side, of all runs.
  std::uint64_t misplaced() const;
  // Numbered as in PrimitiveRecord: where paths that leave the primitive start.
  double offset(int primitive) const {
    return static_cast<double>(data_.geometry.primitives[static_cast<std::size_t>(primitive)].offset);
  }

  // The four random numbers of an event of a path.
  std::array<double, 4> random(const Path& path, unsigned stream, int event_offset = 0) const;

 private:
  cl_uint set_scene(cl::Kernel& kernel, const cl::Buffer& jobs, const cl::Buffer& samples) const;
  std::size_t number_of(Queue queue) const;  // in the program
  void read_queues(const std::vector<float>& storage, const std::vector<int>& lengths, std::size_t stride,
                   std::vector<Path>& paths) const;
  std::vector<float> pack(const std::vector<Path>& paths) const;
  void unpack(const std::vector<float>& fields, std::vector<Path>& paths) const;
  std::size_t stride(std::size_t paths) const { return paths + static_cast<std::size_t>(width_); }

  const Device& device_;
  LaunchData data_;
  JobRecord job_{};
  int width_;
  std::map<std::string, std::string> definitions_;
  std::size_t throughput_channels_, radiance_channels_;
  PathFields fields_;
  std::vector<std::string> stages_;
  std::vector<Queue> queues_;  // of these
  cl::Program program_;
  LaunchBuffers buffers_;
};

}  // namespace itn::test
