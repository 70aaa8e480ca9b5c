#include "itn/gradient_renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "itn/colour.h"
#include "itn/error.h"
#include "itn/parameters.h"
#include "kernels/shared/declaration.h"
#include "runtime/base/parallel.h"
#include "runtime/base/ranks.h"
#include "runtime/base/seconds_since.h"
#include "runtime/base/wide_sums.h"
#include "runtime/render/compile/geometry.h"
#include "runtime/render/wavefront/trace_images.h"

namespace itn {
namespace {

// Fixed-point scale of the 63-bit sums: 42 bits lie below the sum of 2^18 paths, which is 24 bits a path, since
// rounding errors of equal paths add up. The host takes the sums after every 2^22 paths: 17 bits are left for large
// derivatives.
constexpr int bits_below_mass = 42, path_bits = 18;
constexpr std::int64_t most_paths = std::int64_t{1} << 22;

// The unit of sums of weight times derivative over so many paths; 0: everything is black or has no weight.
double quantum_of(const std::vector<Rendering>& groups, const std::vector<std::vector<double>>& weights,
                  std::int64_t paths) {
  double mass = 0;
  for (std::size_t g = 0; g < weights.size(); ++g)
    for (std::size_t i = 0; i < weights[g].size(); ++i)
      mass += std::fabs(weights[g][i] * static_cast<double>(groups[g].mean[i]));
  if (mass == 0) return 0;
  const int finer = std::max(0, std::ilogb(static_cast<double>(paths - 1) + 0.5) + 1 - path_bits);
  return std::ldexp(1, std::ilogb(mass) + 1 - bits_below_mass - finer);
}

void add_up(Ranks& ranks, WideSums& sums) {
  add_up(ranks, sums.high());
  add_up(ranks, sums.low());
}

}  // namespace

struct GradientRenderer::State {
  State(const Device& on, const Scene& scene, const RenderOptions& given) : device(on), options(given) {
    const auto index = static_cast<std::size_t>(options.sensor);
    if (options.sensor < 0 || index >= scene.sensors.size())
      throw UsageError("sensor " + std::to_string(options.sensor) + ": the scene has sensors 0 to " +
                       std::to_string(scene.sensors.size() - 1));
    sensor = scene.sensors[index];
    data.geometry.box_width = box_width(device);
    append_geometry(scene, data.geometry);
    JobRecord job;
    const DerivativeData on_device = compile(scene, job);
    build(job, on_device);
    if (options.paths_a_launch > 0) launch_paths = options.paths_a_launch;
  }

  // The program of the scene that is compiled.
  void build(const JobRecord& job, const DerivativeData& on_device) {
    by_light = !on_device.derivatives.empty() || on_device.by_pictures;
    wavefront = std::make_unique<Wavefront>(
        device, data, std::vector<JobRecord>{job}, on_device, options.op, options.width, options.schedule,
        derivatives.scores.empty() && derivatives.grids() == 0 ? Baselines::off : options.baselines, true);
    film = std::make_unique<Film>(device, sensor.crop_width * sensor.crop_height, 1, wavefront->channels(),
                                  sensor.luminance);
  }

  // The scene, whose geometry is there, in place of what there was. Returns what the device needs of its derivatives.
  DerivativeData compile(const Scene& scene, JobRecord& job) {
    clear_scenes(data);
    job = append_scene(scene, options.sensor, 0, data);
    job.seed_low = static_cast<unsigned>(options.seed);
    job.seed_high = static_cast<unsigned>(options.seed >> 32);
    derivatives = derivative_data(scene, options.derivatives, job, data, true);
    DerivativeData on_device;  // paths carry nothing
    on_device.functions = derivatives.functions;
    on_device.numbers = derivatives.numbers;
    on_device.textures = derivatives.textures;
    on_device.by_directions = derivatives.by_directions;
    on_device.by_pictures = derivatives.by_pictures;
    on_device.by_environment = derivatives.by_environment;
    const std::vector<Parameter> all = list_parameters(scene);
    for (std::size_t p = 0; p < derivatives.parts.size(); ++p) {
      DerivativeRecord& record = derivatives.derivatives[p];
      if (!is_of_light(record)) continue;
      const std::string& name = options.derivatives[static_cast<std::size_t>(derivatives.parts[p].image)];
      const auto value = static_cast<float>(find_parameter(all, name).value);
      std::fill_n(record.factor, 3, value > 0 ? value : 1);
      on_device.derivatives.push_back(record);
    }
    return on_device;
  }

  std::size_t channels() const { return static_cast<std::size_t>(wavefront->channels()); }

