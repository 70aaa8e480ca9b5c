// Derivatives of a recorded formula, as nodes of the same graph.
#pragma once
#include <map>

#include "runtime/render/derivative/graph.h"

namespace itn {

// Forward mode: the derivative of any node along one direction of the inputs. Nodes that are reached several times are
// differentiated once; what two directions have in common is one node of the graph by itself. (Reverse mode would give
// a select's branches a zero adjoint that multiplies an infinite derivative: NaN. Here a select's derivative is the
// select of its branches' derivatives. Formulas have few parameters, so the other reason for reverse mode is missing.)
//
// At a kink: |x| at 0 has the derivative on the right, sqrt(0) the derivative 0; MIN and MAX take the branch that their
// value takes.
class Differentiator {
 public:
  // tangent: for each input that moves, the node that says how fast. One input alone, at speed 1: {{input, number(1)}}.
  Differentiator(Graph& graph, std::map<int, int> tangent) : graph_(graph), tangent_(std::move(tangent)) {}

  int derivative(int node);
  // Derivative of log |node|, from the factors' logarithms: needs neither the node's value nor its size, so it stays
  // right where the value underflows. 0 where a sum among the factors vanishes; infinite where an input among them
  // does.
  int log_derivative(int node);

 private:
  int make(Op op, int a, int b = -1, int c = -1) { return graph_.make(op, a, b, c); }
  int differentiate(int node);
  int differentiate_log(int node);

  Graph& graph_;
  std::map<int, int> tangent_, known_, known_log_;
};

}  // namespace itn
