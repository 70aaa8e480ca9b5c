// itn parameters: what of a scene can be named, and what can be differentiated.
#include "itn/parameters.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <nlohmann/json.hpp>

#include "itn/load_scene.h"
#include "runtime/base/inputs.h"
#include "tools/itn/common.h"

namespace itn::tools {
namespace {

// JSON has no infinity: null stands for an open end.
nlohmann::ordered_json bound(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json();
}

void run(const CommonOptions& options, const std::string& file) {
  const Inputs inputs;
  const Scene scene = load_scene(file, options.definition_map(), {.open = options.open});
  for (const std::string& text : scene.warnings) warn(options, text);
  const std::vector<Parameter> parameters = list_parameters(scene);
  std::size_t width = 4;
  for (const Parameter& p : parameters) width = std::max(width, p.name.size());
  nlohmann::ordered_json result{
      {"schema", "itn.parameters/1"}, {"scene", file}, {"parameters", nlohmann::ordered_json::array()}};
  if (options.talkative())
    fmt::print("{:<{}}  {:>10}  {:<10}  {:<12}  {}\n", "name", width, "value", "range", "unit", "differentiable");
  for (const Parameter& p : parameters) {
    const bool differentiable = p.not_differentiable.empty();
    std::string by_values;
    nlohmann::ordered_json size;
    if (p.has_values()) {
      const VoxelGrid values = values_of(scene, p);
      by_values = p.by_texels ? fmt::format("by texels: {} x {}", values.width, values.height)
                              : fmt::format("by voxels: {} x {} x {}", values.width, values.height, values.depth);
      size = {{"width", values.width}, {"height", values.height}};
      if (p.by_voxels) size["depth"] = values.depth;
      size["channels"] = values.channels;
    }
    if (options.talkative())
      fmt::print("{:<{}}  {:>10}  {:<10}  {:<12}  {}\n", p.name, width,
                 std::isnan(p.value) ? "-" : fmt::format("{:.6g}", p.value), p.range(), p.unit.empty() ? "1" : p.unit,
                 differentiable   ? "yes"
                 : p.has_values() ? by_values
                                  : "no: " + p.not_differentiable);
    result["parameters"].push_back({{"name", p.name},
                                    {"value", bound(p.value)},
                                    {"low", bound(p.low)},
                                    {"high", bound(p.high)},
                                    {"range", p.range()},
                                    {"unit", p.unit},
                                    {"differentiable", differentiable},
                                    {"reason", p.not_differentiable}});
    if (p.has_values()) result["parameters"].back()[p.by_texels ? "texels" : "voxels"] = size;
  }
  write_json(options, result);
}

}  // namespace

void add_parameters(CLI::App& app) {
  struct Options {
    CommonOptions common;
    std::string scene;
  };
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "parameters", "List every parameter of a scene: name, value, valid range, and whether it is differentiable");
  command->add_option("scene", options->scene, "Mitsuba 3 XML file")->required();
  add_common_options(*command, options->common);
  add_open_option(*command, options->common);
  add_example(*command, "itn parameters scenes/gallery/jade_knot.xml");
  command->callback([options] { run(options->common, options->scene); });
}

}  // namespace itn::tools
