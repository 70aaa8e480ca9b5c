// Expressions as a graph: what a recorded formula is, before and after it has been differentiated.
#pragma once
#include <cstddef>
#include <map>
#include <string>
#include <tuple>
#include <vector>

namespace itn {

// The operation of a node on its operands a, b, c. There is no division: a / b is a * reciprocal(b), so that quotients
// by the same number share one. The last row gives masks, which only select and the last three take.
enum class Op {
  number,
  input,
  add,
  subtract,
  multiply,
  negate,
  reciprocal,
  square_root,
  exponential,
  logarithm,
  absolute,
  select,
  less,
  less_equal,
  equal,
  both,
  either,
  inverse,
};

struct Node {
  Op op = Op::number;
  int a = -1, b = -1, c = -1;  // operands: earlier nodes
  double number = 0;           // of Op::number; a mask that is known is the number 0 or 1
  std::string name;            // of Op::input: how OpenCL C calls it, such as "wi.x"

  auto key() const { return std::tie(op, a, b, c, number, name); }
  bool operator<(const Node& other) const { return key() < other.key(); }
};

// Equal expressions are one node. make() folds constants and applies identities (x + 0, x * 0, x / x, select with equal
// branches, ...); 0 * x is 0 even where x may be infinite at run time: a branch that a formula guards by a select.
class Graph {
 public:
  int number(double value);
  int input(const std::string& name);
  int make(Op op, int a, int b = -1, int c = -1);

  const Node& operator[](int node) const { return nodes_[static_cast<std::size_t>(node)]; }
  int size() const { return static_cast<int>(nodes_.size()); }
  bool is_number(int node) const { return (*this)[node].op == Op::number; }
  bool is(int node, double value) const { return is_number(node) && (*this)[node].number == value; }

  // By node: does one of `wanted` need it (or is it one of them)?
  std::vector<bool> needed(const std::vector<int>& wanted) const;
  // By node: its value in double precision, NaN for nodes that are not needed. Masks are 0 or 1. Throws
  // std::out_of_range for an input that is not given.
  std::vector<double> evaluate(const std::vector<int>& wanted, const std::map<std::string, double>& inputs) const;

 private:
  int intern(Op op, int a = -1, int b = -1, int c = -1, double number = 0, const std::string& name = "");
  int negate(int a);
  int add(int a, int b);
  int subtract(int a, int b);
  int multiply(int a, int b);
  int reciprocal(int a);
  int select(int mask, int yes, int no);
  int mask(Op op, int a, int b);
  bool is_negative_multiple(int node) const;

  std::vector<Node> nodes_;
  std::map<Node, int> index_;
};

// The value of a node whose operands have the values a, b, c.
double apply(Op op, double a, double b, double c);

}  // namespace itn
