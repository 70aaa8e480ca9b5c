// The score functions in double precision and on the device, and how exact a single precision result can be.
#pragma once
#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "../support/lane_function.h"
#include "itn/model.h"
#include "kernels/shared/declaration.h"
#include "runtime/render/derivative/score_functions.h"

namespace itn::test {

constexpr int most_numbers = 10;  // of an array

// A derivative by n[slot], in the first channel that has one.
struct Derivative {
  int slot, channel, node;
};
// Nothing is differentiated by these (shared/declaration.h).
inline bool is_fixed(const ScoreFunction& function, int slot) {
  for (const Model& model : bsdf_models())
    if (function.name.rfind("score_" + model.name + "_", 0) == 0) return model.number_of(slot).role == ROLE_FIXED;
  return false;
}

inline std::vector<Derivative> derivatives_of(const ScoreFunction& function) {
  std::vector<Derivative> result;
  for (const auto& [at, node] : function.derivatives)
    if (!is_fixed(function, at.first) && (result.empty() || result.back().slot != at.first))
      result.push_back({at.first, at.second, node});
  return result;
}

// The number of an array's numbers that the tests give: those of a model that it has derivatives by. The others are 1.
inline int numbers_given(const ScoreFunction& function, const std::string& array) {
  return array == "n" ? derivatives_of(function).back().slot + 1 : most_numbers;
}

// Its scalar inputs, in the order of its arguments: "n[0]", ..., "wi.x", ..., "k[9]".
inline std::vector<std::string> scalar_inputs(const ScoreFunction& function) {
  std::vector<std::string> names;
  for (const std::string& argument : function.arguments) {
    const auto space = argument.rfind(' ');
    const std::string type = argument.substr(0, space), name = argument.substr(space + 1);
    if (type == "REAL") names.push_back(name);
    if (type == "REAL3")
      for (const char* part : {".x", ".y", ".z"}) names.push_back(name + part);
    if (type == "const REAL*")
      for (int i = 0; i < numbers_given(function, name); ++i) names.push_back(name + "[" + std::to_string(i) + "]");
  }
  return names;
}

// All its derivatives in double precision at one row of inputs.
class Evaluation {
 public:
  template <class Row>
  Evaluation(const ScoreFunction& function, const Row& row) : graph_(function.graph) {
    std::vector<int> wanted = function.values;
    for (const auto& [at, node] : function.derivatives) wanted.push_back(node);
    std::map<std::string, double> inputs;
    for (int i = 0; i < most_numbers; ++i) inputs["n[" + std::to_string(i) + "]"] = 1;
    const auto names = scalar_inputs(function);
    for (std::size_t i = 0; i < names.size(); ++i) inputs[names[i]] = row[i];
    value_ = graph_.evaluate(wanted, inputs);
  }

  double operator[](int node) const { return value_[static_cast<std::size_t>(node)]; }

  // The distance by which rounding can move a node, in units of the relative rounding error of one operation: the sum
  // over all the numbers in its computation, constants included, of |number| * |d node / d number|. (First order: it
  // does not know of comparisons that tip over.)
  double rounding(int node) const {
    std::vector<double> adjoint(value_.size());
    adjoint[static_cast<std::size_t>(node)] = 1;
    double sum = 0;
    for (int i = node; i >= 0; --i) {
      const double d = adjoint[static_cast<std::size_t>(i)];
      if (d == 0) continue;
      const Node& n = graph_[i];
      const double v = (*this)[i];
      if (n.op != Op::input) sum += std::abs(d * v);
      const auto pass = [&](int operand, double slope) { adjoint[static_cast<std::size_t>(operand)] += d * slope; };
      switch (n.op) {
        case Op::add:
          pass(n.a, 1), pass(n.b, 1);
          break;
        case Op::subtract:
          pass(n.a, 1), pass(n.b, -1);
          break;
        case Op::multiply:
          pass(n.a, (*this)[n.b]), pass(n.b, (*this)[n.a]);
          break;
        case Op::negate:
          pass(n.a, -1);
          break;
        case Op::reciprocal:
          pass(n.a, -v * v);
          break;
        case Op::square_root:
          pass(n.a, v == 0 ? 0 : 0.5 / v);
          break;
        case Op::exponential:
          pass(n.a, v);
          break;
        case Op::logarithm:
          pass(n.a, 1 / (*this)[n.a]);
          break;
        case Op::absolute:
          pass(n.a, (*this)[n.a] < 0 ? -1 : 1);
          break;
        case Op::select:
          pass((*this)[n.a] != 0 ? n.b : n.c, 1);
          break;
        default:
          break;
      }
    }
    return sum;
  }

 private:
  const Graph& graph_;
  std::vector<double> value_;
};

// The printed function with all its outputs, over columns in the order of scalar_inputs.
inline LaneFunction printed(const ScoreFunction& function) {
  LaneFunction call;
  std::set<int> slots;
  for (const Derivative& d : derivatives_of(function)) slots.insert(d.slot);
  call.functions = print_scores({{function.name, slots}}, 3);
  std::string arguments;
  for (const std::string& argument : function.arguments) {
    const auto space = argument.rfind(' ');
    const std::string type = argument.substr(0, space), name = argument.substr(space + 1);
    if (type == "REAL*") continue;  // the result
    arguments += name + "_, ";
    if (type == "REAL") {
      call.inputs.push_back(name);
      call.body += "const REAL " + name + "_ = " + name + ";\n";
      continue;
    }
    std::string parts;
    for (int i = 0; i < (type == "REAL3" ? 3 : numbers_given(function, name)); ++i) {
      call.inputs.push_back(name + std::to_string(i));
      parts += (i ? ", " : "") + call.inputs.back();
    }
    call.body += type == "REAL3" ? "const REAL3 " + name + "_ = make3(" + parts + ");\n"
                                 : "const REAL " + name + "_[10] = {" + parts + "};\n";
  }
  call.body += "REAL d[3 * 10];\n" + function.name + "(" + arguments + "d);\n";
  for (const Derivative& d : derivatives_of(function)) {
    call.outputs.push_back("d_" + std::to_string(d.slot));
    call.body += call.outputs.back() + " = d[" + std::to_string(3 * d.slot + d.channel) + "];\n";
  }
  return call;
}

}  // namespace itn::test
