#include "runtime/inverse/gauss_newton/started_inversion.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/base/json_text.h"
#include "runtime/inverse/state_json.h"

namespace itn {
namespace {

using Json = nlohmann::json;

// Infinity is stored as null.
double number_from(const Json& v) { return v.is_null() ? std::numeric_limits<double>::infinity() : v.get<double>(); }

// Checks a stored state's sizes and ranges: its file may have been edited.
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
  for (const char* key : {"iteration", "spp", "next_sample", "joined", "reference_spp", "reference_sample"})
    whole<int>(j.at("state").at(key));
  StartedInversion run{j.at("start").get<std::vector<double>>(), j.at("state").get<InversionState>(), {}};
  for (const Json& s : j.at("steps"))
    run.steps.push_back({static_cast<int>(run.steps.size()), whole<int>(s.at(0)), s.at(1), s.at(2),
                         number_from(s.at(3)), s.at(4), s.at(5)});
  return run;
}

}  // namespace

Json stored_json(const StartedInversion& run) {
  Json steps = Json::array();
  for (const InversionStep& s : run.steps) steps.push_back({s.spp, s.x, s.loss, s.loss_stderr, s.accepted, s.distance});
  return {{"start", run.start}, {"state", run.state}, {"steps", steps}};
}

std::vector<StartedInversion> started_inversions(const StoredRun& run, const InversionSizes& sizes) {
  std::vector<StartedInversion> started;
  try {
    for (const StoredRun::Json& each : run.before("runs")) started.push_back(started_from(each));
  } catch (const Json::exception&) {
    run.refuse();
  }
  const auto is_valid_run = [&](const StartedInversion& each) {
    return each.start.size() == sizes.coordinates && is_valid(each.state, sizes.unknowns) && !each.steps.empty() &&
           std::all_of(each.steps.begin(), each.steps.end(),
                       [&](const InversionStep& s) { return s.x.size() == sizes.unknowns && s.spp >= 1; });
  };
  if (started.size() > sizes.starts || !std::all_of(started.begin(), started.end(), is_valid_run)) run.refuse();
  for (std::size_t k = 0; k < started.size(); ++k)
    if (started[k].state.joined < -1 || started[k].state.joined >= static_cast<int>(k)) run.refuse();
  return started;
}

}  // namespace itn
