// The outcome of an inversion from one or several starts: intervals, the directions that the images tell apart, and
// sentences for people.
//
// From far away Gauss-Newton may end in another minimum, and small intervals there say nothing of the right one; often
// even its image fits, until another start finds one that fits better. So further starts follow (each is given up as
// soon as it comes near an earlier end), until two of them agree in the best, and what is left of the image is noise.
#pragma once
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "runtime/inverse/gauss_newton/stored_inversion.h"
#include "runtime/inverse/gauss_newton/uncertainty.h"
#include "runtime/inverse/misfit.h"

namespace itn {

struct InversionRun {
  std::vector<double> start;  // values of the parameters
  std::vector<InversionStep> steps;
  Inversion::Conclusion end;
  int joined = -1;  // the run whose end this one was heading for, and has
};

// The ends of several runs compared.
struct Agreement {
  std::size_t count = 0;  // of the runs
  std::size_t best = 0;   // what is left of the targets is least; of those that are as good, one that converged and
                          // leaves no pattern
  std::size_t same = 0;   // runs that end there, itself included
  std::vector<std::size_t>
      rivals;  // one of each group that converged elsewhere, and fits as well as the noise can tell

  // Nothing more is to be learnt from another start: or of the first few none converged, and others would not.
  bool sure(const Inversion::Conclusion& best_end) const;
};
Agreement agreement(const std::vector<InversionRun>& runs);

// The user's question, for reports.
struct InversionQuestion {
  std::string scene, method, folder;
  std::vector<std::string> targets;  // files
  std::vector<std::string> prior;    // NAME=LOW,HIGH
  bool noise_known = false;          // from the targets' files or from the user
  std::string doubt{};               // of the first target, by the judge of the network that the start is from
};

struct InversionOutcome {
  InversionQuestion question;
  std::vector<InversionRun> runs;  // one a start
  Agreement agreement;             // of Gauss-Newton's
  std::vector<Interval> parameters, coefficients, exposures;
  std::vector<Direction> directions;
  Misfit misfit;
  double seconds = 0;

  const InversionRun& found() const { return runs[agreement.best]; }
  // It stands still, its image fits, and of Gauss-Newton's other starts none has ended elsewhere and fits as well. Ends
  // that fit worse say nothing against it. Else the intervals do not hold.
  bool converged() const;
};

// Least and greatest number of starts where the user gives none.
constexpr std::size_t least_starts = 4, most_starts = 8;

// Runs all that is wanted of `stored` to its end, and renders there. Gauss-Newton: until_sure asks for further starts
// as long as they may tell something. scene: what was inverted, with any values of the parameters. on_step is told of
// every iteration. Throws Interrupted.
InversionOutcome invert(const InversionQuestion& question, Inversion& inversion,
                        const std::vector<Coordinate>& coordinates, Scene scene, StoredInversion& stored,
                        bool until_sure, const std::function<void(const InversionStep&)>& on_step);

nlohmann::ordered_json to_json(const InversionStep& step, const std::vector<Coordinate>& coordinates);
nlohmann::ordered_json to_json(const InversionOutcome& outcome, const std::vector<Coordinate>& coordinates);

// Sentences that say how it ended and what to think of it.
std::vector<std::string> verdict(const InversionOutcome& outcome, const std::vector<Coordinate>& coordinates);
// One a direction, from the best known to the worst.
std::vector<std::string> ambiguity_words(const InversionOutcome& outcome, const std::vector<Coordinate>& coordinates);

// The same for every method's outcome. deviation: the unit of a direction's length, such as "standard error".
std::vector<std::string> ambiguity_words(const std::vector<Direction>& directions,
                                         const std::vector<Coordinate>& coordinates, const std::string& deviation);
nlohmann::ordered_json to_json(const std::vector<Direction>& directions, const std::vector<Coordinate>& coordinates,
                               const std::string& deviation);
nlohmann::ordered_json to_json(const std::vector<Interval>& intervals);
// " (does not hold)" of an interval that does not, else nothing.
std::string mark(const Interval& interval);
// One sentence about a result that failed: what is wrong, and the likely reason. Empty: nothing is.
std::string failure(const InversionOutcome& outcome);

}  // namespace itn