  // Index of a part's number among those of the gradient, and the divisor of its sum there (shared/declaration.h: d
  // coordinate = d number / scale).
  struct Number {
    std::size_t index;
    double scale;
  };
  Number number(const NumberOfPart& part, std::size_t channel) const {
    const bool by_channel = part.colour && wavefront->throughput_channels() == 3;
    const auto at = static_cast<std::size_t>(part.first + part.place(by_channel ? static_cast<int>(channel) : 0));
    const float value = data.numbers[at];
    const int coordinate = part.texels >= 0 ? COORDINATE_ITSELF : part.model->number_of(part.slot).coordinate;
    const float scale = coordinate == COORDINATE_ITSELF   ? 1
                        : coordinate == COORDINATE_COSINE ? 1 - value * value
                                                          : value;
    return {at * channels() + channel, static_cast<double>(scale)};
  }

  // Adjoints of a sample of each pixel of a group, one for each channel of radiance, in units of the sums.
  std::vector<float> pulls_of(const Rendering& group, const std::vector<double>& weights, double quantum) const {
    std::vector<float> pulls;
    const auto image_channels = static_cast<std::size_t>(group.channels);
    for (std::size_t i = 0; i < weights.size(); i += image_channels)
      for (std::size_t c = 0; c < channels(); ++c) {
        double pull = 0;
        if (image_channels == channels())
          pull = weights[i + c];
        else if (image_channels == 1)
          pull = weights[i] * luminance_weights[c];
        else
          for (std::size_t k = 0; k < image_channels; ++k) pull += weights[i + k];
        pulls.push_back(static_cast<float>(pull / group.spp / quantum));
      }
    return pulls;
  }

  // One for each parameter. sums: of each place a whole number.
  template <class Sums>
  std::vector<VoxelGrid> develop_texels(const Sums& sums, double quantum) const {
    std::vector<VoxelGrid> result(static_cast<std::size_t>(derivatives.images()));
    const auto of_texel = static_cast<std::size_t>(wavefront->texel_channels());
    for (const DifferentiatedTexture& texture : derivatives.textures) {
      const auto own = static_cast<std::size_t>(texture.shape.channels);
      const std::size_t first = static_cast<std::size_t>(texture.first_texel) * of_texel;
      const auto sum_at = [&](std::size_t i) { return sums(first + i); };
      using Sum = decltype(sum_at(0));
      VoxelGrid& of = result[static_cast<std::size_t>(texture.image)];
      of = texture.shape;
      of.data.resize(texture.values() * own);
      if (texture.corners.empty()) {
        develop_values<Sum>(sum_at, of_texel, own, quantum, of.data);
        continue;
      }
      std::vector<Sum> total(texture.values() * of_texel);  // of a value at several corners
      for (std::size_t i = 0; i < texture.corners.size(); ++i)
        for (std::size_t c = 0; c < of_texel && texture.corners[i] >= 0; ++c)
          total[static_cast<std::size_t>(texture.corners[i]) * of_texel + c] += sum_at(i * of_texel + c);
      develop_values<Sum>([&](std::size_t i) { return total[i]; }, of_texel, own, quantum, of.data);
    }
    return result;
  }

  // sums: of_texel of each value; one number moves all channels of the radiance. Grids have millions.
  template <class Sum, class Sums>
  static void develop_values(const Sums& sums, std::size_t of_texel, std::size_t own, double quantum,
                             std::vector<float>& values) {
    constexpr std::size_t block = 1 << 16;
    const std::size_t texels = values.size() / own;
    parallel_for((texels + block - 1) / block, [&](std::size_t k) {
      for (std::size_t i = k * block; i < std::min(texels, (k + 1) * block); ++i) {
        std::array<Sum, 3> total{};
        for (std::size_t c = 0; c < of_texel; ++c) total[own == 1 ? 0 : c] += sums(i * of_texel + c);
        for (std::size_t c = 0; c < own; ++c)
          values[i * own + c] = static_cast<float>(quantum * static_cast<double>(total[c]));
      }
    });
  }

