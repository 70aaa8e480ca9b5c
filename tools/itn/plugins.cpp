// itn plugins: what scene files may name.
#include "runtime/scene/xml/plugins.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "tools/itn/common.h"

namespace itn::tools {
namespace {

void run(const CommonOptions& options) {
  nlohmann::ordered_json result{{"schema", "itn.plugins/1"}, {"plugins", nlohmann::ordered_json::object()}};
  for (const PluginFamily& family : plugin_families()) {
    if (options.talkative()) fmt::print("{:<12}{}\n", family.tag, fmt::join(family.types, " "));
    result["plugins"][family.tag] = family.types;
  }
  write_json(options, result);
}

}  // namespace

void add_plugins(CLI::App& app) {
  auto options = std::make_shared<CommonOptions>();
  CLI::App* command = app.add_subcommand("plugins", "List the plugins that scene files may name, by their element");
  add_example(*command, "itn plugins --json plugins.json");
  add_common_options(*command, *options);
  command->callback([options] { run(*options); });
}

}  // namespace itn::tools
