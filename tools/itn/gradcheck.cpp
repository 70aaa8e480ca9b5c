// itn gradcheck: each derivative of an image against a central difference with common random numbers.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <nlohmann/json.hpp>

#include "itn/error.h"
#include "itn/file.h"
#include "itn/load_scene.h"
#include "itn/parameters.h"
#include "itn/renderer.h"
#include "runtime/base/inputs.h"
#include "runtime/render/derivative_check.h"
#include "tools/itn/common.h"
#include "tools/itn/interrupt.h"
#include "tools/itn/progress.h"

namespace itn::tools {
namespace {

struct GradcheckArguments {
  CommonOptions common;
  std::string scene;
  Operator op = Operator::full;
  std::vector<std::string> parameters;
  int sensor = 0;
};

// The smallest relative error of the derivative that the check would have found.
double notices(const DerivativeComparison::Channel& c, double bound) {
  return bound * c.stderr_between / std::fabs(c.difference);
}

void print(const DerivativeCheck& report) {
  std::size_t width = 9;
  for (const DerivativeCheck::OfParameter& check : report.checks) width = std::max(width, check.parameter.name.size());
  fmt::print("{:<{}}    {:>24}  {:>24}  {:>6}  {:>8}  {:>9}\n", "parameter", width, "derivative", "central difference",
             "z", "notices", "pixels");
  const auto number = [](double value, double error) { return fmt::format("{:.5g} +- {:.2g}", value, error); };
  for (const DerivativeCheck::OfParameter& check : report.checks)
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
      report.passed() ? "passed" : "FAILED", report.bound, report.spp, DerivativeCheck::batches);
}

void run(const GradcheckArguments& options) {
  const CommonOptions& common = options.common;
  Inputs inputs;
  const Scene scene = load_scene(options.scene, common.definition_map(), {.open = common.open});
  for (const std::string& text : scene.warnings) warn(common, text);
  DerivativeCheck report = plan_check(scene, options.parameters);
  const Sensor& sensor = chosen_sensor(scene, options.sensor);
  inputs.end();
  check_outputs(common, {});
  const Device device(common.device);
  RenderOptions render_options;
  render_options.sensor = options.sensor;
  render_options.spp = common.spp ? common.spp : sensor.spp;
  render_options.seed = common.seed;
  render_options.op = options.op;
  render_options.cancel = &interrupt_flag();
  const double images = DerivativeCheck::batches * (1 + 4 * static_cast<double>(report.checks.size()));
  Progress progress(options.scene,
                    images * sensor.crop_width * sensor.crop_height * render_options.spp / DerivativeCheck::batches,
                    "paths", !common.quiet);
  render_options.progress = [&](double fraction) { progress.update(fraction); };
  run_check(device, scene, render_options, report);
  progress.clear();
  if (common.talkative()) print(report);
  write_json(common, to_json(report, options.scene, device));
  if (report.passed()) return;
  std::string failed;
  for (const DerivativeCheck::OfParameter& check : report.checks)
    if (!check.passed) failed += (failed.empty() ? "" : ", ") + check.parameter.name;
  throw ResultError("gradcheck: the derivative and the central difference disagree: " + failed);
}

}  // namespace

void add_gradcheck(CLI::App& app) {
  auto options = std::make_shared<GradcheckArguments>();
  CLI::App* command = app.add_subcommand(
      "gradcheck", "Check each derivative of an image against a central difference with the same random numbers");
  command->add_option("scene", options->scene, "Mitsuba 3 XML file")->required();
  command
      ->add_option("--parameter", options->parameters,
                   "Scene parameter to check; may be repeated; default: all that are differentiable")
      ->take_all();
  add_operator_option(*command, options->op);
  add_sensor_option(*command, options->sensor);
  add_common_options(*command, options->common);
  add_open_option(*command, options->common);
  add_example(
      *command, "itn gradcheck scenes/gallery/jade_knot.xml --parameter jade.sigma_t --spp 256",
      fmt::format("The mean of the image is compared, channel by channel, in {} batches that share the samples per "
                  "pixel.\nExit code 1: a z-score exceeds the bound that all of them keep with probability {:.2f} % "
                  "when the derivatives are right (Sidak).",
                  DerivativeCheck::batches, 100 * (1 - DerivativeCheck::significance)));
  command->callback([options] { run(*options); });
}

}  // namespace itn::tools
