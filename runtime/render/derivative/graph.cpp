#include "runtime/render/derivative/graph.h"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

namespace itn {

double apply(Op op, double a, double b, double c) {
  switch (op) {
    case Op::add:
      return a + b;
    case Op::subtract:
      return a - b;
    case Op::multiply:
      return a * b;
    case Op::negate:
      return -a;
    case Op::reciprocal:
      return 1 / a;
    case Op::square_root:
      return std::sqrt(a);
    case Op::exponential:
      return std::exp(a);
    case Op::logarithm:
      return std::log(a);
    case Op::absolute:
      return std::abs(a);
    case Op::select:
      return a != 0 ? b : c;
    case Op::less:
      return a < b;
    case Op::less_equal:
      return a <= b;
    case Op::equal:
      return a == b;
    case Op::both:
      return a != 0 && b != 0;
    case Op::either:
      return a != 0 || b != 0;
    case Op::inverse:
      return a == 0;
    case Op::number:
    case Op::input:
      break;
  }
  throw std::logic_error("a number or an input is not computed");
}

int Graph::intern(Op op, int a, int b, int c, double number, const std::string& name) {
  const Node node{op, a, b, c, number, name};
  const auto [place, fresh] = index_.emplace(node, size());
  if (fresh) nodes_.push_back(node);
  return place->second;
}

int Graph::number(double value) {
  return intern(Op::number, -1, -1, -1, value == 0 ? 0 : value);  // one zero
}

int Graph::input(const std::string& name) { return intern(Op::input, -1, -1, -1, 0, name); }

int Graph::make(Op op, int a, int b, int c) {
  // Constants fold, unless that leaves the numbers: such a branch is guarded by a select, or fails at run time.
  if (is_number(a) && (b < 0 || is_number(b)) && (c < 0 || is_number(c))) {
    const auto value = [&](int node) { return node < 0 ? 0 : (*this)[node].number; };
    const double result = apply(op, value(a), value(b), value(c));
    if (std::isfinite(result)) return number(result);
  }
  switch (op) {
    case Op::add:
      return add(a, b);
    case Op::subtract:
      return subtract(a, b);
    case Op::multiply:
      return multiply(a, b);
    case Op::negate:
      return negate(a);
    case Op::reciprocal:
      return reciprocal(a);
    case Op::select:
      return select(a, b, c);
    case Op::absolute:
      return intern(op, (*this)[a].op == Op::negate ? (*this)[a].a : a);
    case Op::inverse:
      return (*this)[a].op == Op::inverse ? (*this)[a].a : intern(op, a);
    case Op::less:
    case Op::less_equal:
    case Op::equal:
    case Op::both:
    case Op::either:
      return mask(op, a, b);
    default:
      return intern(op, a, b, c);
  }
}

// -2 x and the like: a sum with it is a difference.
bool Graph::is_negative_multiple(int node) const {
  const Node& n = (*this)[node];
  return n.op == Op::multiply && is_number(n.a) && (*this)[n.a].number < 0;
}

int Graph::negate(int a) {
  const Node n = (*this)[a];
  if (n.op == Op::negate) return n.a;
  if (n.op == Op::subtract) return make(Op::subtract, n.b, n.a);
  if (n.op == Op::multiply && is_number(n.a)) return make(Op::multiply, number(-(*this)[n.a].number), n.b);
  return intern(Op::negate, a);
}

int Graph::add(int a, int b) {
  if (is(a, 0)) return b;
  if (is(b, 0)) return a;
  if (a == b) return make(Op::multiply, number(2), a);
  if (is_negative_multiple(a)) std::swap(a, b);
  if (is_negative_multiple(b)) return make(Op::subtract, a, negate(b));
  if ((*this)[a].op == Op::negate) std::swap(a, b);
  if ((*this)[b].op == Op::negate) return make(Op::subtract, a, (*this)[b].a);
  if (a > b) std::swap(a, b);
  return intern(Op::add, a, b);
}

int Graph::subtract(int a, int b) {
  if (is(b, 0)) return a;
  if (is(a, 0)) return negate(b);
  if (a == b) return number(0);
  if ((*this)[b].op == Op::negate || is_negative_multiple(b)) return make(Op::add, a, negate(b));
  return intern(Op::subtract, a, b);
}

int Graph::multiply(int a, int b) {
  if (is_number(b)) std::swap(a, b);
  if (is(a, 0)) return a;
  if (is(a, 1)) return b;
  if (is(a, -1)) return negate(b);
  // signs and constant factors go to the front
  if ((*this)[a].op == Op::negate) return negate(make(Op::multiply, (*this)[a].a, b));
  if ((*this)[b].op == Op::negate) return negate(make(Op::multiply, a, (*this)[b].a));
  for (int turn = 0; turn < 2; ++turn, std::swap(a, b)) {
    const Node n = (*this)[b];
    if (n.op == Op::multiply && is_number(n.a))
      return make(Op::multiply, make(Op::multiply, n.a, is_number(a) ? a : number(1)),
                  is_number(a) ? n.b : make(Op::multiply, a, n.b));
    if (n.op == Op::reciprocal && n.a == a) return number(1);
  }
  if (a > b && !is_number(a)) std::swap(a, b);
  return intern(Op::multiply, a, b);
}

int Graph::reciprocal(int a) {
  const Node n = (*this)[a];
  if (n.op == Op::reciprocal) return n.a;
  if (n.op == Op::negate) return negate(make(Op::reciprocal, n.a));
  if (n.op == Op::multiply && is_number(n.a))
    return make(Op::multiply, make(Op::reciprocal, n.a), make(Op::reciprocal, n.b));
  return intern(Op::reciprocal, a);
}

int Graph::select(int mask, int yes, int no) {
  if (is_number(mask)) return is(mask, 0) ? no : yes;
  if ((*this)[mask].op == Op::inverse) {
    mask = (*this)[mask].a;
    std::swap(yes, no);
  }
  // what the branches know of the mask already
  if ((*this)[yes].op == Op::select && (*this)[yes].a == mask) yes = (*this)[yes].b;
  if ((*this)[no].op == Op::select && (*this)[no].a == mask) no = (*this)[no].c;
  if (yes == no) return yes;
  return intern(Op::select, mask, yes, no);
}

int Graph::mask(Op op, int a, int b) {
  if (op == Op::both || op == Op::either) {
    const double absorbing = op == Op::both ? 0 : 1;
    if (a == b || is(a, absorbing)) return a;
    if (is(b, absorbing)) return b;
    if (is_number(a)) return b;
    if (is_number(b)) return a;
  } else if (a == b) {
    return number(op == Op::less ? 0 : 1);
  }
  const bool symmetric = op != Op::less && op != Op::less_equal;
  if (symmetric && a > b) std::swap(a, b);
  return intern(op, a, b);
}

std::vector<bool> Graph::needed(const std::vector<int>& wanted) const {
  std::vector<bool> result(nodes_.size());
  for (const int node : wanted) result[static_cast<std::size_t>(node)] = true;
  for (int node = size() - 1; node >= 0; --node)
    if (result[static_cast<std::size_t>(node)])
      for (const int operand : {(*this)[node].a, (*this)[node].b, (*this)[node].c})
        if (operand >= 0) result[static_cast<std::size_t>(operand)] = true;
  return result;
}

std::vector<double> Graph::evaluate(const std::vector<int>& wanted, const std::map<std::string, double>& inputs) const {
  const std::vector<bool> used = needed(wanted);
  std::vector<double> value(nodes_.size(), std::numeric_limits<double>::quiet_NaN());
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (!used[i]) continue;
    const Node& n = nodes_[i];
    const auto operand = [&](int node) { return node < 0 ? 0 : value[static_cast<std::size_t>(node)]; };
    if (n.op == Op::number)
      value[i] = n.number;
    else if (n.op == Op::input)
      value[i] = inputs.at(n.name);
    else
      value[i] = apply(n.op, operand(n.a), operand(n.b), operand(n.c));
  }
  return value;
}

}  // namespace itn
