#include "itn/renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "itn/error.h"
#include "runtime/base/memory.h"
#include "runtime/base/seconds_since.h"
#include "runtime/render/wavefront/trace_images.h"

namespace itn {
namespace {

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
    if (options.paths_a_launch > 0) launch_paths = options.paths_a_launch;
    require_film_memory(scene.file);
    const auto start = std::chrono::steady_clock::now();
    data.geometry.box_width = box_width(device);
    const JobRecord job = seeded(append_scene(scene, options.sensor, data));
    build(job, derivative_data(scene, options.derivatives, job, data));
    build_s = seconds_since(start);
  }

  // Memory that the host needs for an image: means and standard errors, in vectors that grow to twice their size, and
  // again as the pixels and the bytes of the file.
  void require_film_memory(const std::string& file) const {
    constexpr double copies = 4;
    const double pixels = static_cast<double>(sensor.crop_width) * sensor.crop_height;
    const double values = 2.0 * (sensor.luminance ? 1 : 3) * (1 + static_cast<double>(options.derivatives.size()));
    constexpr double always_allowed = 1 << 28;
    const double bytes = copies * pixels * values * sizeof(float);
    if (bytes > always_allowed)
      require_memory(bytes, fmt::format("{}: a film of {} x {} pixels", file, sensor.crop_width, sensor.crop_height),
                     "make it smaller (size), or render it in parts (crop_width ...)");
  }

  JobRecord seeded(JobRecord job) const {
    job.seed_low = static_cast<unsigned>(options.seed);
    job.seed_high = static_cast<unsigned>(options.seed >> 32);
    return job;
  }

  void build(const JobRecord& job, const DerivativeData& derivatives) {
    wavefront.reset();  // its memory first
    wavefront = std::make_unique<Wavefront>(device, data, std::vector<JobRecord>{job}, derivatives, options.op,
                                            options.width, options.schedule, options.baselines);
    film = std::make_unique<Film>(device, sensor.crop_width * sensor.crop_height,
                                  1 + static_cast<int>(options.derivatives.size()), wavefront->channels(),
                                  sensor.luminance);
    if (options.time_stages) wavefront->time_stages();
  }

  void replace(const Scene& scene) {
    clear_scenes(data);
    const JobRecord job = seeded(append_scene(scene, options.sensor, 0, data));
    const DerivativeData derivatives = derivative_data(scene, options.derivatives, job, data);
    if (!wavefront->replace(data, {job}, derivatives, false)) build(job, derivatives);
  }

  const Device& device;
  RenderOptions options;
  Sensor sensor;
  LaunchData data;
  std::unique_ptr<Wavefront> wavefront;
  std::unique_ptr<Film> film;
  double build_s = 0;
  std::int64_t launch_paths = first_launch_paths(device);
};

Renderer::Renderer(const Device& device, const Scene& scene, const RenderOptions& options)
    : state_(std::make_unique<State>(device, scene, options)) {}
Renderer::~Renderer() = default;

void Renderer::replace(const Scene& scene) { state_->replace(scene); }

void Renderer::reseed(std::uint64_t seed) {
  state_->options.seed = seed;
  state_->wavefront->reseed(seed);
}

Rendering Renderer::render(int first_sample, int spp) {
  State& s = *state_;
  Rendering out =
      trace_images(*s.wavefront, *s.film, {{0, &s.sensor, first_sample}}, spp, 1, s.options, s.launch_paths).front();
  out.build_s = s.build_s;
  return out;
}

Rendering render(const Device& device, const Scene& scene, const RenderOptions& options) {
  const int spp = options.spp > 0 ? options.spp : sensor_of(scene, options.sensor).spp;
  return Renderer(device, scene, options).render(0, spp);
}

}  // namespace itn
