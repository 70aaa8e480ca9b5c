// Common code of the sub-commands: options with one name and meaning, and where results go.
#pragma once
#include <cstdint>
#include <cstdio>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "itn/load_scene.h"
#include "itn/renderer.h"

namespace CLI {
class App;
}

namespace itn::tools {

struct CommonOptions {
  std::string device;
  int spp = 0;  // 0: the scene's own
  std::uint64_t seed = 0;
  std::vector<std::string> definitions;  // name=value
  bool open = false;                     // LoadOptions
  bool quiet = false;
  std::string json;  // file, "-" is standard output, empty: none

  // Throws UsageError for a definition without "=".
  std::map<std::string, std::string> definition_map() const;
  // May the text for people go to standard output?
  // Not where nobody reads any more: what was begun is finished first, and main() reports it.
  bool talkative() const { return !quiet && json != "-" && std::ferror(stdout) == 0; }
};

// default_spp: what happens without --spp.
void add_common_options(CLI::App& command, CommonOptions& options, const std::string& default_spp = "the scene's own");

// --open, of commands that load a scene; --operator, --sensor.
void add_open_option(CLI::App& command, CommonOptions& options);
void add_operator_option(CLI::App& command, Operator& op);
void add_sensor_option(CLI::App& command, int& sensor);
// Lists these options under this heading in the command's help.
void group_options(CLI::App& command, const std::string& group, const std::vector<std::string>& names);

// Ends the command's help with an example, a line for the shell, after a note that may have several sentences.
inline constexpr const char* example_heading = "Example:";
void add_example(CLI::App& command, const std::string& example, const std::string& note = "");

// --size WxH: of every film, instead of the scene's.
void add_size_option(CLI::App& command, std::optional<FilmSize>& size);
std::string name_of(Operator op);

// The sensor that --sensor asks for; throws UsageError when the scene has fewer.
const Sensor& chosen_sensor(const Scene& scene, int index);

// Writes the result where --json says; throws ResultError when that fails.
void write_json(const CommonOptions& options, const nlohmann::ordered_json& result);

// Asked before work that takes long: can --json and these files be written, each once, none of what was read (Inputs)?
// own: what the command writes into its folder, which may not be there yet. Throws ResultError or UsageError.
void check_outputs(const CommonOptions& options, std::vector<std::string> files,
                   const std::vector<std::string>& own = {});

// Asked before anything is read: throws UsageError where an output folder has no name, or that of what is no folder.
void check_folder(const std::string& folder);

// Throws UsageError where one of the files is the folder or in it, links followed; empty names and "-" are no files.
void refuse_inside(const std::string& folder, const std::vector<std::string>& files);

// Warnings of a scene and the like: standard error, unless --quiet.
void warn(const CommonOptions& options, const std::string& text);

// One function a sub-command, in a file of the same name: declares its options and what to run.
void add_bench(CLI::App& app);
void add_dataset(CLI::App& app);
void add_devices(CLI::App& app);
void add_plugins(CLI::App& app);
void add_eval(CLI::App& app);
void add_export(CLI::App& app);
void add_gradcheck(CLI::App& app);
void add_gradient(CLI::App& app);
void add_invert(CLI::App& app);
void add_parameters(CLI::App& app);
void add_predict(CLI::App& app);
void add_render(CLI::App& app);
void add_shapes(CLI::App& app);
void add_train(CLI::App& app);
void add_view(CLI::App& app);

}  // namespace itn::tools
