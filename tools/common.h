// What every sub-command shares: options with one name and meaning, and where results go.
#pragma once
#include <CLI/CLI.hpp>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "runtime/scene/scene.h"

namespace itn::tools {

struct CommonOptions {
  std::string device;
  int spp = 0;  // 0: the scene's own
  std::uint64_t seed = 0;
  std::vector<std::string> definitions;  // name=value
  bool quiet = false;
  std::string json;  // file, "-" is standard output, empty: none

  // Throws UsageError for a definition without "=".
  std::map<std::string, std::string> definition_map() const;
  // May the text for people go to standard output?
  bool talkative() const { return !quiet && json != "-"; }
};

void add_common_options(CLI::App& command, CommonOptions& options);

// Of --sensor; throws UsageError when the scene has fewer.
const Sensor& chosen_sensor(const Scene& scene, int index);

// Which sensor each target of a command was seen by: as given, else the scene's sensors in their order. Throws
// UsageError where sensors or masks do not come one a target or not at all.
std::vector<int> sensors_of_targets(const std::vector<std::string>& targets, const std::vector<std::string>& masks,
                                    const std::vector<int>& sensors);

// Writes the result where --json says; throws ResultError when that fails.
void write_json(const CommonOptions& options, const nlohmann::ordered_json& result);

// Warnings of a scene and the like: standard error, unless --quiet.
void warn(const CommonOptions& options, const std::string& text);

// One function a sub-command, in a file of the same name: declares its options and what to run.
void add_bench(CLI::App& app);
void add_devices(CLI::App& app);
void add_gradcheck(CLI::App& app);
void add_gradient(CLI::App& app);
void add_invert(CLI::App& app);
void add_parameters(CLI::App& app);
void add_predict(CLI::App& app);
void add_render(CLI::App& app);
void add_shapes(CLI::App& app);
void add_train(CLI::App& app);

}  // namespace itn::tools
