#include "runtime/inverse/textures/stored_texture_inversion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <sstream>
#include <utility>

#include "itn/error.h"
#include "itn/file.h"
#include "runtime/base/json_text.h"

namespace itn {
namespace {

using Json = StoredRun::Json;

Json to_json(const TextureInversionStep& s) {
  return {{"repeat", s.repeat},
          {"iteration", s.iteration},
          {"loss", s.loss},
          {"loss_stderr", s.loss_stderr},
          {"roughness", s.roughness}};
}

TextureInversionStep step_from(const Json& j) {
  const Json& error = j.at("loss_stderr");
  return {whole<int>(j.at("repeat")), whole<int>(j.at("iteration")), j.at("loss"),
          error.is_null() ? std::numeric_limits<double>::infinity() : error.get<double>(), j.at("roughness")};
}

// After so many steps: the file before it stays whole until state.json names the next.
std::string unknowns_file(std::size_t steps) { return fmt::format("state-{}.bin", steps % 2); }

// The parts of a state that hold one number for each unknown.
std::vector<std::vector<double>*> parts_of(TextureInversionState& state) {
  return {&state.x, &state.moments.first, &state.moments.second, &state.found, &state.squares};
}

void append(const std::string& file, const std::string& line) {
  if (!is_writing()) return;
  std::ofstream out(file, std::ios::app | std::ios::binary);
  out << line;
  out.close();
  if (!out) throw ResultError(file + ": cannot be written");
}

}  // namespace

StoredTextureInversion::StoredTextureInversion(const std::string& folder, const StoredRun::Json& request,
                                               TextureInversion& inversion)
    : folder_(folder, "state.json", "itn.invert.textures.state/3", "an inversion"),
      request_(request),
      inversion_(inversion),
      state_(inversion.start()) {
  check_writable(folder_.run().file());
  folder_.run().require_same(request_);
  const Json stored = folder_.run().before("steps");
  if (!stored.is_null() && !stored.is_number_unsigned()) folder_.run().refuse();
  if (!stored.is_null()) load(stored.get<std::size_t>());
}

void StoredTextureInversion::load(std::size_t steps) {
  std::istringstream lines(read_file(folder_.file("iterations.jsonl")));
  std::string line, kept;
  try {
    while (steps_.size() < steps && std::getline(lines, line)) {
      steps_.push_back(step_from(parse_json<Json>(line, folder_.file("iterations.jsonl"))));
      kept += line + "\n";
    }
    state_.iteration = whole<int>(folder_.run().before("iteration"));
    state_.repeat = whole<int>(folder_.run().before("repeat"));
    state_.finished = folder_.run().before("finished");
  } catch (const Json::exception&) {
    folder_.run().refuse();
  }
  const std::string bytes = read_file(folder_.file(unknowns_file(steps)));
  lines_ = fingerprint(kept);
  for (const auto& [key, found] : {std::pair{"lines", fingerprint_text(lines_)}, {"unknowns", fingerprint_text(bytes)}})
    if (folder_.run().before(key) != Json(found))
      throw InputError(
          fmt::format("{}: the {} beside it have changed since it was written; remove its folder to begin anew",
                      folder_.run().file(), key));
  const std::vector<std::vector<double>*> parts = parts_of(state_);
  const std::size_t count = state_.x.size(), part = count * sizeof(double);
  if (state_.iteration < 0 || state_.repeat < 0 || steps_.size() != steps || bytes.size() != parts.size() * part)
    folder_.run().refuse();
  for (std::size_t k = 0; k < parts.size(); ++k) {
    parts[k]->resize(count);
    std::memcpy(parts[k]->data(), bytes.data() + k * part, part);
    const bool endless = parts[k] == &state_.squares;  // of what no path has seen
    const auto good = [endless](double x) { return std::isfinite(x) || (endless && x > 0); };
    if (!std::all_of(parts[k]->begin(), parts[k]->end(), good)) folder_.run().refuse();
  }
  write_file(folder_.file("iterations.jsonl"), kept);  // without a step that was not stored
}

const TextureInversionStep& StoredTextureInversion::advance() {
  if (steps_.empty()) write_file(folder_.file("iterations.jsonl"), "");
  steps_.push_back(inversion_.advance(state_));
  store();
  return steps_.back();
}

void StoredTextureInversion::store() {
  std::string bytes;
  for (std::vector<double>* part : parts_of(state_)) {
    const std::size_t at = bytes.size(), size = state_.x.size() * sizeof(double);
    part->resize(state_.x.size());  // what is not there yet is 0
    bytes.resize(at + size);
    std::memcpy(bytes.data() + at, part->data(), size);
  }
  write_file(folder_.file(unknowns_file(steps_.size())), bytes);
  const std::string line = to_json(steps_.back()).dump() + "\n";
  lines_ = fingerprint(line, lines_);
  append(folder_.file("iterations.jsonl"), line);
  folder_.run().write(request_, {{"steps", steps_.size()},
                                 {"iteration", state_.iteration},
                                 {"repeat", state_.repeat},
                                 {"finished", state_.finished},
                                 {"unknowns", fingerprint_text(bytes)},
                                 {"lines", fingerprint_text(lines_)}});
}

}  // namespace itn
