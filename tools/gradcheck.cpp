// itn gradcheck: each derivative of an image against a central difference with common random numbers.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "runtime/base/error.h"
#include "runtime/base/file.h"
#include "runtime/base/inputs.h"
#include "runtime/base/statistics.h"
#include "runtime/derivative/difference.h"
#include "runtime/renderer.h"
#include "runtime/scene/load.h"
#include "runtime/scene/parameters.h"
#include "tools/common.h"
#include "tools/interrupt.h"
#include "tools/progress.h"

namespace itn::tools {
namespace {

constexpr int batches = 4;               // of different samples
constexpr double significance = 0.0027;  // a false alarm in all scores together

struct Options {
  CommonOptions common;
  std::string scene;
  Operator op = Operator::full;
  std::vector<std::string> parameters;
  int sensor = 0;
};

// A parameter that is checked.
struct Check {
  Parameter parameter;
  DifferenceStencil stencil;
  std::vector<DerivativeComparison::Channel> channels;
  bool passed = false;
};

struct Report {
  std::vector<Check> checks;
  std::vector<Parameter> not_differentiable;
  int width = 0, height = 0, spp = 0, channels = 3;
  double bound = 0, render_s = 0;

  bool passed() const {
    return std::all_of(checks.begin(), checks.end(), [](const Check& c) { return c.passed; });
  }
};

// Those named; else all that are differentiable, and the others for the report.
void choose(const Scene& scene, const Options& options, Report& report) {
  const std::vector<Parameter> all = list_parameters(scene);
  std::string reasons;
  for (const std::string& name : by_component(all, options.parameters)) {
    const Parameter p = find_parameter(all, name);
    if (!p.not_differentiable.empty())
      throw UsageError(fmt::format("parameter {} cannot be differentiated by: {}", name, p.not_differentiable));
    const auto same = [&](const Check& c) { return c.parameter.name == name; };
    if (std::any_of(report.checks.begin(), report.checks.end(), same))
      throw UsageError(fmt::format("parameter {}: named twice", name));
    report.checks.push_back({p, difference_stencil(scene, p), {}, false});
  }
  if (options.parameters.empty())
    for (const Parameter& p : all) {
      if (p.not_differentiable.empty()) {
        report.checks.push_back({p, difference_stencil(scene, p), {}, false});
      } else {
        report.not_differentiable.push_back(p);
        reasons += fmt::format("\n  {}: {}", p.name, p.not_differentiable);
      }
    }
  if (report.checks.empty())
    throw UsageError(fmt::format("{}: the scene has no differentiable parameter{}", options.scene, reasons));
}

// Renders one image after the other, each of one batch of the samples, and says how far the whole job is. The geometry
// goes to the device twice, not once an image.
class RenderSeries {
 public:
  RenderSeries(const Device& device, const Scene& scene, const Options& options, const std::vector<std::string>& names,
               int spp, std::size_t images, double paths_an_image)
      : spp_(spp),
        images_(static_cast<double>(images)),
        progress_(options.scene, static_cast<double>(images) * paths_an_image, "paths", !options.common.quiet),
        differentiated_(device, scene, render_options(options, names)),
        moved_(device, scene, render_options(options, {})) {}

  Rendering differentiated(int batch) { return counted(differentiated_.render(batch * spp_, spp_)); }
  Rendering moved(const Scene& scene, int batch) {
    moved_.replace(scene);
    return counted(moved_.render(batch * spp_, spp_));
  }
  double seconds() const { return seconds_; }

 private:
  RenderOptions render_options(const Options& options, const std::vector<std::string>& derivatives) {
    RenderOptions result;
    result.sensor = options.sensor;
    result.seed = options.common.seed;
    result.op = options.op;
    result.derivatives = derivatives;
    result.cancel = &interrupt_flag();
    result.progress = [this](double fraction) { progress_.update((done_ + fraction) / images_); };
    return result;
  }
  Rendering counted(Rendering image) {
    done_ += 1;
    seconds_ += image.render_s;
    return image;
  }

