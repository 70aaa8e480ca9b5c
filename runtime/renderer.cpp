#include "runtime/renderer.h"

#include <algorithm>
#include <chrono>

#include "runtime/error.h"
#include "runtime/wavefront/film.h"
#include "runtime/wavefront/wavefront.h"

namespace itn {
namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// The node width that suits the device's vector units.
int box_width(const Device& device) {
  if (device.info().type != "cpu") return 4;
  return device.info().preferred_width >= 16 ? 16 : 8;
}

// Paths of the next launch, from how long the last one's took: about a quarter of a second, at most 4 times as many.
std::int64_t next_target(std::int64_t target, std::int64_t paths, double seconds) {
  const double wanted = 0.25 / std::max(1e-6, seconds) * static_cast<double>(paths);
  return std::clamp<std::int64_t>(static_cast<std::int64_t>(wanted), 1 << 12, 4 * target);
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

const Sensor& sensor_of(const Scene& scene, int index) {
  if (index < 0 || index >= static_cast<int>(scene.sensors.size()))
    throw UsageError("sensor " + std::to_string(index) + ": the scene has sensors 0 to " +
                     std::to_string(scene.sensors.size() - 1));
  return scene.sensors[static_cast<std::size_t>(index)];
}

}  // namespace

struct Renderer::State {
  State(const Device& on, const Scene& scene, const RenderOptions& given)
      : device(on), options(given), sensor(sensor_of(scene, given.sensor)) {
    const auto start = std::chrono::steady_clock::now();
    data.geometry.box_width = box_width(device);
    const JobRecord job = seeded(append_scene(scene, options.sensor, data));
    build(job, derivative_data(scene, options.derivatives, job.emitter, data));
    build_s = seconds_since(start);
  }

  JobRecord seeded(JobRecord job) const {
    job.seed_low = static_cast<unsigned>(options.seed);
    job.seed_high = static_cast<unsigned>(options.seed >> 32);
    return job;
  }

  void build(const JobRecord& job, const DerivativeData& derivatives) {
    wavefront.reset();  // its memory first
    wavefront = std::make_unique<Wavefront>(device, data, std::vector<JobRecord>{job}, derivatives, options.op,
                                            options.width, options.schedule);
    film = std::make_unique<Film>(device, sensor.crop_width * sensor.crop_height,
                                  1 + static_cast<int>(options.derivatives.size()), wavefront->channels(),
                                  sensor.luminance);
    if (options.time_stages) wavefront->time_stages();
  }

  void replace(const Scene& scene) {
    const JobRecord job = seeded(replace_scene(scene, options.sensor, data));
    const DerivativeData derivatives = derivative_data(scene, options.derivatives, job.emitter, data);
    if (!wavefront->replace(data, job, derivatives)) build(job, derivatives);
  }

  const Device& device;
  RenderOptions options;
  Sensor sensor;
  LaunchData data;
  std::unique_ptr<Wavefront> wavefront;
  std::unique_ptr<Film> film;
  double build_s = 0;
};

Renderer::Renderer(const Device& device, const Scene& scene, const RenderOptions& options)
    : state_(std::make_unique<State>(device, scene, options)) {}
Renderer::~Renderer() = default;

void Renderer::replace(const Scene& scene) { state_->replace(scene); }

Rendering Renderer::render(int first_sample, int spp) {
  const RenderOptions& options = state_->options;
  const Sensor& sensor = state_->sensor;
  Wavefront& wavefront = *state_->wavefront;
  Film& film = *state_->film;
  const int pixels = sensor.crop_width * sensor.crop_height;
  std::vector<Image> images;

  Rendering out;
  out.width = sensor.crop_width;
  out.height = sensor.crop_height;
  out.spp = spp;
  out.build_s = state_->build_s;

  // Bands of pixels, as many as the film holds; in a band runs of pixels, each with all of its samples in turn:
  // launches of about a quarter of a second, so that progress moves and an interruption is seen.
  const std::int64_t total = static_cast<std::int64_t>(pixels) * spp;
  std::int64_t target = std::min<std::int64_t>(options.paths_a_launch > 0 ? options.paths_a_launch : 1 << 15,
                                               static_cast<std::int64_t>(wavefront.sample_capacity())),
               done = 0;
  const auto render_start = std::chrono::steady_clock::now();
  for (int first = 0; first < pixels; first += film.pixels()) {
    const int band = std::min(film.pixels(), pixels - first);
    for (int sample = 0; sample < spp;) {
      const int samples = static_cast<int>(std::clamp<std::int64_t>(target / band, 1, spp - sample));
      const int run = static_cast<int>(std::clamp<std::int64_t>(target / samples, 1, band));
      for (int pixel = 0; pixel < band; pixel += run) {
        if (options.cancel && *options.cancel) throw Interrupted();
        const int count = std::min(run, band - pixel);
        const auto launch_start = std::chrono::steady_clock::now();
        wavefront.trace({{0, first + pixel, count, first_sample + sample, samples}});
        film.add(wavefront.samples(), 0, pixel, count, samples, sample == 0);
        done += static_cast<std::int64_t>(count) * samples;
        if (options.progress) options.progress(static_cast<double>(done) / static_cast<double>(total));
        if (options.paths_a_launch == 0)
          target = next_target(target, static_cast<std::int64_t>(count) * samples, seconds_since(launch_start));
        target = std::min(target, static_cast<std::int64_t>(wavefront.sample_capacity()));
      }
      sample += samples;
    }
    film.develop(spp, band, images);
  }
  out.render_s = seconds_since(render_start);
  out.paths = static_cast<std::uint64_t>(total);
  out.misplaced = wavefront.misplaced();
  out.stages = wavefront.stage_times();
  film.finish(images);
  out.channels = film.channels();
  if (out.channels == 1 && !sensor.luminance) {
    for (Image& image : images) spread_channels(image);
    out.channels = 3;
  }
  static_cast<Image&>(out) = std::move(images.front());
  out.derivatives.assign(std::move_iterator(images.begin() + 1), std::move_iterator(images.end()));
  return out;
}

Rendering render(const Device& device, const Scene& scene, const RenderOptions& options) {
  const int spp = options.spp > 0 ? options.spp : sensor_of(scene, options.sensor).spp;
  return Renderer(device, scene, options).render(0, spp);
}

}  // namespace itn
