#include "runtime/render/derivative/print.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <stdexcept>

namespace itn {
namespace {

std::string number(double value) {
  using Single = std::numeric_limits<float>;
  const double size = std::abs(value);
  if (size > Single::max() || (size > 0 && size < Single::min()))
    throw std::logic_error(fmt::format("the constant {} of a formula does not fit single precision", value));
  const std::string digits = fmt::format("{:.9g}", value);
  const bool integer = digits.find_first_of(".e") == std::string::npos;
  return "NUMBER(" + digits + (integer ? ".0)" : ")");
}

// The expression by which other expressions refer to a node.
std::string name(const Graph& graph, int node) {
  const Node& n = graph[node];
  if (n.op == Op::number) return number(n.number);
  if (n.op == Op::input) return n.name;
  return fmt::format("t{}", node);
}

std::string expression(const Graph& graph, const Node& n) {
  const std::string a = name(graph, n.a);
  const std::string b = n.b < 0 ? "" : name(graph, n.b), c = n.c < 0 ? "" : name(graph, n.c);
  switch (n.op) {
    case Op::add:
      return a + " + " + b;
    case Op::subtract:
      return a + " - " + b;
    case Op::multiply:
      return a + " * " + b;
    case Op::negate:
      return "-" + a;
    case Op::reciprocal:
      return number(1) + " / " + a;
    case Op::square_root:
      return "SQRT(" + a + ")";
    case Op::exponential:
      return "EXP(" + a + ")";
    case Op::logarithm:
      return "LOG(" + a + ")";
    case Op::absolute:
      return "ABS(" + a + ")";
    case Op::select:
      return "SELECT(" + a + ", " + b + ", " + c + ")";
    case Op::less:
      return a + " < " + b;
    case Op::less_equal:
      return a + " <= " + b;
    case Op::equal:
      return a + " == " + b;
    case Op::both:
      return a + " & " + b;
    case Op::either:
      return a + " | " + b;
    case Op::inverse:
      return "!" + a;
    case Op::number:
    case Op::input:
      break;
  }
  throw std::logic_error("a number or an input is not computed");
}

}  // namespace

std::string print_function(const Graph& graph, const std::string& name_of_function,
                           const std::vector<std::string>& arguments, const std::vector<Output>& outputs) {
  std::vector<int> wanted;
  for (const Output& output : outputs)
    if (output.node >= 0) wanted.push_back(output.node);
  std::string text = fmt::format("INLINE void {}({}) {{\n", name_of_function, fmt::join(arguments, ", "));
  const std::vector<bool> needed = graph.needed(wanted);
  for (int node = 0; node < graph.size(); ++node) {
    const Node& n = graph[node];
    if (!needed[static_cast<std::size_t>(node)] || n.op == Op::number || n.op == Op::input) continue;
    text += fmt::format("  const {} t{} = {};\n", n.op >= Op::less ? "MASK" : "REAL", node, expression(graph, n));
  }
  for (const Output& output : outputs)
    text += fmt::format("  {} = {};\n", output.name, output.node < 0 ? number(0) : name(graph, output.node));
  return text + "}\n";
}

}  // namespace itn
