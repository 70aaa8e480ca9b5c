// From jobs to images: launches of about a quarter of a second, and the sums of their samples.
#pragma once
#include <vector>

#include "runtime/renderer.h"
#include "runtime/wavefront/film.h"
#include "runtime/wavefront/wavefront.h"

namespace itn {

// One of a wavefront's jobs, and the first of its samples that are asked for.
struct TracedJob {
  int job = 0;
  const Sensor* sensor = nullptr;
  int first_sample = 0;
};

// The means over `spp` samples of every pixel of every job, with their standard errors, an image for each of
// options.derivatives, and what they took together. groups, a divisor of spp: as many renderings of each job, one after
// another, of spp / groups samples each; the film has room for at least so many pixels. The sensors agree in
// `luminance`. launch_paths: paths of the first launch; becomes what was found to take a quarter of a second. Throws
// Interrupted, DeviceError: groups for which the samples of a pixel do not fit into a launch.
std::vector<Rendering> trace_images(Wavefront& wavefront, Film& film, const std::vector<TracedJob>& jobs, int spp,
                                    int groups, const RenderOptions& options, std::int64_t& launch_paths);

constexpr std::int64_t first_launch_paths = 1 << 15;

// The width of a hierarchy's nodes that suits the device's vector units.
int box_width(const Device& device);

}  // namespace itn
