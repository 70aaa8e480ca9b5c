#include "runtime/wavefront/trace_images.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "runtime/base/error.h"
#include "runtime/base/seconds_since.h"

namespace itn {
namespace {

// Paths of the next launch, from how long the last one's took: about a quarter of a second, at most 4 times as many.
std::int64_t next_target(std::int64_t target, std::int64_t paths, double seconds) {
  const double wanted = 0.25 / std::max(1e-6, seconds) * static_cast<double>(paths);
  return std::clamp<std::int64_t>(static_cast<std::int64_t>(wanted), 1 << 12, 4 * target);
}

int pixels_of(const Sensor& sensor) { return sensor.crop_width * sensor.crop_height; }

// The pixels [first, first + count) of all jobs, one after another.
std::vector<JobSlice> slices_of(const std::vector<TracedJob>& jobs, int first, int count, int sample, int samples) {
  std::vector<JobSlice> slices;
  int start = 0;  // of the job's pixels
  for (const TracedJob& job : jobs) {
    const int from = std::max(first, start), to = std::min(first + count, start + pixels_of(*job.sensor));
    if (from < to) slices.push_back({job.job, from - start, to - from, job.first_sample + sample, samples});
    start += pixels_of(*job.sensor);
  }
  return slices;
}

// Pixels first, first + step, ...: the part of an image that one job's group of samples is.
Image cut(const Image& all, std::size_t first, std::size_t step, std::size_t count, std::size_t channels) {
  const auto part = [&](const std::vector<float>& values) {
    std::vector<float> result;
    result.reserve(count * channels);
    for (std::size_t i = 0; i < count; ++i) {
      const auto from = values.begin() + static_cast<std::ptrdiff_t>((first + i * step) * channels);
      result.insert(result.end(), from, from + static_cast<std::ptrdiff_t>(channels));
    }
    return result;
  };
  Image image{part(all.mean), part(all.stderr_), std::vector<double>(channels), std::vector<double>(channels)};
  for (std::size_t i = 0; i < image.mean.size(); ++i) {
    const double error = image.stderr_[i];
    image.mean_of_image[i % channels] += image.mean[i];
    image.stderr_of_mean[i % channels] += error * error;
  }
  const auto n = static_cast<double>(count);
  for (double& mean : image.mean_of_image) mean /= n;
  for (double& error : image.stderr_of_mean) error = std::sqrt(error) / n;
  return image;
}

// The values of one channel are those of all three.
void spread_channels(Image& image) {
  const auto spread = [](const auto& in) {
    std::decay_t<decltype(in)> out;
    for (const auto value : in) out.insert(out.end(), 3, value);
    return out;
  };
  image.mean = spread(image.mean);
  image.stderr_ = spread(image.stderr_);
  image.mean_of_image = spread(image.mean_of_image);
  image.stderr_of_mean = spread(image.stderr_of_mean);
}

}  // namespace

int box_width(const Device& device) {
  if (device.info().type != "cpu") return 4;
  return device.info().preferred_width >= 16 ? 16 : 8;
}

std::vector<Rendering> trace_images(Wavefront& wavefront, Film& film, const std::vector<TracedJob>& jobs, int spp,
                                    int groups, const RenderOptions& options, std::int64_t& launch_paths,
                                    TracedLaunches* traced) {
  int pixels = 0;
  for (const TracedJob& job : jobs) pixels += pixels_of(*job.sensor);
  // Bands of pixels, as many as the film holds; in a band runs of pixels, each with all of its samples in turn:
  // launches of about a quarter of a second, so that progress moves and an interruption is seen.
  const std::int64_t total = static_cast<std::int64_t>(pixels) * spp;
  // The film keeps the groups of a pixel as pixels of their own: all of its samples must then come in one launch.
  const auto capacity = static_cast<std::int64_t>(wavefront.sample_capacity());
  const int most_pixels = film.pixels() / groups;
  if (groups > 1 && (spp > capacity || most_pixels == 0))
    throw DeviceError("samples in groups: those of a pixel do not fit into the device's memory; take fewer of them");
  std::int64_t done = 0;
  std::vector<Image> images;
  const auto render_start = std::chrono::steady_clock::now();
  for (int first = 0; first < pixels; first += most_pixels) {
    const int band = std::min(most_pixels, pixels - first);
    for (int sample = 0; sample < spp;) {
      launch_paths = std::min(launch_paths, capacity);
      const int samples =
          groups > 1 ? spp : static_cast<int>(std::clamp<std::int64_t>(launch_paths / band, 1, spp - sample));
      const int run = static_cast<int>(std::clamp<std::int64_t>(launch_paths / samples, 1, band));
      for (int pixel = 0; pixel < band; pixel += run) {
        if (options.cancel && *options.cancel) throw Interrupted();
        const int count = std::min(run, band - pixel);
        const std::int64_t paths = static_cast<std::int64_t>(count) * samples;
        const auto launch_start = std::chrono::steady_clock::now();
        const std::vector<JobSlice> slices = slices_of(jobs, first + pixel, count, sample, samples);
        const std::size_t at = traced && traced->keep ? traced->samples : 0;
        wavefront.trace(slices, at);
        film.add(wavefront.samples(), wavefront.sample_size(), at, pixel * groups, count * groups, samples / groups,
                 sample == 0);
        if (traced) {
          traced->launches.push_back({slices, at});
          traced->samples += static_cast<std::size_t>(paths);
        }
        done += paths;
        if (options.progress) options.progress(static_cast<double>(done) / static_cast<double>(total));
        if (options.paths_a_launch == 0) launch_paths = next_target(launch_paths, paths, seconds_since(launch_start));
      }
      sample += samples;
    }
    film.develop(spp / groups, band * groups, images);
  }
  const double seconds = seconds_since(render_start);
  const std::uint64_t misplaced = wavefront.misplaced();
  const std::vector<StageTime> stages = wavefront.stage_times();

  std::vector<Rendering> renderings;
  std::size_t start = 0;
  for (const TracedJob& job : jobs) {
    const auto count = static_cast<std::size_t>(pixels_of(*job.sensor)), step = static_cast<std::size_t>(groups);
    for (std::size_t group = 0; group < step; ++group) {
      Rendering& out = renderings.emplace_back();
      out.width = job.sensor->crop_width;
      out.height = job.sensor->crop_height;
      out.spp = spp / groups;
      out.render_s = seconds;
      out.paths = static_cast<std::uint64_t>(count) * static_cast<std::uint64_t>(out.spp);
      out.misplaced = misplaced;
      out.stages = stages;
      out.channels = job.sensor->luminance ? 1 : 3;
      for (std::size_t i = 0; i < images.size(); ++i) {
        Image image = cut(images[i], start * step + group, step, count, static_cast<std::size_t>(film.channels()));
        if (film.channels() < out.channels) spread_channels(image);
        if (i == 0)
          static_cast<Image&>(out) = std::move(image);
        else
          out.derivatives.push_back(std::move(image));
      }
    }
    start += count;
  }
  return renderings;
}

}  // namespace itn
