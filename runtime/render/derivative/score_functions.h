// The derivatives that path tracing needs, printed as OpenCL C from the formulas of kernels/model: for every factor f
// of a path's throughput its scores d log f / d number, and the derivative of the sky's radiance.
#pragma once
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "runtime/render/derivative/graph.h"

namespace itn {

// One formula, recorded and differentiated.
struct ScoreFunction {
  std::string name;                    // of the OpenCL function
  std::string formula;                 // f in words
  std::vector<std::string> arguments;  // of the OpenCL function, as declared: "const REAL* n", "REAL3 wi"
  Graph graph;
  std::vector<int> values;  // f, a channel each; one where all are the same
  // d log f[channel] / d n[slot], where it is not 0; of all channels the same node where they do not differ. Of what is
  // no score: df in the place of {0, 0}.
  std::map<std::pair<int, int>, int> derivatives;

  // Is the derivative by n[slot] the same in all channels?
  bool same_in_all_channels(int slot) const;
  // The inputs ("n[3]", "wi.x") that the derivative by n[slot] in a channel depends on.
  std::set<std::string> inputs_of(int slot, int channel) const;
};

// Names of all functions, from the lists of kernels/model. Signatures, meaning and use: README.md of this folder.
std::vector<std::string> score_function_names();
// Recorded when it is first asked for. Throws std::invalid_argument: there is none of that name.
const ScoreFunction& score_function(const std::string& name);

// The function of a structure's value, or of what it chooses.
struct Structure;
const ScoreFunction& score_function(const Structure& structure, bool chosen);
// The function of a phase function, also of a table or a mixture.
struct Model;
const ScoreFunction& score_function(const Model& phase);

// Function -> the slots asked for; those of derivatives that are no score: {0}.
using ScoreRequest = std::map<std::string, std::set<int>>;

// OpenCL C of every function, so that callers need no #if: what is not asked for is set to 0 and costs nothing, a
// function of which nothing is asked for not even its recording. channels: of the throughput, 1 or 3; d[slot * channels
// + channel] is d log f[channel] / d n[slot]. To be read after shared/portable.h. Throws std::invalid_argument for a
// function or a slot that is not there. made: models that are made for the program's scenes (compile/surfaces.h), whose
// functions come with the others.
std::string print_scores(const ScoreRequest& wanted, int channels, const std::vector<const Model*>& made = {});

}  // namespace itn
