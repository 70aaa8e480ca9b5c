#include "network/evaluation/evaluated_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <sstream>

#include "itn/error.h"
#include "itn/file.h"
#include "itn/trained_network.h"
#include "runtime/base/json_text.h"

namespace itn {
namespace {

std::size_t output_of(const NetworkDescription& network, const std::string& name, const std::string& file) {
  for (std::size_t i = 0; i < network.outputs.size(); ++i)
    if (network.outputs[i].name == name) return i;
  throw InputError(fmt::format("{}: its network does not predict {}", file, name));
}

std::vector<nlohmann::json> read_curve(const std::string& file) {
  std::vector<nlohmann::json> curve;
  if (!is_there(file)) return curve;
  std::istringstream lines(read_file(file));
  for (std::string line; std::getline(lines, line);) {
    curve.push_back(parse_json<nlohmann::json>(line, fmt::format("{}:{}", file, curve.size() + 1)));
    const nlohmann::json& point = curve.back();
    if (!point.is_object() || !point.contains("epoch") || !point.contains("supervised") ||
        !point.contains("validation"))
      throw InputError(fmt::format("{}:{}: no line of a learning curve", file, curve.size()));
  }
  return curve;
}

// Warnings for readers of the report, from run.json.
std::vector<std::string> warnings_of(const std::string& run, const Manifest& set) {
  const std::string file = (std::filesystem::path(run) / "run.json").string();
  if (!is_there(file)) return {};
  const auto json = parse_json<nlohmann::json>(read_file(file), file);
  std::vector<std::string> warnings;
  try {
    if (!json.value("complete", true)) warnings.push_back(run + ": its training has not ended");
    const nlohmann::json request = json.value("request", nlohmann::json::object());
    if (request.value("data", set.hash).find(set.hash) == std::string::npos)
      warnings.push_back(run + ": was trained on another data set, so `training` is not what it has learnt from");
  } catch (const nlohmann::json::exception& error) {
    throw InputError(file + ": not by itn train; " + error.what());
  }
  return warnings;
}

}  // namespace

EvaluatedRun read_run(const std::string& path, const Manifest& set) {
  Network network = network_of(path);
  const NetworkDescription& description = network.description();
  if (description.size != set.size)
    throw InputError(
        fmt::format("{0}: its network sees images of {1} x {1} pixels, those of the data set have {2} x {2}", path,
                    description.size, set.size));
  if (std::abs(description.mm_per_unit / set.mm_per_unit - 1) > 1e-9)
    throw InputError(fmt::format("{}: it has learnt objects of {} mm a scene unit, those of the data set have {} mm",
                                 path, description.mm_per_unit, set.mm_per_unit));
  std::array<std::size_t, 3> output{};
  for (std::size_t p = 0; p < 3; ++p) output[p] = output_of(description, parameter_names[p], path);
  const std::string kind = description.kind;
  EvaluatedRun run{path, kind, std::move(network), output, network_fingerprint(path), {}, {}};
  if (is_folder(path)) {
    run.curve = read_curve((std::filesystem::path(path) / "curve.jsonl").string());
    run.warnings = warnings_of(path, set);
  }
  return run;
}

std::string Kind::title() const {
  std::string text = name;
  for (char& c : text) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return text;
}

std::vector<Kind> kinds_of(const std::vector<EvaluatedRun>& runs) {
  std::vector<Kind> kinds;
  for (const char* name : {"rn", "itn", "ssn"}) {
    Kind kind{name, {}};
    for (std::size_t r = 0; r < runs.size(); ++r)
      if (runs[r].kind == name) kind.runs.push_back(r);
    if (!kind.runs.empty()) kinds.push_back(std::move(kind));
  }
  return kinds;
}

}  // namespace itn
