// A graph as OpenCL C 1.2 in the dialect of kernels/shared/portable.h: the same text serves every width.
#pragma once
#include <string>
#include <vector>

#include "runtime/render/derivative/graph.h"

namespace itn {

struct Output {
  std::string name;  // what is assigned to: "d[2]", "*d_radiance"
  int node = -1;     // its value; -1: 0, without computing anything
};

// An inline function that takes `arguments` ("REAL alpha", "REAL3 wi", "REAL* d") and computes every sub-expression
// once. Throws std::logic_error for a constant beyond the range of single precision.
std::string print_function(const Graph& graph, const std::string& name, const std::vector<std::string>& arguments,
                           const std::vector<Output>& outputs);

}  // namespace itn
