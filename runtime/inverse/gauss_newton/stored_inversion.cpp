#include "runtime/inverse/gauss_newton/stored_inversion.h"

#include <algorithm>

#include "itn/file.h"
#include "runtime/base/random.h"
#include "runtime/inverse/gauss_newton/inversion_outcome.h"
#include "runtime/inverse/posterior/natural_range.h"

namespace itn {
std::vector<std::vector<double>> inversion_starts(const std::vector<Coordinate>& coordinates,
                                                  const std::vector<double>& first, int count, std::uint64_t seed,
                                                  const std::map<std::string, std::pair<double, double>>& ranges) {
  std::vector<std::vector<double>> result;
  for (std::uint64_t k = 0; k < static_cast<std::uint64_t>(std::max(1, count)); ++k) {
    std::vector<double> x = first;
    for (std::size_t p = 0; p < coordinates.size(); ++p) {
      const Coordinate& c = coordinates[p];
      const auto range = ranges.find(c.parameter().name);
      const double u = k == 0 ? 0.5 : random_uniform(seed, k, p);
      if (range == ranges.end()) {
        if (k > 0) x[p] = c.start(u);
        continue;
      }
      const auto& [low, high] = range->second;
      const bool inside = low <= c.value(first[p]) && c.value(first[p]) <= high;
      if (k > 0 || !inside) x[p] = c.of(NaturalRange(c.parameter(), low, high).value(2 * u - 1));
    }
    result.push_back(std::move(x));
  }
  return result;
}

StoredInversion::StoredInversion(const std::string& folder, const StoredRun::Json& request, Inversion& inversion,
                                 const std::vector<Coordinate>& coordinates, std::vector<std::vector<double>> starts,
                                 std::size_t wanted)
    : folder_(folder, "state.json", "itn.invert.state/4", "an inversion"),
      request_(request),
      inversion_(inversion),
      coordinates_(coordinates),
      starts_(std::move(starts)),
      wanted_(wanted > 0 ? wanted : starts_.size()) {
  check_writable(folder_.run().file());
  folder_.run().require_same(request_);
  started_ = started_inversions(folder_.run(), {coordinates_.size(), inversion_.names().size(), starts_.size()});
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
  nlohmann::json runs = nlohmann::json::array();
  std::string lines;
  for (std::size_t k = 0; k < started_.size(); ++k) {
    runs.push_back(stored_json(started_[k]));
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