  // For each parameter the sum over the numbers that it moves. sum_of: the sum of a number.
  template <class SumOf>
  std::vector<double> by_parameters(const SumOf& sum_of) const {
    std::vector<double> result(static_cast<std::size_t>(derivatives.images()));
    std::size_t light_numbers = data.numbers.size();
    const auto first_field = light_numbers + static_cast<std::size_t>(std::count_if(
                                                 derivatives.derivatives.begin(), derivatives.derivatives.end(),
                                                 [](const DerivativeRecord& d) { return is_of_light(d); }));
    for (std::size_t p = 0; p < derivatives.parts.size(); ++p) {
      const PartRecord& part = derivatives.parts[p];
      const DerivativeRecord& derivative = derivatives.derivatives[p];
      const bool of_light = is_of_light(derivative);
      for (std::size_t c = 0; c < channels(); ++c) {
        const auto factor = static_cast<double>(derivative.factor[c]);
        const NumberOfPart& by = derivatives.numbers[p];
        if (factor == 0 || by.heights) continue;  // heights that are all moved alike change nothing
        for (int k = 0; k < by.components; ++k) {
          Number n = by.field >= 0 ? Number{(first_field + static_cast<std::size_t>(by.field)) * channels() + c, 1}
                     : of_light    ? Number{light_numbers * channels() + c, factor * factor}
                                   : number(by, c);
          if (k > 0) n.index += static_cast<std::size_t>(k) * channels();
          result[static_cast<std::size_t>(part.image)] += factor / n.scale * sum_of(n.index);
        }
      }
      light_numbers += of_light;
    }
    return result;
  }

  // The adjoints of one sum: the gradient, or one of its contrasts.
  struct Pull {
    const std::vector<std::vector<double>>* weights;
    double quantum, factor;
    int contrast;
  };

  // sums: as of Wavefront::take_gradient
  WeighedDerivatives develop(const WideSums& sums, const std::vector<Pull>& pulls) const {
    const std::size_t sets = wavefront->contrast_sets(),
                      stride = sums.size() / (GRADIENT_SETS + (pulls.size() - 1) * sets);
    if (const double lost = sums.sum(stride - 1); lost != 0)
      throw ResultError(fmt::format("gradient: {} products are not finite, or too large to be summed", lost));
    WeighedDerivatives result;
    result.value = by_parameters([&](std::size_t i) { return sums.sum(i, stride, GRADIENT_SETS); });
    for (double& value : result.value) value *= pulls.front().quantum;
    std::vector<double> variance(result.value.size());
    for (std::size_t k = 1; k < pulls.size(); ++k)
      for (std::size_t set = 0; set < sets; ++set) {
        const std::size_t first = (GRADIENT_SETS + (k - 1) * sets + set) * stride;
        const std::vector<double> of_set = by_parameters([&](std::size_t i) { return sums.sum(first + i); });
        for (std::size_t p = 0; p < variance.size(); ++p)
          variance[p] += pulls[k].factor * std::pow(pulls[k].quantum * of_set[p], 2);
      }
    // Differences of squares may be below 0.
    for (const double v : variance)
      result.stderr_.push_back(pulls.size() > 1 ? std::sqrt(std::max(v, 0.0))
                                                : std::numeric_limits<double>::infinity());
    return result;
  }

  // Adds what the device has summed by now; it goes on from 0.
  void take_sums(WideSums& of_numbers, WideSums& of_texels) {
    wavefront->look_at_texel_gradient([&](const std::int64_t* sums) { of_texels.add(sums, wavefront->texel_sums()); });
    const std::vector<std::int64_t> sums = wavefront->take_gradient();
    of_numbers.add(sums.data(), sums.size());
  }

