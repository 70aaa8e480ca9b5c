#include "runtime/render/batch_renderer.h"

#include <cstring>

#include "itn/error.h"
#include "itn/parameters.h"
#include "runtime/render/wavefront/trace_images.h"

namespace itn {
namespace {

template <class Record>
bool same(const std::vector<Record>& a, const std::vector<Record>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(Record)) == 0);
}

}  // namespace

struct BatchRenderer::State {
  State(const Device& on, const RenderOptions& given) : device(on), options(given) {
    data.geometry.box_width = box_width(device);
    if (options.baselines == Baselines::automatic) options.baselines = Baselines::off;
    if (options.paths_a_launch > 0) launch_paths = options.paths_a_launch;
  }

  // Takes the derivatives of the first image's scene; those of the other scenes must be the same.
  void add_derivatives(const BatchImage& image, const JobRecord& job, bool first, DerivativeData& result) {
    const Scene& scene = *image.scene;
    const std::vector<Parameter> parameters = list_parameters(scene);
    for (const std::string& name : options.derivatives)
      if (is_of_light(find_parameter(parameters, name)))
        throw UsageError("parameter " + name + ": batches have no derivatives by the light");
    DerivativeData own =
        derivative_data(scene, options.derivatives, job, data, false, static_cast<int>(image.other_albedos.size()));
    if (first)
      result = std::move(own);
    else if (!same(own.scores, result.scores) || !same(own.parts, result.parts) ||
             !same(own.derivatives, result.derivatives) || own.albedos != result.albedos ||
             own.albedo_score != result.albedo_score)
      throw UsageError("derivatives of a batch: its scenes have other media or BSDFs at the parameters' places");
  }

  void prepare(const std::vector<BatchImage>& images, int groups) {
    clear_scenes(data);
    std::vector<JobRecord> jobs;
    std::vector<float> exponents;  // of other albedos, behind the numbers of all scenes
    DerivativeData derivatives;
    int pixels = 0;
    for (std::size_t i = 0; i < images.size(); ++i) {
      const BatchImage& image = images[i];
      const std::vector<float> own = albedo_exponents(*image.scene, image.other_albedos);
      const Sensor& sensor = sensor_of(image);
      if (sensor.luminance != sensor_of(images.front()).luminance)
        throw UsageError("batch: some films are luminance, others colour; render them apart");
      pixels += sensor.crop_width * sensor.crop_height * groups;
      jobs.push_back(append_scene(*image.scene, options.sensor, image.geometry, data));
      add_derivatives(image, jobs.back(), i == 0, derivatives);
      jobs.back().first_exponent = static_cast<int>(exponents.size());
      exponents.insert(exponents.end(), own.begin(), own.end());
      jobs.back().seed_low = static_cast<unsigned>(image.seed);
      jobs.back().seed_high = static_cast<unsigned>(image.seed >> 32);
    }
    for (JobRecord& job : jobs) job.first_exponent += static_cast<int>(data.numbers.size());
    data.numbers.insert(data.numbers.end(), exponents.begin(), exponents.end());
    if (!wavefront || !wavefront->replace(data, jobs, derivatives, new_geometry)) {
      wavefront.reset();  // its memory first
      film.reset();
      wavefront = std::make_unique<Wavefront>(device, data, jobs, derivatives, options.op, options.width,
                                              options.schedule, options.baselines);
      film_pixels = 0;
    }
    new_geometry = false;
    if (pixels <= film_pixels) return;
    film.reset();
    film =
        std::make_unique<Film>(device, pixels, 1 + static_cast<int>(options.derivatives.size()) + derivatives.albedos,
                               wavefront->channels(), sensor_of(images.front()).luminance);
    film_pixels = pixels;
  }

  const Sensor& sensor_of(const BatchImage& image) const {
    return image.scene->sensors.at(static_cast<std::size_t>(options.sensor));
  }

  const Device& device;
  RenderOptions options;
  LaunchData data;
  bool new_geometry = false;
  std::unique_ptr<Wavefront> wavefront;
  std::unique_ptr<Film> film;
  int film_pixels = 0;  // that it was asked for
  std::int64_t launch_paths = first_launch_paths(device);
};

BatchRenderer::BatchRenderer(const Device& device, const RenderOptions& options)
    : state_(std::make_unique<State>(device, options)) {}
BatchRenderer::~BatchRenderer() = default;

Geometry BatchRenderer::geometry_of(const Scene& scene) const {
  Geometry geometry;
  geometry.box_width = state_->data.geometry.box_width;
  append_geometry(scene, geometry);
  return geometry;
}

int BatchRenderer::add_geometry(const Geometry& geometry) {
  append_geometry(geometry, state_->data.geometry);
  state_->new_geometry = true;
  return static_cast<int>(state_->data.geometry.records.size()) - 1;
}

void BatchRenderer::forget_geometries() {
  Geometry empty;
  empty.box_width = state_->data.geometry.box_width;
  state_->data.geometry = std::move(empty);
  state_->new_geometry = true;
}

std::vector<Rendering> BatchRenderer::render(const std::vector<BatchImage>& images, int spp, int groups) {
  if (images.empty()) return {};
  State& s = *state_;
  s.prepare(images, groups);
  std::vector<TracedJob> jobs;
  jobs.reserve(images.size());
  for (const BatchImage& image : images)
    jobs.push_back({static_cast<int>(jobs.size()), &s.sensor_of(image), image.first_sample});
  return trace_images(*s.wavefront, *s.film, jobs, spp, groups, s.options, s.launch_paths);
}

}  // namespace itn
