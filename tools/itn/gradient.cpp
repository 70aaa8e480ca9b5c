// itn gradient: an image loss and its unbiased gradient.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "itn/error.h"
#include "itn/exr.h"
#include "itn/file.h"
#include "itn/load_scene.h"
#include "itn/parameters.h"
#include "runtime/base/inputs.h"
#include "runtime/base/ranks.h"
#include "runtime/base/sample_index.h"
#include "runtime/base/seconds_since.h"
#include "runtime/inverse/measured_loss.h"
#include "runtime/scene/volume/volume_file.h"
#include "tools/itn/common.h"
#include "tools/itn/interrupt.h"
#include "tools/itn/progress.h"
#include "tools/itn/target_options.h"

namespace itn::tools {
namespace {

struct GradientArguments {
  CommonOptions common;
  std::string scene;
  Operator op = Operator::full;
  TargetOptions images;
  std::vector<std::string> parameters;
  std::string mode = "automatic", folder = ".";  // folder: of the gradients by textures
  bool exposure = false;
  int repeats = 1;
};

// The parameters that are textures or grids.
std::vector<Parameter> textures_of(const Scene& scene, const GradientArguments& options) {
  std::vector<Parameter> result;
  for (const Parameter& p : list_parameters(scene))
    if (p.has_values() &&
        std::find(options.parameters.begin(), options.parameters.end(), p.name) != options.parameters.end())
      result.push_back(p);
  return result;
}

bool by_replay(const GradientArguments& options, const std::vector<Parameter>& textures) {
  if (options.mode == "images" && !textures.empty())
    throw UsageError("--mode images: no image could show the derivative by each texel or voxel of " +
                     textures.front().name + "; need adjoint");
  return options.mode == "adjoint" || !textures.empty() ||
         (options.mode == "automatic" && options.parameters.size() > most_derivative_images);
}

// The gradient by a texture or a grid, as a file: the mean over repetitions with other samples, each of which is the
// mean over the targets.
struct TextureGradient {
  std::string parameter, file;  // without the file's extension
  VoxelGrid values;             // the mean, at the end
  bool by_voxels = false;
  std::vector<std::vector<float>> repeats;  // as values.data
  std::string path() const { return file + (by_voxels ? ".vol" : ".exr"); }
};

std::vector<TextureGradient> start_gradients(const Scene& scene, const GradientArguments& options,
                                             const std::vector<Parameter>& textures) {
  std::vector<TextureGradient> result;
  for (const Parameter& p : textures) {
    VoxelGrid values = values_of(scene, p);
    std::fill(values.data.begin(), values.data.end(), 0.0F);
    make_folder(options.folder);
    const std::vector<std::vector<float>> repeats(static_cast<std::size_t>(options.repeats), values.data);
    result.push_back({p.name, (std::filesystem::path(options.folder) / ("gradient." + p.name)).string(),
                      std::move(values), p.by_voxels, repeats});
    check_writable(result.back().path());
  }
  return result;
}

void add_values(std::vector<TextureGradient>& gradients, const GradientArguments& options,
                const std::vector<VoxelGrid>& values, std::size_t repeat) {
  const auto images = static_cast<float>(options.images.sensors.size());
  for (TextureGradient& gradient : gradients) {
    const auto at = std::find(options.parameters.begin(), options.parameters.end(), gradient.parameter);
    const VoxelGrid& of = values[static_cast<std::size_t>(at - options.parameters.begin())];
    for (std::size_t i = 0; i < of.data.size(); ++i) gradient.repeats[repeat][i] += of.data[i] / images;
  }
}

std::vector<std::string> channel_names(const VoxelGrid& values) {
  return values.channels == 1 ? std::vector<std::string>{"Y"} : std::vector<std::string>{"R", "G", "B"};
}

// The values become the mean. Returns their standard errors; of one repetition: none.
std::vector<float> end_gradient(TextureGradient& gradient) {
  std::vector<float> errors;
  const auto n = static_cast<double>(gradient.repeats.size());
  for (std::size_t i = 0; i < gradient.values.data.size(); ++i) {
    double mean = 0, square = 0;
    for (const std::vector<float>& repeat : gradient.repeats) mean += static_cast<double>(repeat[i]) / n;
    gradient.values.data[i] = static_cast<float>(mean);
    for (const std::vector<float>& repeat : gradient.repeats)
      square += std::pow(static_cast<double>(repeat[i]) - mean, 2);
    if (n > 1) errors.push_back(static_cast<float>(std::sqrt(square / (n * (n - 1)))));
  }
  return errors;
}

void write_gradient(const TextureGradient& gradient, const std::vector<float>& errors,
                    const GradientArguments& options) {
  const VoxelGrid& of = gradient.values;
  if (gradient.by_voxels) {
    write_volume_file(gradient.path(), of);
    if (errors.empty()) return;
    VoxelGrid of_errors = of;
    of_errors.data = errors;
    return write_volume_file(gradient.file + ".stderr.vol", of_errors);
  }
  std::vector<std::string> names = channel_names(of);
  std::vector<float> data = of.data;
  if (!errors.empty()) {
    const std::size_t channels = names.size();
    for (std::size_t c = 0; c < channels; ++c) names.push_back("stderr." + names[c]);
    data.clear();
    for (std::size_t i = 0; i < of.data.size(); i += channels)
      for (const std::vector<float>* part : {&of.data, &errors})
        data.insert(data.end(), part->begin() + static_cast<std::ptrdiff_t>(i),
                    part->begin() + static_cast<std::ptrdiff_t>(i + channels));
  }
  write_exr(gradient.path(),
            {of.width, of.height, names, data, {{"scene", options.scene}, {"parameter", gradient.parameter}}});
}

double norm(const VoxelGrid& values) {
  double square = 0;
  for (const float v : values.data) square += static_cast<double>(v) * static_cast<double>(v);
  return std::sqrt(square);
}

nlohmann::ordered_json to_json(const LossGradient& result, const GradientArguments& options, bool replay,
                               const std::vector<double>& exposures, const std::vector<TextureGradient>& textures,
                               double scene_s, double render_s, double trace_s) {
  nlohmann::ordered_json gradient = nlohmann::ordered_json::object();
  for (std::size_t p = 0; p < options.parameters.size(); ++p)
    gradient[options.parameters[p]] = {{"value", result.gradient[p]}, {"stderr", result.gradient_stderr[p]}};
  for (const TextureGradient& texture : textures) {
    nlohmann::ordered_json& entry = gradient[texture.parameter];
    const VoxelGrid& of = texture.values;
    std::vector<double> sum(static_cast<std::size_t>(of.channels));
    for (std::size_t i = 0; i < of.data.size(); ++i) sum[i % sum.size()] += static_cast<double>(of.data[i]);
    nlohmann::ordered_json file{{"file", texture.path()}, {"width", of.width}, {"height", of.height}};
    if (texture.by_voxels) file["depth"] = of.depth;
    file.update({{"channels", channel_names(of)}, {"sum", sum}, {"norm", norm(of)}});
    entry[texture.by_voxels ? "voxels" : "texels"] = file;
  }
  nlohmann::ordered_json time{{"scene_s", scene_s}, {"render_s", render_s}};
  if (replay) time["trace_s"] = trace_s;
  return {{"schema", "itn.gradient/1"},
          {"scene", options.scene},
          {"operator", name_of(options.op)},
          {"mode", replay ? "adjoint" : "images"},
          {"loss", result.loss},
          {"loss_stderr", result.loss_stderr},
          {"exposures", exposures},
          {"gradient", gradient},
          {"time", time}};
}

void run(GradientArguments options) {
  const CommonOptions& common = options.common;
  const auto seconds = [start = std::chrono::steady_clock::now()] { return seconds_since(start); };
  check_folder(options.folder);
  Inputs inputs;
  const Scene scene =
      load_scene(options.scene, common.definition_map(), {.size = options.images.size, .open = common.open});
  for (const std::string& text : scene.warnings) warn(common, text);
  options.parameters = by_component(list_parameters(scene), options.parameters);
  const double scene_s = seconds();
  const std::vector<TargetImage> targets = read_targets(options.images, scene);
  inputs.end();
  print_notes(common, targets, !options.exposure);
  check_outputs(common, {});
  const std::vector<int>& sensors = options.images.sensors;
  const std::vector<Parameter> textures = textures_of(scene, options);
  const bool replay = by_replay(options, textures);
  std::vector<TextureGradient> by_values = start_gradients(scene, options, textures);
  if (options.repeats > 1 && !replay)
    throw UsageError("--repeats: derivative images say their standard errors themselves; need --mode adjoint");
  const Device device(common.device);

  std::vector<LossGradient> losses;
  std::vector<double> exposures;
  double trace_s = 0;
  Progress progress(options.scene, static_cast<double>(sensors.size()), "images", !common.quiet);
  for (std::size_t t = 0; t < sensors.size(); ++t) {
    RenderOptions render_options;
    render_options.sensor = sensors[t];
    render_options.seed = common.seed + t;  // independent noise in every image
    render_options.op = options.op;
    render_options.derivatives = options.parameters;
    render_options.cancel = &interrupt_flag();
    render_options.ranks = &world();
    const int spp = common.spp ? common.spp : scene.sensors[static_cast<std::size_t>(sensors[t])].spp;
    if (spp < 2) throw UsageError("--spp 1: an unbiased loss compares different samples of a pixel; need 2 or more");
    int repeat = 0;
    const auto report = [&](double done) {
      progress.update((static_cast<double>(t) + (repeat + done) / options.repeats) /
                      static_cast<double>(sensors.size()));
    };
    if (replay) render_options.progress = report;
    std::optional<GradientRenderer> replayer;
    std::optional<Renderer> renderer;
    if (replay)
      replayer.emplace(device, scene, render_options);
    else
      renderer.emplace(device, scene, render_options);
    for (; repeat < options.repeats; ++repeat) {
      const MeasuredLoss image = replay ? measure_loss(*replayer, following_sample(0, std::int64_t{repeat} * spp), spp,
                                                       targets[t], options.exposure)
                                        : measure_loss(*renderer, 0, spp, targets[t], options.exposure, report);
      report(1);
      exposures.push_back(image.exposure);
      losses.push_back(image.loss);
      add_values(by_values, options, image.values, static_cast<std::size_t>(repeat));
      trace_s += image.trace_s;
    }
  }
  progress.clear();
  const LossGradient result = mean_of(losses);
  for (TextureGradient& gradient : by_values) write_gradient(gradient, end_gradient(gradient), options);
  if (common.talkative()) {
    fmt::print("loss {:.6g}  standard error {:.2g}\n", result.loss, result.loss_stderr);
    if (options.exposure) fmt::print("exposure {:.6g}\n", fmt::join(exposures, " "));
    for (std::size_t p = 0; p < options.parameters.size(); ++p)
      fmt::print("d loss / d {}: {:.6g}  standard error {:.2g}\n", options.parameters[p], result.gradient[p],
                 result.gradient_stderr[p]);
    for (const TextureGradient& gradient : by_values)
      fmt::print("d loss / d {} of {}: norm {:.6g}, in {}\n", gradient.by_voxels ? "voxels" : "texels",
                 gradient.parameter, norm(gradient.values), gradient.path());
  }
  write_json(common, to_json(result, options, replay, exposures, by_values, scene_s, seconds() - scene_s, trace_s));
}

}  // namespace

void add_gradient(CLI::App& app) {
  auto options = std::make_shared<GradientArguments>();
  CLI::App* command = app.add_subcommand(
      "gradient", "Compute the mean squared difference from a target image and its gradient, both without bias");
  command->add_option("scene", options->scene, "Mitsuba 3 XML file")->required();
  command
      ->add_option("--parameter", options->parameters,
                   "Scene parameter to differentiate by (itn parameters lists them), or a bitmap or grid for each of "
                   "its texels or voxels; may be repeated")
      ->required()
      ->take_all();
  command
      ->add_option("-o,--output", options->folder,
                   "Folder for the gradients by textures and grids: gradient.PARAMETER.exr or .vol, of the same size")
      ->capture_default_str();
  add_target_options(*command, options->images);
  command->add_flag("--exposure", options->exposure,
                    "Take each target as known up to a factor: the loss is the smallest over the factors");
  group_options(*command, "Targets", {"--exposure"});
  command
      ->add_option("--mode", options->mode,
                   "Render derivative images (images), replay paths, which takes as long for many parameters as for "
                   "one (adjoint), or do the quicker of both (automatic)")
      ->check(CLI::IsMember({"automatic", "images", "adjoint"}))
      ->capture_default_str();
  command
      ->add_option("--repeats", options->repeats,
                   "Average this many gradients of different samples by replay, which gives the standard error of each "
                   "texel and voxel, too")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  add_operator_option(*command, options->op);
  group_options(*command, "Method", {"--mode", "--repeats", "--operator"});
  add_common_options(*command, options->common);
  add_open_option(*command, options->common);
  add_example(*command, "itn gradient wax.xml --target photo.exr --parameter wax.sigma_t --parameter phase.g --spp 64");
  command->callback([options] { run(*options); });
}

}  // namespace itn::tools
