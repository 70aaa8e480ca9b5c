#include "runtime/inversion/stored_texture_inversion.h"

#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "runtime/base/file.h"

namespace itn {
namespace {

using Json = StoredRun::Json;

// JSON has no infinity: a standard error that is not known becomes null.
Json number(double v) { return std::isfinite(v) ? Json(v) : Json(); }

Json to_json(const TextureInversionStep& s) {
  return {
      {"iteration", s.iteration}, {"loss", s.loss}, {"loss_stderr", number(s.loss_stderr)}, {"roughness", s.roughness}};
}

TextureInversionStep step_from(const Json& j) {
  const Json& error = j.at("loss_stderr");
  return {j.at("iteration"), j.at("loss"),
          error.is_null() ? std::numeric_limits<double>::infinity() : error.get<double>(), j.at("roughness")};
}

// Of an iteration: the file before it stays whole until state.json names the next.
std::string texels_file(int iteration) { return fmt::format("state-{}.bin", iteration % 2); }

}  // namespace

StoredTextureInversion::StoredTextureInversion(const std::string& folder, const StoredRun::Json& request,
                                               TextureInversion& inversion)
    : folder_(folder, "state.json", "itn.invert.textures.state/1", "an inversion"),
      request_(request),
      inversion_(inversion),
      state_(inversion.start()) {
  check_writable(folder_.run().file());
  folder_.run().require_same(request_);
  const Json stored = folder_.run().before("steps");
  if (!stored.is_null()) load(stored);
}

void StoredTextureInversion::load(const StoredRun::Json& stored) {
  try {
    for (const Json& step : stored) steps_.push_back(step_from(step));
  } catch (const Json::exception&) {
    folder_.run().refuse();
  }
  state_.iteration = static_cast<int>(steps_.size());
  if (steps_.empty()) return;
  const std::string bytes = read_file(folder_.file(texels_file(state_.iteration)));
  const std::size_t part = state_.x.size() * sizeof(double);
  if (bytes.size() != 3 * part) folder_.run().refuse();
  state_.moments.first.resize(state_.x.size());
  state_.moments.second.resize(state_.x.size());
  std::memcpy(state_.x.data(), bytes.data(), part);
  std::memcpy(state_.moments.first.data(), bytes.data() + part, part);
  std::memcpy(state_.moments.second.data(), bytes.data() + 2 * part, part);
}

const TextureInversionStep& StoredTextureInversion::advance() {
  steps_.push_back(inversion_.advance(state_));
  store();
  return steps_.back();
}

void StoredTextureInversion::store() const {
  std::string bytes, lines;
  for (const auto* numbers : {&state_.x, &state_.moments.first, &state_.moments.second}) {
    const std::size_t at = bytes.size(), size = numbers->size() * sizeof(double);
    bytes.resize(at + size);
    std::memcpy(bytes.data() + at, numbers->data(), size);
  }
  Json steps = Json::array();
  for (const TextureInversionStep& step : steps_) {
    steps.push_back(to_json(step));
    lines += steps.back().dump() + "\n";
  }
  write_file(folder_.file(texels_file(state_.iteration)), bytes);
  write_file(folder_.file("iterations.jsonl"), lines);
  folder_.run().write(request_, {{"steps", steps}});
}

}  // namespace itn