  int spp_;
  double images_, done_ = 0, seconds_ = 0;
  Progress progress_;
  Renderer differentiated_, moved_;
};

std::vector<double> difference_image(const Scene& scene, const Check& check, int batch, RenderSeries& images) {
  std::vector<double> difference;
  for (std::size_t k = 0; k < check.stencil.offset.size(); ++k) {
    const Rendering other = images.moved(moved_scene(scene, check.parameter, check.stencil.offset[k]), batch);
    difference.resize(other.mean.size(), 0.0);
    for (std::size_t i = 0; i < difference.size(); ++i)
      difference[i] += check.stencil.weight[k] * static_cast<double>(other.mean[i]);
  }
  return difference;
}

void measure(const Device& device, const Scene& scene, const Options& options, Report& report) {
  const Sensor& sensor = chosen_sensor(scene, options.sensor);
  report.width = sensor.crop_width;
  report.height = sensor.crop_height;
  report.channels = sensor.luminance ? 1 : 3;
  const int spp = options.common.spp ? options.common.spp : sensor.spp;
  const int batch_spp = (spp - 1) / batches + 1;
  report.spp = batch_spp * batches;
  const std::size_t pixels = static_cast<std::size_t>(report.width) * static_cast<std::size_t>(report.height);
  const auto channels = static_cast<std::size_t>(report.channels);
  std::vector<DerivativeComparison> comparisons(report.checks.size(), {pixels, channels});
  std::vector<std::string> names;
  for (const Check& check : report.checks) names.push_back(check.parameter.name);

  const std::size_t images = batches * (1 + 4 * report.checks.size());
  RenderSeries series(device, scene, options, names, batch_spp, images, static_cast<double>(pixels) * batch_spp);
  double largest_mean = 0;
  for (int batch = 0; batch < batches; ++batch) {
    const Rendering image = series.differentiated(batch);
    for (const double mean : image.mean_of_image) largest_mean = std::max(largest_mean, std::fabs(mean));
    for (std::size_t i = 0; i < comparisons.size(); ++i)
      comparisons[i].add(image.derivatives[i].mean, difference_image(scene, report.checks[i], batch, series));
  }
  report.render_s = series.seconds();
  report.bound = largest_z_bound(comparisons.size() * channels, significance);
  for (std::size_t i = 0; i < comparisons.size(); ++i) {
    Check& check = report.checks[i];
    check.channels = comparisons[i].result(rounding_error(check.stencil, largest_mean));
    check.passed = std::all_of(check.channels.begin(), check.channels.end(),
                               [&](const auto& c) { return std::fabs(c.z) <= report.bound; });
  }
}

// The smallest relative error of the derivative that the check would have found.
double notices(const DerivativeComparison::Channel& c, double bound) {
  return bound * c.stderr_between / std::fabs(c.difference);
}

void print(const Report& report) {
  std::size_t width = 9;
  for (const Check& check : report.checks) width = std::max(width, check.parameter.name.size());
  fmt::print("{:<{}}    {:>24}  {:>24}  {:>6}  {:>8}  {:>9}\n", "parameter", width, "derivative", "central difference",
             "z", "notices", "pixels");
  const auto number = [](double value, double error) { return fmt::format("{:.5g} +- {:.2g}", value, error); };
  for (const Check& check : report.checks)
    for (std::size_t c = 0; c < check.channels.size(); ++c) {
      const auto& channel = check.channels[c];
      const std::string at_most =
          channel.difference == 0 ? "-" : fmt::format("{:.2g} %", 100 * notices(channel, report.bound));
      fmt::print("{:<{}}  {}  {:>24}  {:>24}  {:>6.2f}  {:>8}  {:>7.1f} %  {}\n", check.parameter.name, width,
                 report.channels == 1 ? 'Y' : "RGB"[c], number(channel.derivative, channel.derivative_stderr),
                 number(channel.difference, channel.difference_stderr), channel.z, at_most, 100 * channel.beyond_95,
                 std::fabs(channel.z) <= report.bound ? "" : "FAILED");
    }
  for (const Parameter& p : report.not_differentiable)
    fmt::print("{:<{}}  not differentiable: {}\n", p.name, width, p.not_differentiable);
  fmt::print(
      "{}: |z| up to {:.2f} is chance, {} spp in {} batches; notices: the relative error that would have failed; "
      "pixels "
      "beyond their own 95 %\n",
      report.passed() ? "passed" : "FAILED", report.bound, report.spp, batches);
}

nlohmann::ordered_json to_json(const Report& report, const Options& options, const Device& device) {
  nlohmann::ordered_json parameters = nlohmann::ordered_json::object();
  for (const Check& check : report.checks) {
    nlohmann::ordered_json& json = parameters[check.parameter.name];
    json["value"] = check.parameter.value;
    json["step"] = check.stencil.step;
    for (const auto& c : check.channels) {
      json["derivative"].push_back(c.derivative);
      json["derivative_stderr"].push_back(c.derivative_stderr);
      json["difference"].push_back(c.difference);
      json["difference_stderr"].push_back(c.difference_stderr);
      json["z"].push_back(c.z);
      json["stderr"].push_back(c.stderr_between);
      json["pixels"].push_back(c.pixels);
      json["pixels_beyond_95"].push_back(c.beyond_95);
    }
    json["passed"] = check.passed;
  }
  nlohmann::ordered_json not_differentiable = nlohmann::ordered_json::object();
  for (const Parameter& p : report.not_differentiable) not_differentiable[p.name] = p.not_differentiable;
  const DeviceInfo& info = device.info();
  return {{"schema", "itn.gradcheck/1"},
          {"scene", options.scene},
          {"operator", name_of(options.op)},
          {"width", report.width},
          {"height", report.height},
          {"spp", report.spp},
          {"batches", batches},
          {"seed", options.common.seed},
          {"device", {{"platform", info.platform}, {"name", info.name}, {"type", info.type}}},
          {"time", {{"render_s", report.render_s}}},
          {"significance", significance},
          {"bound", report.bound},
          {"passed", report.passed()},
          {"parameters", parameters},
          {"not_differentiable", not_differentiable}};
}

void run(const Options& options) {
  const CommonOptions& common = options.common;
  Inputs inputs;
  const Scene scene = load_scene(options.scene, common.definition_map(), {.open = common.open});
  for (const std::string& text : scene.warnings) warn(common, text);
  Report report;
  choose(scene, options, report);
  inputs.end();
  check_outputs(common, {});
  const Device device(common.device);
  measure(device, scene, options, report);
  if (common.talkative()) print(report);
  write_json(common, to_json(report, options, device));
  if (report.passed()) return;
  std::string failed;
  for (const Check& check : report.checks)
    if (!check.passed) failed += (failed.empty() ? "" : ", ") + check.parameter.name;
  throw ResultError("gradcheck: the derivative and the central difference disagree: " + failed);
}

}  // namespace

void add_gradcheck(CLI::App& app) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "gradcheck",
      fmt::format("each derivative of an image against a central difference with the same random numbers\n\n"
                  "The mean of the image is compared, channel by channel, in {} batches that share "
                  "the samples a pixel. Exit code 1 if any of the z-scores exceeds the bound that all of them keep "
                  "with probability {:.2f} % when the derivatives are right (Sidak).",
                  batches, 100 * (1 - significance)));
  command->add_option("scene", options->scene, "Mitsuba 3 XML file")->required();
  command
      ->add_option("--parameter", options->parameters,
                   "check this scene parameter; may be repeated; default: all that are differentiable")
      ->take_all();
  add_operator_option(*command, options->op);
  add_sensor_option(*command, options->sensor);
  add_common_options(*command, options->common);
  add_open_option(*command, options->common);
  command->callback([options] { run(*options); });
}

}  // namespace itn::tools
