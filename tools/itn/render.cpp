// itn render: image, standard error and derivatives in one EXR, and pictures of them.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "itn/error.h"
#include "itn/exr.h"
#include "itn/load_scene.h"
#include "itn/parameters.h"
#include "itn/renderer.h"
#include "runtime/base/inputs.h"
#include "runtime/base/ranks.h"
#include "runtime/base/seconds_since.h"
#include "runtime/image/png.h"
#include "runtime/image/preview.h"
#include "runtime/render/rendering_warnings.h"
#include "tools/itn/common.h"
#include "tools/itn/interrupt.h"
#include "tools/itn/progress.h"
#include "tools/itn/rendered_exr.h"

namespace itn::tools {
namespace {

struct RenderArguments {
  CommonOptions common;
  std::string scene, output;
  Operator op = Operator::full;
  std::vector<std::string> derivatives;
  int sensor = 0;
  std::optional<FilmSize> size;
  bool preview = false;
};

struct Times {
  double scene = 0, write = 0;  // [s]
};

class Stopwatch {
 public:
  double seconds() const { return seconds_since(start_); }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

std::string preview_name(const std::string& output) {
  return std::filesystem::path(output).replace_extension(".png").string();
}

// a.exr, skin.g: a.skin.g.png. Ids may contain slashes, file names may not.
std::string preview_name(const std::string& output, std::string parameter) {
  std::replace(parameter.begin(), parameter.end(), '/', '_');
  return std::filesystem::path(output).replace_extension("." + parameter + ".png").string();
}

void check_files(const RenderArguments& options) {
  const std::string extension = std::filesystem::path(options.output).extension().string();
  if (extension == ".png" || extension == ".jpg" || extension == ".jpeg")
    throw UsageError("-o " + options.output + ": got " + extension +
                     ", need a name that ends in .exr; --preview writes a PNG beside it");
  std::vector<std::string> files{options.output};
  if (options.preview) {
    files.push_back(preview_name(options.output));
    for (const std::string& name : options.derivatives) files.push_back(preview_name(options.output, name));
  }
  check_outputs(options.common, files);
  for (const std::string& name : options.derivatives) {
    constexpr std::size_t longest = 255;  // of OpenEXR, which cuts what is longer
    const std::string channel = "derivative_stderr." + name + ".R";
    if (channel.size() > longest)
      throw InputError(
          fmt::format("{}: the name of {} becomes a channel of {} characters, and OpenEXR takes {}: give "
                      "the element a shorter id",
                      options.scene, name, channel.size(), longest));
  }
}

nlohmann::ordered_json to_json(const Rendering& image, const RenderArguments& options, const Device& device,
                               const Times& times) {
  const DeviceInfo& info = device.info();
  nlohmann::ordered_json derivatives = nlohmann::ordered_json::object();
  for (std::size_t i = 0; i < image.derivatives.size(); ++i)
    derivatives[options.derivatives[i]] = {{"mean", image.derivatives[i].mean_of_image},
                                           {"stderr", image.derivatives[i].stderr_of_mean}};
  return {
      {"schema", "itn.render/1"},
      {"scene", options.scene},
      {"output", options.output},
      {"operator", name_of(options.op)},
      {"width", image.width},
      {"height", image.height},
      {"spp", image.spp},
      {"seed", options.common.seed},
      {"device", {{"platform", info.platform}, {"name", info.name}, {"type", info.type}}},
      {"time",
       {{"scene_s", times.scene}, {"build_s", image.build_s}, {"render_s", image.render_s}, {"write_s", times.write}}},
      {"paths", image.paths},
      {"misplaced", image.misplaced},
      {"endless", image.endless},
      {"paths_per_s", static_cast<double>(image.paths) / image.render_s},
      {"mean", image.mean_of_image},
      {"mean_stderr", image.stderr_of_mean},
      {"derivatives", derivatives}};
}

// Returns the values of full red and blue, one a derivative.
std::vector<double> write_previews(const Rendering& image, const RenderArguments& options) {
  write_png(preview_name(options.output), image.width, image.height, tone_mapped(image.mean, image.channels));
  std::vector<double> scales;
  for (std::size_t i = 0; i < image.derivatives.size(); ++i) {
    const SignedPicture picture = red_blue(image.derivatives[i].mean, image.channels);
    write_png(preview_name(options.output, options.derivatives[i]), image.width, image.height, picture.bytes);
    scales.push_back(picture.scale);
  }
  return scales;
}

void print(const Rendering& image, const RenderArguments& options, const Device& device, const Times& times,
           const std::vector<double>& preview_scales) {
  fmt::print("{}: {} x {}, {} spp, operator {}, {}\n", options.output, image.width, image.height, image.spp,
             name_of(options.op), device.info().name);
  fmt::print("mean {:.6g}  standard error {:.2g}\n", fmt::join(image.mean_of_image, " "),
             fmt::join(image.stderr_of_mean, " "));
  for (std::size_t i = 0; i < image.derivatives.size(); ++i)
    fmt::print("derivative by {}: mean {:.6g}  standard error {:.2g}\n", options.derivatives[i],
               fmt::join(image.derivatives[i].mean_of_image, " "), fmt::join(image.derivatives[i].stderr_of_mean, " "));
  for (std::size_t i = 0; i < preview_scales.size(); ++i)
    fmt::print("{}: blue {:.3g}, white 0, red {:.3g}\n", preview_name(options.output, options.derivatives[i]),
               -preview_scales[i], preview_scales[i]);
  fmt::print("scene {:.2f} s, kernels {:.2f} s, rendering {:.2f} s, {:.3g} million paths/s, writing {:.2f} s\n",
             times.scene, image.build_s, image.render_s, static_cast<double>(image.paths) / image.render_s / 1e6,
             times.write);
}

void run(RenderArguments options) {
  const CommonOptions& common = options.common;
  Times times;
  Inputs inputs;
  const Stopwatch loading;
  const Scene scene = load_scene(options.scene, common.definition_map(), {.size = options.size, .open = common.open});
  times.scene = loading.seconds();
  inputs.end();
  for (const std::string& text : scene.warnings) warn(common, text);
  options.derivatives = by_component(list_parameters(scene), options.derivatives);
  const Sensor& sensor = chosen_sensor(scene, options.sensor);
  check_files(options);

  const Device device(common.device);
  const int spp = common.spp ? common.spp : sensor.spp;
  Progress progress(options.scene, double(sensor.crop_width) * sensor.crop_height * spp, "paths", !common.quiet);
  RenderOptions render_options;
  render_options.sensor = options.sensor;
  render_options.spp = spp;
  render_options.seed = common.seed;
  render_options.op = options.op;
  render_options.derivatives = options.derivatives;
  render_options.progress = [&](double fraction) { progress.update(fraction); };
  render_options.cancel = &interrupt_flag();
  render_options.ranks = &world();
  const Rendering image = render(device, scene, render_options);
  progress.clear();
  for (const std::string& text : warnings_of(image, scene)) warn(common, text);

  const Stopwatch writing;
  write_exr(options.output,
            to_exr(image, scene, {options.scene, options.derivatives, common.seed, options.op}, device));
  std::vector<double> preview_scales;
  if (options.preview) preview_scales = write_previews(image, options);
  times.write = writing.seconds();
  if (common.talkative()) print(image, options, device, times, preview_scales);
  write_json(common, to_json(image, options, device, times));
}

}  // namespace

void add_render(CLI::App& app) {
  auto options = std::make_shared<RenderArguments>();
  CLI::App* command = app.add_subcommand("render", "Render a scene to an OpenEXR image with standard errors");
  command->add_option("scene", options->scene, "Mitsuba 3 XML file")->required();
  command->add_option("-o,--output", options->output, "OpenEXR file to write")->required();
  command->add_flag("--preview", options->preview,
                    "Also write PNGs beside the output: the tone-mapped image, and each derivative in red (positive) "
                    "and blue (negative)");
  command
      ->add_option("--derivative", options->derivatives,
                   "Also render the derivative image by this scene parameter (itn parameters lists them); may be "
                   "repeated")
      ->take_all();
  add_operator_option(*command, options->op);
  add_sensor_option(*command, options->sensor);
  add_size_option(*command, options->size);
  group_options(*command, "What is rendered", {"--derivative", "--operator", "--sensor", "--size"});
  add_common_options(*command, options->common);
  add_open_option(*command, options->common);
  add_example(*command,
              "itn render scenes/gallery/jade_knot.xml -o knot.exr --spp 64 --derivative jade.sigma_t --preview");
  command->callback([options] { run(*options); });
}

}  // namespace itn::tools
