#include "tools/common.h"

#include <fmt/format.h>

#include <charconv>
#include <cstdio>
#include <limits>

#include "runtime/error.h"
#include "runtime/fingerprint.h"
#include "runtime/image/file.h"

namespace itn::tools {
namespace {

// CLI11 takes -1 for 2^64 - 1.
std::string is_seed(const std::string& text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error == std::errc() && end == text.data() + text.size()) return "";
  return "got " + text + ", need a whole number from 0 to 2^64 - 1";
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
                     "index, cpu, gpu or part of a name (itn devices lists them); else the environment variable "
                     "ITN_DEVICE, else the first GPU, else the first CPU");
  command.add_option("--spp", options.spp, "samples a pixel; default: " + default_spp)
      ->check(CLI::Range(1, std::numeric_limits<int>::max()));
  command.add_option("--seed", options.seed, "of the random numbers: the same seed gives the same result")
      ->check(is_seed)
      ->capture_default_str();
  command.add_option("-D", options.definitions, "name=value: fills $name in the scene; may be repeated")
      ->type_size(1)
      ->allow_extra_args(false);
  command.add_flag("--quiet", options.quiet, "print nothing but errors");
  command.add_option("--json", options.json, "also write the result as JSON to this file; - is standard output");
}

void add_operator_option(CLI::App& command, Operator& op) {
  const std::map<std::string, Operator> operators{{"full", Operator::full}, {"single", Operator::single}};
  command.add_option("--operator", op, "full: all light; single: one scattering in the medium")
      ->transform(CLI::CheckedTransformer(operators).description("{full,single}"))
      ->default_str(name_of(op));
}

void add_sensor_option(CLI::App& command, int& sensor) {
  command.add_option("--sensor", sensor, "which of the scene's sensors, from 0")
      ->check(CLI::Range(0, 1 << 20))
      ->capture_default_str();
}

std::string name_of(Operator op) { return op == Operator::single ? "single" : "full"; }

void write_json(const CommonOptions& options, const nlohmann::ordered_json& result) {
  if (options.json.empty()) return;
  const std::string text = result.dump(2) + "\n";
  if (options.json != "-") return write_file(options.json, text);
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0)
    throw ResultError("standard output: the result cannot be written; is the disk full or the reader gone?");
}

std::string fingerprint_of(const std::string& file) { return fmt::format("{:016x}", fingerprint(read_file(file))); }

void warn(const CommonOptions& options, const std::string& text) {
  if (!options.quiet) std::fprintf(stderr, "warning: %s\n", text.c_str());
}

}  // namespace itn::tools
