#include "runtime/render/derivative/differentiate.h"

#include <limits>
#include <stdexcept>

namespace itn {

int Differentiator::derivative(int node) {
  if (const auto found = known_.find(node); found != known_.end()) return found->second;
  const int result = differentiate(node);
  known_[node] = result;
  return result;
}

int Differentiator::log_derivative(int node) {
  if (const auto found = known_log_.find(node); found != known_log_.end()) return found->second;
  const int result = differentiate_log(node);
  known_log_[node] = result;
  return result;
}

int Differentiator::differentiate(int node) {
  const Node n = graph_[node];  // a copy: the graph grows
  const int zero = graph_.number(0);
  switch (n.op) {
    case Op::number:
      return zero;
    case Op::input: {
      const auto found = tangent_.find(node);
      return found == tangent_.end() ? zero : found->second;
    }
    case Op::add:
    case Op::subtract:
      return make(n.op, derivative(n.a), derivative(n.b));
    case Op::multiply:
      return make(Op::add, make(Op::multiply, derivative(n.a), n.b), make(Op::multiply, n.a, derivative(n.b)));
    case Op::negate:
      return make(Op::negate, derivative(n.a));
    case Op::reciprocal:
      return make(Op::negate, make(Op::multiply, make(Op::multiply, derivative(n.a), node), node));
    case Op::square_root: {
      const int slope = make(Op::multiply, graph_.number(0.5), make(Op::reciprocal, node));
      const int guarded = make(Op::select, make(Op::equal, node, zero), zero, slope);
      return make(Op::multiply, derivative(n.a), guarded);
    }
    case Op::exponential:
      return make(Op::multiply, derivative(n.a), node);
    case Op::logarithm:
      return make(Op::multiply, derivative(n.a), make(Op::reciprocal, n.a));
    case Op::absolute: {
      const int d = derivative(n.a);
      return make(Op::select, make(Op::less, n.a, zero), make(Op::negate, d), d);
    }
    case Op::select:
      return make(Op::select, n.a, derivative(n.b), derivative(n.c));
    case Op::less:
    case Op::less_equal:
    case Op::equal:
    case Op::both:
    case Op::either:
    case Op::inverse:
      break;
  }
  throw std::logic_error("a mask has no derivative");
}

int Differentiator::differentiate_log(int node) {
  const Node n = graph_[node];
  const int zero = graph_.number(0);
  switch (n.op) {
    case Op::multiply:
      return make(Op::add, log_derivative(n.a), log_derivative(n.b));
    case Op::negate:
    case Op::absolute:
      return log_derivative(n.a);
    case Op::reciprocal:
      return make(Op::negate, log_derivative(n.a));
    case Op::square_root:
      return make(Op::multiply, graph_.number(0.5), log_derivative(n.a));
    case Op::exponential:
      return derivative(n.a);
    case Op::select:
      return make(Op::select, n.a, log_derivative(n.b), log_derivative(n.c));
    case Op::input:
      return make(Op::multiply, derivative(node), make(Op::reciprocal, node));
    default: {
      const int quotient = make(Op::multiply, derivative(node), make(Op::reciprocal, node));
      // 0, and numbers so small that they have lost digits and have no reciprocal in single precision
      const int nothing = make(Op::less, make(Op::absolute, node), graph_.number(std::numeric_limits<float>::min()));
      return make(Op::select, nothing, zero, quotient);
    }
  }
}

}  // namespace itn
