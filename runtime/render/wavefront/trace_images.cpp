#include "runtime/render/wavefront/trace_images.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "itn/error.h"
#include "runtime/base/ranks.h"
#include "runtime/base/sample_index.h"
#include "runtime/base/seconds_since.h"

namespace itn {
namespace {

// Paths of the next launch, from how long the last one's took: about a quarter of a second, at most 4 times as many.
std::int64_t next_target(std::int64_t target, std::int64_t paths, double seconds) {
  const double wanted = 0.25 / std::max(1e-6, seconds) * static_cast<double>(paths);
  return std::clamp<std::int64_t>(static_cast<std::int64_t>(wanted), 1 << 12, 4 * target);
}

// Samples of each pixel in one launch, at most those left: together they walk the hierarchy as one bundle
// (kernels/geometry/trace_coherent.h).
int samples_a_launch(std::int64_t wanted, int left) {
  constexpr std::int64_t bundles = 64;  // a multiple of the lanes of any device, so that none has two pixels
  return static_cast<int>(std::min<std::int64_t>(std::max(bundles, wanted / bundles * bundles), left));
}

int pixels_of(const Sensor& sensor) { return sensor.crop_width * sensor.crop_height; }

// The samples from `sample` on that are left of spp, or up to those of the pilot.
int samples_left(const std::vector<TracedJob>& jobs, int sample, int spp) {
  int left = spp - sample;
  for (const TracedJob& job : jobs)
    if (const int before = Wavefront::pilot_sample - sample - job.first_sample; before > 0)
      left = std::min(left, before);
  return left;
}

// The share of a job's pixels that a rank traces: every n-th pixel, starting at its own rank, so that expensive regions
// are shared evenly.
struct Share {
  int first = 0, step = 1;

