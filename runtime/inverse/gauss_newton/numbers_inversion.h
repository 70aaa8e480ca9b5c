// An inversion of numbers (not of textures) as the command line and Python ask for it: what may be asked together, and
// what is done where nothing was said.
#pragma once
#include <chrono>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "runtime/inverse/gauss_newton/inversion_outcome.h"
#include "runtime/inverse/posterior/posterior_outcome.h"

namespace itn {

using NamedIntervals = std::map<std::string, std::pair<double, double>>;  // of parameters: low, high

struct NumbersQuestion {
  std::string scene, folder;
  std::vector<std::string> targets;  // what they are called in reports
  std::string method;  // "gauss-newton", "adam", "posterior"; empty: posterior where it can be, else gauss-newton
  int spp = 0, iterations = 0;  // 0: the method's own
  int starts = 0;               // 0: one with Adam, as many as it takes with Gauss-Newton
  bool started = false;         // the first start was chosen: by values, or by a network
  TargetNoise noise;
  double learning_rate = 0.05;  // of Adam
  bool exposure = false, white_balance = false;
  NamedIntervals prior;    // 95 %
  NamedIntervals range;    // ranges of the posterior
  std::string renderings;  // the folder where the posterior keeps them; empty: one in its own
  std::uint64_t seed = 0;
  StoredRun::Json request;   // all that the numbers depend on, but for the method
  StoredRun::Json of_scene;  // all that a rendering depends on, but for its samples and the parameters' values
  bool alone = true;         // no other ranks share the renderings, which is not for a posterior
  std::chrono::steady_clock::time_point begun = std::chrono::steady_clock::now();
};

// A network's prediction of the parameters: Gauss-Newton's prior where the question has none (NetworkGuess).
struct NetworkPrior {
  Prior prior;
  std::vector<std::string> words;
  std::string doubt;
};

struct NumbersWatch {  // any may be empty
  std::function<void(const StoredInversion&, const InversionStep&, int most_iterations)> on_step;
  std::function<void(const StoredPosterior&, const std::vector<NaturalRange>&)> on_rendering;  // and after each round
};

struct NumbersAnswer {                        // one of the two
  std::optional<InversionOutcome> inversion;  // of Gauss-Newton or Adam
  std::optional<PosteriorOutcome> posterior;

  bool converged() const;
  const std::vector<Rendering>& images() const;
  const std::string& folder() const;
};

// Throws UsageError: what does not go together.
void check(const NumbersQuestion& question, const std::vector<TargetImage>& targets);

// check() and then all that is asked for, with reports in the folder. scene: with the values of the first start; model:
// of that scene. Throws as StoredInversion, StoredPosterior and natural_ranges(), and Interrupted.
NumbersAnswer invert_numbers(const NumbersQuestion& question, const NetworkPrior& network, const Scene& scene,
                             const std::vector<TargetImage>& targets, ForwardModel& model, const NumbersWatch& watch);

nlohmann::ordered_json to_json(const NumbersAnswer& answer, const std::vector<Coordinate>& coordinates);
std::vector<std::string> verdict(const NumbersAnswer& answer, const std::vector<Coordinate>& coordinates);
std::string failure(const NumbersAnswer& answer);
std::vector<std::string> ambiguity_words(const NumbersAnswer& answer, const std::vector<Coordinate>& coordinates);

}  // namespace itn
