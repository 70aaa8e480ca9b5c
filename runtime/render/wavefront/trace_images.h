// From jobs to images: launches of about a quarter of a second, and the sums of their samples.
#pragma once
#include <vector>

#include "itn/rendering.h"
#include "runtime/render/wavefront/film.h"
#include "runtime/render/wavefront/wavefront.h"

namespace itn {

// One of a wavefront's jobs, and the first of its samples that are asked for.
struct TracedJob {
  int job = 0;
  const Sensor* sensor = nullptr;
  int first_sample = 0;
};

// The slices of one launch, and where its samples begin in the wavefront's buffer.
struct TracedLaunch {
  std::vector<JobSlice> slices;
  std::size_t first_sample = 0;
};

// The launches of images so far, whose samples stay in the buffer side by side if `keep`; there must be room.
struct TracedLaunches {
  bool keep = false;
  std::size_t samples = 0;  // in the buffer
  std::vector<TracedLaunch> launches;
};

// The means over `spp` samples of every pixel of every job, with their standard errors, an image for each of
// options.derivatives and for each other albedo, and what they took together. groups, a divisor of spp: as many
// renderings of each job, one after another, of spp / groups samples each; the film has room for at least so many
// pixels. The sensors agree in `luminance`. launch_paths: paths of the first launch; becomes what was found to take a
// quarter of a second. traced: is told the launches. Throws Interrupted, DeviceError: groups for which the samples of a
// pixel do not fit into a launch.
std::vector<Rendering> trace_images(Wavefront& wavefront, Film& film, const std::vector<TracedJob>& jobs, int spp,
                                    int groups, const RenderOptions& options, std::int64_t& launch_paths,
                                    TracedLaunches* traced = nullptr);

// Number of paths of the first launch, when nothing is known yet of how long paths take.
std::int64_t first_launch_paths(const Device& device);

// The width of a hierarchy's nodes that suits the device's vector units.
int box_width(const Device& device);

}  // namespace itn
