// Runs jobs through the stages of kernels/wavefront.cl: device buffers, program, chunks, launches.
#pragma once
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "itn/device.h"
#include "itn/render_options.h"
#include "itn/rendering.h"
#include "runtime/render/compile/derivative_data.h"
#include "runtime/render/compile/launch_data.h"
#include "runtime/render/wavefront/launch_buffers.h"

namespace itn {

// The pixels and samples of a job that one launch traces.
struct JobSlice {
  int job = 0;
  int first_pixel = 0, pixels = 0;
  int first_sample = 0, samples = 0;
  int pixel_step = 1;  // from a pixel to the next
};

// Counts of paths that went wrong: arrivals at surfaces from the side where the path cannot be, and paths that were
// ended though the scene sets no max_depth.
struct PathFaults {
  std::uint64_t misplaced = 0, endless = 0;
};

class Wavefront {
 public:
  // jobs: as append_scene returned them, with their seeds. derivatives: of every job's image; targets count within the
  // job's scene. With baselines (derivative/baseline.h) the first trace() learns what they take. adjoint: replay()
  // takes the place of derivative images; derivatives: those by the light alone, with the unit of their sums in factor.
  Wavefront(const Device& device, const LaunchData& data, std::vector<JobRecord> jobs,
            const DerivativeData& derivatives, Operator op, int width, Schedule schedule,
            Baselines baselines = Baselines::automatic, bool adjoint = false);

  // Other jobs in place of all, of the geometries that `data` had before or, with new_geometry, of those it has now.
  // False, and nothing is changed, where they need another program. The next trace() learns baselines anew.
  bool replace(const LaunchData& data, std::vector<JobRecord> jobs, const DerivativeData& derivatives,
               bool new_geometry);
  // The random numbers of another seed in all jobs. The next trace() learns baselines anew: its pilot has them, too.
  void reseed(std::uint64_t seed);

  int channels() const { return channels_; }                        // of radiance: 1 or 3
  int throughput_channels() const { return throughput_channels_; }  // 1 or 3
  std::size_t sample_capacity() const { return sample_capacity_; }  // most samples a launch can hold

  // Samples from this one on have other random numbers than the pilot of baselines: no slice has some on both sides.
  static constexpr int pilot_sample = 1 << 30;

  // Traces the slices into samples(): slice after slice, pixel after pixel, sample after sample; of a sample the
  // channels of the radiance, then those of each derivative. Returns when done. They begin at sample `at` of the buffer
  // and end before sample_capacity().
  void trace(const std::vector<JobSlice>& slices, std::size_t at = 0);
  const cl::Buffer& samples() const { return buffers_.samples; }
  int sample_size() const { return floats_a_sample_; }  // floats; with `adjoint`, what replay() needs comes last

  // With `adjoint`: the next gradient starts from 0, and has so many contrasts beside it: sums over the same numbers
  // with other adjoints, but not by texels and voxels.
  void begin_gradient(int contrasts);
  // Traces slices again whose samples are as trace(slices, at) left them, and adds to the gradient of every number of
  // the launch (derivative/adjoint.h), or to one of the contrasts. pulls: the adjoints of each pixel of each slice,
  // channels() of them. By voxels: probes are traced, too (scattering/probe.h).
  void replay(const std::vector<JobSlice>& slices, const std::vector<float>& pulls, std::size_t at, int contrast = -1);
  // [set][number], and of each set a last one: of the first set how many products were lost, the integers being too
  // small. The first GRADIENT_SETS sets add up to the gradient, contrast_sets() of each contrast follow. Goes on from
  // 0.
  std::vector<std::int64_t> take_gradient();
  std::size_t contrast_sets() const { return static_cast<std::size_t>(contrast_sets_); }
  // Hands `use` the part of the gradient by texels, [texel][channel] of the textures and grids in `derivatives`; to be
  // called before the gradient is taken. They may be many: `use` sees them where they are, if the device's memory is
  // the host's.
  // texel_channels(): those of the radiance, or three where some texels are directions.
  void look_at_texel_gradient(const std::function<void(const std::int64_t* sums)>& use) const;
  std::size_t texel_sums() const { return texels_; }  // how many that are
  int texel_channels() const { return texel_channels_; }

  // From now on trace() of the staged schedule waits for every launch and counts its time to its stage.
  void time_stages() { timed_ = true; }
  std::vector<StageTime> stage_times() const;

  const PathFaults& faults() const { return faults_; }  // so far

 private:
  void upload_records(const LaunchData& data, const DerivativeData& derivatives);
  enum class Purpose { samples, pilot, replay, probes };
  void trace_jobs(const std::vector<JobSlice>& slices, Purpose purpose, std::size_t at = 0, int probe = 0);
  void learn_baselines();
  void clear_gradient();
  std::size_t sets() const { return GRADIENT_SETS + static_cast<std::size_t>(contrasts_ * contrast_sets_); }
  void count_faults();
  std::size_t copies_of_texels() const { return own_texels_ ? static_cast<std::size_t>(workers_) : 1; }
  void trace_fused(const std::vector<ChunkRecord>& chunks);
  void trace_staged(const std::vector<ChunkRecord>& chunks, int paths);

  const Device& device_;
  std::vector<JobRecord> jobs_;
  std::vector<int> pixels_;                                    // of each camera's film
  int cells_ = 0, throughput_channels_, floats_a_sample_ = 0;  // floats_a_sample_: floats of a sample
  bool fused_, learnt_ = false, timed_ = false;
  Baselines baselines_;
  bool adjoint_;
  std::size_t numbers_ = 0;  // of a set of gradients, a channel each
  std::size_t texels_ = 0;   // of textures that are differentiated by, a channel each
  bool by_voxels_ = false;   // are grids differentiated by?
  bool has_probes_ = false;  // do their voxels need probes?
  bool own_texels_ = false;  // has every work-item sums of its own of them?
  bool summing_ = false;     // are there sums since the gradient was taken?
  int contrasts_ = 0, sets_of_contrasts_ = 0, contrast_sets_ = 0;  // of the gradient; of all; of each
  int contrast_ = -1;                                              // of the replay; -1: none
  cl::Buffer gradient_alone_, with_contrasts_;                     // sums of a gradient
  int texel_channels_ = 1;
  int width_, channels_, workers_, slots_;
  std::size_t sample_capacity_;
  PathFaults faults_;
  std::map<std::string, std::string> features_;  // what the program was made for
  LaunchBuffers buffers_;
  cl::Buffer storage_, counter_;  // of the pool: path state, and its queues' lengths
  cl::Program program_;
  std::vector<std::string> stages_;     // a queue each; the free queue's stage is generate
  std::vector<StageTime> stage_times_;  // of these
};

}  // namespace itn