  int pixels_of(const Sensor& sensor) const { return (itn::pixels_of(sensor) - first + step - 1) / step; }
};

Share share_of(const Ranks* ranks) {
  if (!ranks) return {};
  return {ranks->rank(), ranks->count()};
}

// The pixels [first, first + count) of the shares of all jobs, one after another.
std::vector<JobSlice> slices_of(const std::vector<TracedJob>& jobs, const Share& share, int first, int count,
                                int sample, int samples) {
  std::vector<JobSlice> slices;
  int start = 0;  // of the job's pixels
  for (const TracedJob& job : jobs) {
    const int pixels = share.pixels_of(*job.sensor);
    const int from = std::max(first, start), to = std::min(first + count, start + pixels);
    if (from < to)
      slices.push_back({job.job, share.first + (from - start) * share.step, to - from, job.first_sample + sample,
                        samples, share.step});
    start += pixels;
  }
  return slices;
}

// From the images of each rank's share to those of all pixels: of each job the first pixel of each share, then the
// second ... values: of a pixel.
std::vector<float> woven(const std::vector<std::vector<float>>& shares, const std::vector<TracedJob>& jobs,
                         std::size_t values) {
  std::vector<float> all;
  std::vector<std::size_t> at(shares.size());
  for (const TracedJob& job : jobs)
    for (int pixel = 0; pixel < pixels_of(*job.sensor); ++pixel) {
      const std::size_t rank = static_cast<std::size_t>(pixel) % shares.size();
      const auto from = shares[rank].begin() + static_cast<std::ptrdiff_t>(at[rank]);
      all.insert(all.end(), from, from + static_cast<std::ptrdiff_t>(values));
      at[rank] += values;
    }
  return all;
}

// Gathers every rank's pixels. values: of a pixel of an image. Returns the counts of wrong paths of all ranks.
PathFaults share_pixels(Ranks& ranks, const std::vector<TracedJob>& jobs, std::size_t values,
                        std::vector<Image>& images, const PathFaults& own) {
  std::vector<float> mine;
  for (const Image& image : images)
    for (const std::vector<float>* part : {&image.mean, &image.stderr_})
      mine.insert(mine.end(), part->begin(), part->end());
  const std::vector<std::string> all = ranks.gather(bytes_of(std::vector{own.misplaced, own.endless}) + bytes_of(mine));
  constexpr std::size_t counts = 2 * sizeof(std::uint64_t);
  PathFaults faults;
  std::vector<std::vector<float>> numbers;
  for (const std::string& one : all) {
    const std::vector<std::uint64_t> theirs = numbers_of<std::uint64_t>(one.substr(0, counts));
    faults.misplaced += theirs[0];
    faults.endless += theirs[1];
    numbers.push_back(numbers_of<float>(one.substr(counts)));
  }
  const std::size_t parts = 2 * images.size();
  for (std::size_t part = 0; part < parts; ++part) {
    std::vector<std::vector<float>> shares;
    for (const std::vector<float>& one : numbers) {
      const auto size = static_cast<std::ptrdiff_t>(one.size() / parts);
      const auto from = one.begin() + static_cast<std::ptrdiff_t>(part) * size;
      shares.emplace_back(from, from + size);
    }
    Image& image = images[part / 2];
    (part % 2 == 0 ? image.mean : image.stderr_) = woven(shares, jobs, values);
  }
  return faults;
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

std::int64_t first_launch_paths(const Device& device) { return device.info().type == "cpu" ? 1 << 15 : 1 << 20; }

int box_width(const Device& device) {
  if (device.info().type != "cpu") return 4;
  return device.info().preferred_width >= 16 ? 16 : 8;
}

std::vector<Rendering> trace_images(Wavefront& wavefront, Film& film, const std::vector<TracedJob>& jobs, int spp,
                                    int groups, const RenderOptions& options, std::int64_t& launch_paths,
                                    TracedLaunches* traced) {
  const Share share = share_of(options.ranks);
  int pixels = 0;
  for (const TracedJob& job : jobs) {
    pixels += share.pixels_of(*job.sensor);
    following_sample(job.first_sample, spp);
  }
  // Bands of pixels, as many as the film holds; in a band runs of pixels, each with all of its samples in turn:
  // launches of about a quarter of a second, so that progress moves and an interruption is seen.
  const std::int64_t total = static_cast<std::int64_t>(pixels) * spp;
  // The film keeps the groups of a pixel as pixels of their own: all of its samples must then come in one launch.
  const auto capacity = static_cast<std::int64_t>(wavefront.sample_capacity());
  const int most_pixels = film.pixels() / groups;
  if (groups > 1 && (spp > capacity || most_pixels == 0))
    throw DeviceError("samples in groups: those of a pixel do not fit into the device's memory; take fewer of them");
  std::int64_t done = 0;
  std::vector<Image> images(static_cast<std::size_t>(film.images()));
  const auto render_start = std::chrono::steady_clock::now();
  for (int first = 0; first < pixels; first += most_pixels) {
    const int band = std::min(most_pixels, pixels - first);
    for (int sample = 0; sample < spp;) {
      launch_paths = std::min(launch_paths, capacity);
      const int samples = groups > 1 ? spp : samples_a_launch(launch_paths / band, samples_left(jobs, sample, spp));
      const int run = static_cast<int>(std::clamp<std::int64_t>(launch_paths / samples, 1, band));
      for (int pixel = 0; pixel < band; pixel += run) {
        if (options.cancel && *options.cancel) throw Interrupted();
        const int count = std::min(run, band - pixel);
        const std::int64_t paths = static_cast<std::int64_t>(count) * samples;
        const auto launch_start = std::chrono::steady_clock::now();
        const std::vector<JobSlice> slices = slices_of(jobs, share, first + pixel, count, sample, samples);
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
  PathFaults faults = wavefront.faults();
  if (options.ranks && !options.ranks->alone()) {
    const auto values = static_cast<std::size_t>(groups * film.channels());
    faults = share_pixels(*options.ranks, jobs, values, images, faults);
  }
  const double seconds = seconds_since(render_start);
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
      out.misplaced = faults.misplaced;
      out.endless = faults.endless;
      out.stages = stages;
      out.channels = job.sensor->luminance ? 1 : 3;
      for (std::size_t i = 0; i < images.size(); ++i) {
        Image image = cut(images[i], start * step + group, step, count, static_cast<std::size_t>(film.channels()));
        if (film.channels() < out.channels) spread_channels(image);
        if (i == 0)
          static_cast<Image&>(out) = std::move(image);
        else
          (i <= options.derivatives.size() ? out.derivatives : out.other_albedos).push_back(std::move(image));
      }
    }
    start += count;
  }
  return renderings;
}

}  // namespace itn
