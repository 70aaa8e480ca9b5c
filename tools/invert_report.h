// What itn invert leaves in its folder beside its state: result.json, images, pictures, report.html.
#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "runtime/inversion/inversion.h"
#include "runtime/inversion/uncertainty.h"

namespace itn::tools {

struct InversionRun {
  std::vector<double> start;  // values of the parameters
  std::vector<InversionStep> steps;
  Inversion::Conclusion end;
};

struct InversionOutcome {
  std::string scene, method, folder;
  std::vector<std::string> targets;  // files
  std::vector<std::string> prior;    // as --prior says it
  bool noise_known = false;          // from the targets' files or the command line
  std::vector<InversionRun> runs;    // one a start
  std::size_t best = 0;              // of them: the smallest loss
  std::vector<Interval> parameters, coefficients, exposures;
  std::vector<Direction> directions;
  double seconds = 0;

  const InversionRun& found() const { return runs[best]; }
  bool converged() const { return found().end.converged; }
};

nlohmann::ordered_json to_json(const InversionStep& step, const std::vector<Coordinate>& coordinates);
nlohmann::ordered_json to_json(const InversionOutcome& outcome, const std::vector<Coordinate>& coordinates);

// Sentences that say how it ended and what to think of it.
std::vector<std::string> verdict(const InversionOutcome& outcome, const std::vector<Coordinate>& coordinates);
// One a direction, from the best known to the worst.
std::vector<std::string> ambiguity_words(const InversionOutcome& outcome, const std::vector<Coordinate>& coordinates);

// Throws ResultError where the folder takes no files.
void write_inversion(const InversionOutcome& outcome, const std::vector<Coordinate>& coordinates,
                     const std::vector<TargetImage>& targets);

}  // namespace itn::tools
