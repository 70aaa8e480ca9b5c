// A scalar that records what is computed with it: a formula of kernels/model run with REAL = Recorded leaves its
// expression in a Graph.
#pragma once
#include <stdexcept>

#include "runtime/render/derivative/graph.h"

namespace itn {

// A number or a mask: a node of a graph, or a constant that belongs to none yet.
template <bool is_mask>
class RecordedValue {
 public:
  RecordedValue(double constant = 0) : constant_(constant) {}  // implicit, as formulas mix numbers in
  RecordedValue(Graph& graph, int node) : graph_(&graph), node_(node) {}

  Graph* graph() const { return graph_; }  // null: a constant
  int node_in(Graph& graph) const {
    if (!graph_) return graph.number(constant_);
    if (graph_ != &graph) throw std::logic_error("a formula mixes two recordings");
    return node_;
  }

 private:
  Graph* graph_ = nullptr;
  int node_ = -1;
  double constant_ = 0;
};
using Recorded = RecordedValue<false>;
using RecordedMask = RecordedValue<true>;

// One operation. Constants alone fold by the rules of a graph of their own.
template <class Result, class... Operand>
Result record(Op op, const Operand&... operand) {
  Graph* graph = nullptr;
  ((graph = graph ? graph : operand.graph()), ...);
  Graph constants;
  const int node = (graph ? *graph : constants).make(op, operand.node_in(graph ? *graph : constants)...);
  if (graph) return Result(*graph, node);
  if (!constants.is_number(node)) throw std::domain_error("a formula's constants leave the domain of an operation");
  return Result(constants[node].number);
}

inline Recorded operator+(const Recorded& a, const Recorded& b) { return record<Recorded>(Op::add, a, b); }
inline Recorded operator-(const Recorded& a, const Recorded& b) { return record<Recorded>(Op::subtract, a, b); }
inline Recorded operator*(const Recorded& a, const Recorded& b) { return record<Recorded>(Op::multiply, a, b); }
inline Recorded operator/(const Recorded& a, const Recorded& b) { return a * record<Recorded>(Op::reciprocal, b); }
inline Recorded operator-(const Recorded& a) { return record<Recorded>(Op::negate, a); }
inline Recorded& operator+=(Recorded& a, const Recorded& b) { return a = a + b; }
inline Recorded& operator-=(Recorded& a, const Recorded& b) { return a = a - b; }
inline Recorded& operator*=(Recorded& a, const Recorded& b) { return a = a * b; }
inline Recorded& operator/=(Recorded& a, const Recorded& b) { return a = a / b; }

inline Recorded sqrt(const Recorded& a) { return record<Recorded>(Op::square_root, a); }
inline Recorded exp(const Recorded& a) { return record<Recorded>(Op::exponential, a); }
inline Recorded log(const Recorded& a) { return record<Recorded>(Op::logarithm, a); }
inline Recorded fabs(const Recorded& a) { return record<Recorded>(Op::absolute, a); }

inline RecordedMask operator<(const Recorded& a, const Recorded& b) { return record<RecordedMask>(Op::less, a, b); }
inline RecordedMask operator>(const Recorded& a, const Recorded& b) { return b < a; }
inline RecordedMask operator<=(const Recorded& a, const Recorded& b) {
  return record<RecordedMask>(Op::less_equal, a, b);
}
inline RecordedMask operator>=(const Recorded& a, const Recorded& b) { return b <= a; }
inline RecordedMask operator==(const Recorded& a, const Recorded& b) { return record<RecordedMask>(Op::equal, a, b); }
inline RecordedMask operator&(const RecordedMask& a, const RecordedMask& b) {
  return record<RecordedMask>(Op::both, a, b);
}
inline RecordedMask operator|(const RecordedMask& a, const RecordedMask& b) {
  return record<RecordedMask>(Op::either, a, b);
}
inline RecordedMask operator!(const RecordedMask& a) { return record<RecordedMask>(Op::inverse, a); }
inline RecordedMask operator!=(const Recorded& a, const Recorded& b) { return !(a == b); }

// SELECT, MIN and MAX of shared/portable.h
inline Recorded choose(const RecordedMask& mask, const Recorded& yes, const Recorded& no) {
  return record<Recorded>(Op::select, mask, yes, no);
}

}  // namespace itn
