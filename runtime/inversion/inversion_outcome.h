// What came out of an inversion from one or several starts: intervals, what the images tell apart, and words for it.
#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "runtime/inversion/stored_inversion.h"
#include "runtime/inversion/uncertainty.h"

namespace itn {

struct InversionRun {
  std::vector<double> start;  // values of the parameters
  std::vector<InversionStep> steps;
  Inversion::Conclusion end;
};

// What was asked, for reports.
struct InversionQuestion {
  std::string scene, method, folder;
  std::vector<std::string> targets;  // files
  std::vector<std::string> prior;    // NAME=LOW,HIGH
  bool noise_known = false;          // from the targets' files or from the user
};

struct InversionOutcome {
  InversionQuestion question;
  std::vector<InversionRun> runs;  // one a start
  std::size_t best = 0;            // of them: the smallest loss
  std::vector<Interval> parameters, coefficients, exposures;
  std::vector<Direction> directions;
  double seconds = 0;

  const InversionRun& found() const { return runs[best]; }
  bool converged() const { return found().end.converged; }
};

// Renders where every start ended. scene: what was inverted, with any values of the parameters. Throws Interrupted.
InversionOutcome conclude(const InversionQuestion& question, Inversion& inversion,
                          const std::vector<Coordinate>& coordinates, Scene scene,
                          const std::vector<StartedInversion>& started);

nlohmann::ordered_json to_json(const InversionStep& step, const std::vector<Coordinate>& coordinates);
nlohmann::ordered_json to_json(const InversionOutcome& outcome, const std::vector<Coordinate>& coordinates);

// Sentences that say how it ended and what to think of it.
std::vector<std::string> verdict(const InversionOutcome& outcome, const std::vector<Coordinate>& coordinates);
// One a direction, from the best known to the worst.
std::vector<std::string> ambiguity_words(const InversionOutcome& outcome, const std::vector<Coordinate>& coordinates);

// Of every method's outcome. deviation: what the length of a direction is, such as "standard error".
std::vector<std::string> ambiguity_words(const std::vector<Direction>& directions,
                                         const std::vector<Coordinate>& coordinates, const std::string& deviation);
nlohmann::ordered_json to_json(const std::vector<Direction>& directions, const std::vector<Coordinate>& coordinates,
                               const std::string& deviation);
nlohmann::ordered_json to_json(const std::vector<Interval>& intervals);

}  // namespace itn
