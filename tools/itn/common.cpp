#include "tools/itn/common.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "itn/error.h"
#include "itn/file.h"
#include "runtime/base/printable.h"
#include "runtime/base/private_file.h"
#include "runtime/base/ranks.h"
#include "tools/itn/private_json.h"

namespace itn::tools {
namespace {

// CLI11 takes -1 for 2^64 - 1.
std::string is_seed(const std::string& text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error == std::errc() && end == text.data() + text.size()) return "";
  return "got " + text + ", need a whole number from 0 to 2^64 - 1";
}

// One for all names of a file, also of one that is not there.
std::string whole_name(const std::string& file) {
  std::error_code error;
  const std::filesystem::path absolute = std::filesystem::absolute(file, error);
  const std::filesystem::path whole = std::filesystem::weakly_canonical(absolute, error);
  return (error ? absolute.lexically_normal() : whole).string();
}

}  // namespace

const Sensor& chosen_sensor(const Scene& scene, int index) {
  const int count = static_cast<int>(scene.sensors.size());
  if (index >= count)
    throw UsageError(fmt::format("--sensor {}: {} has {} sensor{}; need 0 to {}", index, scene.file, count,
                                 count == 1 ? "" : "s", count - 1));
  return scene.sensors[static_cast<std::size_t>(index)];
}

std::map<std::string, std::string> CommonOptions::definition_map() const {
  std::map<std::string, std::string> map;
  for (const std::string& definition : definitions) {
    const auto equals = definition.find('=');
    if (equals == std::string::npos || equals == 0)
      throw UsageError("-D " + definition + ": got no name=value; write for instance -D sigma_t=25");
    map[definition.substr(0, equals)] = definition.substr(equals + 1);
  }
  return map;
}

void add_common_options(CLI::App& command, CommonOptions& options, const std::string& default_spp) {
  command.add_option("--device", options.device,
                     "Index, cpu, gpu or part of a device's name, or several of these between commas; default: "
                     "the environment variable ITN_DEVICE, else the first GPU, else the first CPU");
  command.add_option("--spp", options.spp, "Samples per pixel; default: " + default_spp)
      ->check(CLI::Range(1, std::numeric_limits<int>::max()));
  command.add_option("--seed", options.seed, "Seed of the random numbers; the same seed gives the same result")
      ->check(is_seed)
      ->capture_default_str();
  command.add_option("-D", options.definitions, "Fill $name in the scene file, given as name=value; may be repeated")
      ->type_size(1)
      ->allow_extra_args(false);
  command.add_flag("--quiet", options.quiet, "Print nothing but errors");
  command.add_option("--json", options.json, "Also write the result as JSON to this file; - is standard output");
  group_options(command, "Common options", {"--device", "--spp", "--seed", "-D", "--quiet", "--json"});
}

void add_open_option(CLI::App& command, CommonOptions& options) {
  command
      .add_flag("--open", options.open,
                "Render shapes that bound a medium but are not closed, as they are, instead of refusing them")
      ->group("Common options");
}

void group_options(CLI::App& command, const std::string& group, const std::vector<std::string>& names) {
  for (const std::string& name : names) command.get_option(name)->group(group);
}

void add_example(CLI::App& command, const std::string& example, const std::string& note) {
  command.footer((note.empty() ? "" : note + "\n\n") + example_heading + "\n  " + example);
}

void add_operator_option(CLI::App& command, Operator& op) {
  const std::map<std::string, Operator> operators{{"full", Operator::full}, {"single", Operator::single}};
  command.add_option("--operator", op, "Light to simulate: all of it (full), or one scattering in the medium (single)")
      ->transform(CLI::CheckedTransformer(operators).description("{full,single}"))
      ->default_str(name_of(op));
}

void add_sensor_option(CLI::App& command, int& sensor) {
  command.add_option("--sensor", sensor, "Index of the scene's sensor to use, from 0")
      ->check(CLI::Range(0, 1 << 20))
      ->capture_default_str();
}

void add_size_option(CLI::App& command, std::optional<FilmSize>& size) {
  const auto parse = [&size](const std::string& text) {
    FilmSize given;
    const char* end = text.data() + text.size();
    const auto [cross, no_width] = std::from_chars(text.data(), end, given.width);
    bool is_size = no_width == std::errc() && cross != end && *cross == 'x';
    if (is_size) {
      const auto [stop, no_height] = std::from_chars(cross + 1, end, given.height);
      is_size = no_height == std::errc() && stop == end;
    }
    if (!is_size || std::min(given.width, given.height) < 1 || std::max(given.width, given.height) > largest_film)
      throw UsageError(fmt::format("--size {}: need WIDTHxHEIGHT, each from 1 to {} pixels", text, largest_film));
    size = given;
  };
  command
      .add_option_function<std::string>("--size", parse,
                                        "Film size in pixels, instead of the scene's; a crop keeps its fraction")
      ->type_name("WxH");
}

std::string name_of(Operator op) { return op == Operator::single ? "single" : "full"; }

namespace {

// write: of a file.
template <class Write>
void write_json(const CommonOptions& options, const nlohmann::ordered_json& result, const Write& write) {
  if (options.json.empty()) return;
  // Names of files may be any bytes.
  nlohmann::ordered_json whole = result;
  if (const Ranks& ranks = world(); !ranks.alone())
    whole["ranks"] = {
        {"count", ranks.count()}, {"messages", ranks.traffic().messages}, {"bytes", ranks.traffic().bytes}};
  const std::string text = whole.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
  if (options.json != "-") return write(options.json, text);
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0)
    throw ResultError("standard output: the result cannot be written; is the disk full or the reader gone?");
}

}  // namespace

void write_json(const CommonOptions& options, const nlohmann::ordered_json& result) {
  write_json(options, result, [](const std::string& file, const std::string& text) { write_file(file, text); });
}

void write_private_json(const CommonOptions& options, const nlohmann::ordered_json& result) {
  write_json(options, result, write_private_file);
}

void check_outputs(const CommonOptions& options, std::vector<std::string> files, const std::vector<std::string>& own) {
  if (!options.json.empty() && options.json != "-") files.push_back(options.json);
  std::set<std::string> names;
  for (const std::string& file : own) names.insert(whole_name(file));
  for (const std::string& file : files) {
    if (file.empty()) throw UsageError("the name of a file to write is empty; choose another name");
    check_writable(file);
    const bool is_new = names.insert(whole_name(file)).second;
    std::error_code error;
    if (!is_new && !std::filesystem::is_other(file, error))  // a device takes any number
      throw UsageError(file + ": would be written twice by the same command; choose another name");
  }
}

void check_folder(const std::string& folder) {
  if (folder.empty()) throw UsageError("the name of a folder to write is empty; choose another name");
  std::error_code error;
  if (std::filesystem::exists(folder, error) && !std::filesystem::is_directory(folder, error))
    throw UsageError(folder + ": is there and no folder; choose another name");
}

void refuse_inside(const std::string& folder, const std::vector<std::string>& files) {
  const std::filesystem::path from = whole_name(folder);
  for (const std::string& file : files) {
    if (file.empty() || file == "-") continue;
    const std::filesystem::path inside = whole_name(file);
    if (std::mismatch(from.begin(), from.end(), inside.begin(), inside.end()).first == from.end())
      throw UsageError(file + ": is in " + folder +
                       ", which is read by the same command; choose a place outside of it");
  }
}

void warn(const CommonOptions& options, const std::string& text) {
  if (!options.quiet && world().is_first()) std::fprintf(stderr, "warning: %s\n", printable(text).c_str());
}

}  // namespace itn::tools
