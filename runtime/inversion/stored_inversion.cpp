#include "runtime/inversion/stored_inversion.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/base/error.h"
#include "runtime/base/file.h"
#include "runtime/base/random.h"
#include "runtime/inversion/inversion_outcome.h"
#include "runtime/inversion/state_json.h"

namespace itn {
namespace {

using Json = nlohmann::json;

// Infinity is stored as null.
double number_from(const Json& v) { return v.is_null() ? std::numeric_limits<double>::infinity() : v.get<double>(); }

Json stored(const StartedInversion& run) {
  Json steps = Json::array();
  for (const InversionStep& s : run.steps) steps.push_back({s.spp, s.x, s.loss, s.loss_stderr, s.accepted, s.distance});
  return {{"start", run.start}, {"state", run.state}, {"steps", steps}};
}

// What a state that was stored is always like: files may have been edited.
bool is_valid(const InversionState& s, std::size_t unknowns) {
  const auto all_finite = [](const std::vector<double>& v) {
    return std::all_of(v.begin(), v.end(), [](double x) { return std::isfinite(x); });
  };
  const auto of_unknowns = [&](const std::vector<double>& v) {
    return (v.empty() || v.size() == unknowns) && all_finite(v);
  };
  return s.x.size() == unknowns && all_finite(s.x) && s.iteration >= 0 && s.next_sample >= 0 && s.spp >= 1 &&
         s.reference_spp >= 0 && s.reference_sample >= 0 && of_unknowns(s.reference_x) && of_unknowns(s.accepted_x) &&
         of_unknowns(s.moments.first) && of_unknowns(s.moments.second) && all_finite(s.pool) &&
         NormalEquations::fits(unknowns, s.pool.size()) && std::isfinite(s.accepted_loss) &&
         s.accepted_loss_stderr >= 0 && s.damping > 0 && std::isfinite(s.damping);
}

StartedInversion started_from(const Json& j) {
  StartedInversion run{j.at("start").get<std::vector<double>>(), j.at("state").get<InversionState>(), {}};
  for (const Json& s : j.at("steps"))
    run.steps.push_back(
        {static_cast<int>(run.steps.size()), s.at(0), s.at(1), s.at(2), number_from(s.at(3)), s.at(4), s.at(5)});
  return run;
}

}  // namespace

std::vector<std::vector<double>> inversion_starts(const std::vector<Coordinate>& coordinates,
                                                  const std::vector<double>& first, int count, std::uint64_t seed) {
  std::vector<std::vector<double>> result{first};
  for (std::uint64_t k = 1; k < static_cast<std::uint64_t>(count); ++k) {
    std::vector<double> x;
    x.reserve(coordinates.size());
    for (const Coordinate& c : coordinates) x.push_back(c.start(random_uniform(seed, k, x.size())));
    result.push_back(std::move(x));
  }
  return result;
}

StoredInversion::StoredInversion(const std::string& folder, const StoredRun::Json& request, Inversion& inversion,
                                 const std::vector<Coordinate>& coordinates, std::vector<std::vector<double>> starts,
                                 std::size_t wanted)
    : folder_(folder, "state.json", "itn.invert.state/3", "an inversion"),
      request_(request),
      inversion_(inversion),
      coordinates_(coordinates),
      starts_(std::move(starts)),
      wanted_(wanted > 0 ? wanted : starts_.size()) {
  check_writable(folder_.run().file());
  folder_.run().require_same(request_);
  try {
    for (const StoredRun::Json& run : folder_.run().before("runs")) started_.push_back(started_from(run));
  } catch (const Json::exception&) {
    folder_.run().refuse();
  }
  const std::size_t unknowns = inversion_.names().size();
  const auto is_valid_run = [&](const StartedInversion& run) {
    return run.start.size() == coordinates_.size() && is_valid(run.state, unknowns) && !run.steps.empty() &&
           std::all_of(run.steps.begin(), run.steps.end(),
                       [&](const InversionStep& s) { return s.x.size() == unknowns && s.spp >= 1; });
  };
  if (started_.size() > starts_.size() || !std::all_of(started_.begin(), started_.end(), is_valid_run))
    folder_.run().refuse();
  for (std::size_t k = 0; k < started_.size(); ++k)
    if (started_[k].state.joined < -1 || started_[k].state.joined >= static_cast<int>(k)) folder_.run().refuse();
  wanted_ = std::max(wanted_, started_.size());
}

bool StoredInversion::finished() const { return started_.size() == wanted_ && started_.back().state.done; }

bool StoredInversion::another() {
  if (wanted_ == starts_.size()) return false;
  ++wanted_;
  return true;
}

void StoredInversion::join(std::size_t earlier) {
  InversionState& state = started_.back().state;
  state.done = true;
  state.joined = static_cast<int>(earlier);
  store();
}

const InversionStep& StoredInversion::advance() {
  if (started_.empty() || started_.back().state.done) {
    const std::vector<double>& start = starts_.at(started_.size());
    started_.push_back({start, inversion_.start(start), {}});
  }
  StartedInversion& run = started_.back();
  run.steps.push_back(inversion_.advance(run.state));
  store();
  return run.steps.back();
}

double StoredInversion::fraction(int most) const {
  if (started_.empty()) return 0;
  const double last = started_.back().state.done ? 1 : started_.back().state.iteration / static_cast<double>(most);
  return (static_cast<double>(current()) + last) / static_cast<double>(wanted_);
}

void StoredInversion::store() const {
  Json runs = Json::array();
  std::string lines;
  for (std::size_t k = 0; k < started_.size(); ++k) {
    runs.push_back(stored(started_[k]));
    for (const InversionStep& step : started_[k].steps) {
      StoredRun::Json line{{"start", k}};
      line.update(to_json(step, coordinates_));
      lines += line.dump() + "\n";
    }
  }
  write_file(folder_.file("iterations.jsonl"), lines);
  folder_.run().write(request_, {{"runs", runs}});
}

}  // namespace itn
