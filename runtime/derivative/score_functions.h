// The derivatives that path tracing needs, printed as OpenCL C from the formulas of kernels/model: for every factor f
// of a path's throughput its scores d log f / d parameter, and the derivative of the sky's radiance.
#pragma once
#include <map>
#include <set>
#include <string>
#include <vector>

#include "runtime/derivative/graph.h"

namespace itn {

// One formula, recorded and differentiated.
struct ScoreFunction {
  std::string name;                     // of the OpenCL function
  std::string formula;                  // f in words
  std::vector<std::string> arguments;   // of the OpenCL function, as declared: "REAL g"; then come its outputs,
  std::vector<std::string> parameters;  // for each parameter one "REAL* d_<parameter>"
  Graph graph;
  int value = -1;                // f
  std::vector<int> derivatives;  // one a parameter: of log f, or of f where the name does not begin with "score"
};

// Every function there is. Signatures, meaning and use: README.md of this folder.
const std::vector<ScoreFunction>& score_functions();

// Function -> the parameters asked for.
using ScoreRequest = std::map<std::string, std::set<std::string>>;

// OpenCL C of every function, so that callers need no #if: outputs that are not asked for are set to 0 and cost
// nothing. To be read after shared/portable.h. Throws std::invalid_argument for a function or a parameter that is not
// there.
std::string print_scores(const ScoreRequest& wanted);

}  // namespace itn