  const Device& device;
  RenderOptions options;
  Sensor sensor;
  LaunchData data;
  DerivativeData derivatives;
  std::unique_ptr<Wavefront> wavefront;
  std::unique_ptr<Film> film;
  bool by_light = false;  // some derivative
  std::int64_t launch_paths = first_launch_paths(device);
};

GradientRenderer::GradientRenderer(const Device& device, const Scene& scene, const RenderOptions& options)
    : state_(std::make_unique<State>(device, scene, options)) {}
GradientRenderer::~GradientRenderer() = default;

void GradientRenderer::replace(const Scene& scene) {
  JobRecord job;
  const DerivativeData on_device = state_->compile(scene, job);
  // Other values may need another program: a medium that now scatters so much that baselines pay, a grey number that
  // has got colours.
  if (!state_->wavefront->replace(state_->data, {job}, on_device, false)) state_->build(job, on_device);
}

void GradientRenderer::reseed(std::uint64_t seed) {
  state_->options.seed = seed;
  state_->wavefront->reseed(seed);
}

WeighedDerivatives GradientRenderer::render(int first_sample, const std::vector<int>& samples_of_groups,
                                            const GroupWeights& weights) {
  State& s = *state_;
  const auto start = std::chrono::steady_clock::now();
  const auto pixels = static_cast<std::size_t>(s.sensor.crop_width * s.sensor.crop_height);
  const int spp = std::accumulate(samples_of_groups.begin(), samples_of_groups.end(), 0);
  // Samples that do not all stay on the device are traced once more.
  TracedLaunches traced;
  traced.keep = pixels * static_cast<std::size_t>(spp) <= s.wavefront->sample_capacity();
  std::vector<std::size_t> group_of;  // of each launch
  std::vector<Rendering> groups;
  int first = first_sample;
  RenderOptions options = s.options;
  options.derivatives.clear();  // of the images
  for (const int samples : samples_of_groups) {
    const std::vector<TracedJob> job{{0, &s.sensor, first}};
    if (s.options.progress)  // of two passes
      options.progress = [&](double done) {
        s.options.progress((first - first_sample + done * samples) / (2.0 * spp));
      };
    groups.push_back(trace_images(*s.wavefront, *s.film, job, samples, 1, options, s.launch_paths, &traced).front());
    group_of.resize(traced.launches.size(), groups.size() - 1);
    first += samples;
  }
  const GradientWeights weight = weights(groups);
  const std::int64_t paths = static_cast<std::int64_t>(pixels) * spp;
  std::vector<State::Pull> pulls{{&weight.values, quantum_of(groups, weight.values, paths), 1, -1}};
  if (pulls.front().quantum == 0 && s.by_light)
    throw ResultError(
        "gradient: what is to be weighed is black, so that nothing tells how exactly to sum derivatives by the light; "
        "take "
        "derivative images");
  for (const GradientContrast& contrast : weight.contrasts)
    pulls.push_back({&contrast.weights, quantum_of(groups, contrast.weights, paths), contrast.factor,
                     static_cast<int>(pulls.size()) - 1});
  for (State::Pull& pull : pulls)
    if (pull.quantum == 0) pull.quantum = 1;

  s.wavefront->begin_gradient(static_cast<int>(weight.contrasts.size()));
  const bool wide = paths > most_paths;  // the same on all ranks
  WideSums of_numbers, of_texels;
  std::int64_t since = 0;
  std::size_t shown = groups.size();  // the group whose adjoints these are
  std::vector<std::vector<float>> pulls_of_group(pulls.size());
  for (std::size_t l = 0; l < traced.launches.size(); ++l) {
    if (s.options.cancel && *s.options.cancel) throw Interrupted();
    const TracedLaunch& launch = traced.launches[l];
    const std::size_t group = group_of[l];
    if (std::exchange(shown, group) != group)
      for (std::size_t k = 0; k < pulls.size(); ++k)
        pulls_of_group[k] = s.pulls_of(groups[group], (*pulls[k].weights)[group], pulls[k].quantum);
    if (!traced.keep) s.wavefront->trace(launch.slices);
    for (std::size_t k = 0; k < pulls.size(); ++k) {
      if (pulls_of_group[k].empty()) continue;
      std::vector<float> of_launch;
      for (const JobSlice& slice : launch.slices)
        for (int i = 0; i < slice.pixels; ++i) {
          const auto pixel = static_cast<std::size_t>(slice.first_pixel + i * slice.pixel_step) * s.channels();
          for (std::size_t c = 0; c < s.channels(); ++c) of_launch.push_back(pulls_of_group[k][pixel + c]);
        }
      s.wavefront->replay(launch.slices, of_launch, launch.first_sample, pulls[k].contrast);
    }
    for (const JobSlice& slice : launch.slices) since += std::int64_t{slice.pixels} * slice.samples;
    if (since > most_paths) {
      s.take_sums(of_numbers, of_texels);
      since = 0;
    }
    if (s.options.progress)
      s.options.progress(0.5 + 0.5 * static_cast<double>(l + 1) / static_cast<double>(traced.launches.size()));
  }
  std::vector<VoxelGrid> values;
  const double quantum = pulls.front().quantum;
  if (wide) {
    s.take_sums(of_numbers, of_texels);
    if (s.options.ranks) add_up(*s.options.ranks, of_texels);
    values = s.develop_texels([&](std::size_t i) { return of_texels.sum(i); }, quantum);
  } else {
    s.wavefront->look_at_texel_gradient([&](const std::int64_t* sums) {
      if (!s.options.ranks) {
        values = s.develop_texels([&](std::size_t i) { return sums[i]; }, quantum);
        return;
      }
      std::vector<std::int64_t> of_all(sums, sums + s.wavefront->texel_sums());
      add_up(*s.options.ranks, of_all);
      values = s.develop_texels([&](std::size_t i) { return of_all[i]; }, quantum);
    });
    const std::vector<std::int64_t> sums = s.wavefront->take_gradient();
    of_numbers.add(sums.data(), sums.size());
  }
  if (s.options.ranks) add_up(*s.options.ranks, of_numbers);
  WeighedDerivatives result = s.develop(of_numbers, pulls);
  result.values = std::move(values);
  result.render_s = seconds_since(start);
  return result;
}

}  // namespace itn
