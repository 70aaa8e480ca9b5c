#include <catch2/catch.hpp>
#include <random>

#include "../support/lane_function.h"
#include "kernels/shared/portable.h"
#include "runtime/base/dual.h"
#include "runtime/render/derivative/differentiate.h"
#include "runtime/render/derivative/print.h"
#include "runtime/render/derivative/recorded.h"

using namespace itn;

namespace {

// A graph with inputs x and y.
struct Recording {
  Graph graph;
  Recorded x{graph, graph.input("x")}, y{graph, graph.input("y")};

  // Operations that a value takes, each once; numbers and inputs are none.
  int cost(const Recorded& value) {
    int count = 0;
    const auto needed = graph.needed({value.node_in(graph)});
    for (int i = 0; i < graph.size(); ++i)
      count += needed[static_cast<std::size_t>(i)] && graph[i].op != Op::number && graph[i].op != Op::input;
    return count;
  }
  bool is(const Recorded& value, double number) { return graph.is(value.node_in(graph), number); }
  bool same(const Recorded& a, const Recorded& b) { return a.node_in(graph) == b.node_in(graph); }
  Recorded derivative(const Recorded& value) {
    Differentiator by_x(graph, {{graph.input("x"), graph.number(1)}});
    return {graph, by_x.derivative(value.node_in(graph))};
  }
  Recorded log_derivative(const Recorded& value) {
    Differentiator by_x(graph, {{graph.input("x"), graph.number(1)}});
    return {graph, by_x.log_derivative(value.node_in(graph))};
  }
  double at(const Recorded& value, double x_value, double y_value = 1) {
    const int node = value.node_in(graph);
    return graph.evaluate({node}, {{"x", x_value}, {"y", y_value}})[static_cast<std::size_t>(node)];
  }
};

}  // namespace

TEST_CASE("constants fold", "[derivative]") {
  Recording r;
  CHECK(r.is(Recorded(2) * 3 + 1, 7));
  CHECK(r.is(sqrt(Recorded(4)) - exp(Recorded(0)) + log(Recorded(1)) + fabs(Recorded(-3)), 4));
  CHECK(r.is(choose(Recorded(1) < 2, Recorded(5), r.x), 5));
  CHECK(r.same(choose((Recorded(1) > 2) & (r.x < r.y), r.x, r.y), r.y));
  CHECK(r.same(2 * (3 * r.x), 6 * r.x));
  CHECK(r.same((2 * r.x) * (3 * r.y), 6 * (r.x * r.y)));
  CHECK_THROWS_AS(Recorded(1) / 0, std::domain_error);
}

TEST_CASE("identities vanish", "[derivative]") {
  Recording r;
  const Recorded x = r.x, y = r.y;
  CHECK(r.same(x + 0, x));
  CHECK(r.same(x - 0, x));
  CHECK(r.same(1 * x, x));
  CHECK(r.same(x / 1, x));
  CHECK(r.same(-(-x), x));
  CHECK(r.same(0 - x, -x));
  CHECK(r.same(x + -y, x - y));
  CHECK(r.same(x - -y, x + y));
  CHECK(r.same(x + -2 * y, x - 2 * y));
  CHECK(r.same(-(x - y), y - x));
  CHECK(r.is(x - x, 0));
  CHECK(r.is(x * 0, 0));
  CHECK(r.is(0 / x, 0));
  CHECK(r.is(x / x, 1));
  CHECK(r.same(1 / (1 / x), x));
  CHECK(r.same(fabs(-x), fabs(x)));
  CHECK(r.same(choose(x < y, x, x), x));
  CHECK(r.same(choose(!(x < y), x, y), choose(x < y, y, x)));
  CHECK(r.same(choose(x < y, choose(x < y, x, y * y), y), choose(x < y, x, y)));
  CHECK(r.same(choose(x < y, x, choose(x < y, x, y * y)), choose(x < y, x, y * y)));
  CHECK(r.same(choose(x < x, x, y), y));
  CHECK(r.same(choose((x < y) & (x < y), x, y), choose(x < y, x, y)));
}

TEST_CASE("equal expressions are one node, quotients by one number share a division", "[derivative]") {
  Recording r;
  const Recorded x = r.x, y = r.y;
  CHECK(r.same(x * y + 1, 1 + y * x));
  CHECK(r.cost((x + y) * (x + y)) == 2);
  CHECK(r.cost(sqrt(x * y) + exp(y * x)) == 4);
  CHECK(r.cost(x / (1 + y) + y / (1 + y)) == 5);  // 1 + y, its reciprocal, two products, a sum
  // the derivative of an exponential is the exponential again
  const Recorded e = exp(x * y);
  CHECK(r.cost(r.derivative(e) + e) == 4);
}

TEST_CASE("derivatives of single operations", "[derivative]") {
  Recording r;
  const Recorded x = r.x, y = r.y;
  CHECK(r.is(r.derivative(y * y), 0));
  CHECK(r.is(r.derivative(3 * x + y), 3));
  CHECK(r.same(r.derivative(x * x), 2 * x));
  CHECK(r.at(r.derivative(1 / x), 2) == -0.25);
  CHECK(r.at(r.derivative(sqrt(x)), 4) == 0.25);
  CHECK(r.at(r.derivative(exp(2 * x)), 0) == 2);
  CHECK(r.at(r.derivative(log(x)), 4) == 0.25);
  CHECK(r.at(r.derivative(fabs(x)), -3) == -1);
  CHECK(r.at(r.derivative(x - y * x), 1, 5) == -4);
}

TEST_CASE("derivatives at kinks are finite: one side of |x|, MIN and MAX, 0 for sqrt(0)", "[derivative]") {
  using REAL = Recorded;
  Recording r;
  const Recorded x = r.x, y = r.y;
  CHECK(r.at(r.derivative(fabs(x)), 0) == 1);
  CHECK(r.at(r.derivative(sqrt(x)), 0) == 0);
  CHECK(r.at(r.derivative(sqrt(x * x)), 0) == 0);
  CHECK(r.at(r.derivative(MIN(x, y)), 1, 1) == 0);  // as the value: the second operand
  CHECK(r.at(r.derivative(MAX(x, y)), 1, 1) == 0);
  CHECK(r.at(r.derivative(MAX(x, y)), 2, 1) == 1);
  CHECK(r.at(r.derivative(MIN(x, y)), 2, 1) == 0);
}

TEST_CASE("the derivative of a select ignores the branch that is not taken, NaN and infinity too", "[derivative]") {
  Recording r;
  const Recorded x = r.x;
  const Recorded f = choose(x > 0, sqrt(x) + log(x), x);  // NaN for x < 0
  CHECK(std::isnan(r.at(log(x), -2)));
  CHECK(r.at(f, -2) == -2);
  CHECK(r.at(r.derivative(f), -2) == 1);
  CHECK(r.at(r.log_derivative(f), -2) == -0.5);
  const Recorded g = choose(x > 0, 1 / x, x);  // infinite slope at 0
  CHECK(r.at(r.derivative(g), 0) == 1);
  CHECK(r.at(r.derivative(g * g + g), 0) == 1);
}

TEST_CASE("logarithmic derivatives need no value: right where it underflows, 0 where a sum vanishes", "[derivative]") {
  Recording r;
  const Recorded x = r.x, y = r.y;
  const Recorded far = exp(-(x * x)) / (x * y);
  CHECK(r.at(far, 100) == 0);
  CHECK(r.at(r.log_derivative(far), 100) == Approx(-200.01));
  CHECK(r.cost(r.log_derivative(exp(-(x * y)) * y)) == 1);  // -y
  CHECK(r.is(r.log_derivative(y * exp(y)), 0));
  CHECK(r.at(r.log_derivative(x - y), 3, 2) == 1);
  CHECK(r.at(r.log_derivative(x - y), 2, 2) == 0);
  CHECK(r.at(r.log_derivative(x - y), 2e-39, 1e-39) == 0);  // no reciprocal in single precision
  CHECK(std::isinf(r.at(r.log_derivative(x * y), 0)));      // of a parameter at 0: for the caller to refuse
  CHECK(r.at(r.log_derivative(sqrt(x) / fabs(y)), 4) == 0.125);
}

TEST_CASE("a direction of inputs gives the sum of partial derivatives times tangents", "[derivative]") {
  Recording r;
  const Recorded f = r.x * r.x * r.y;
  Differentiator along(r.graph, {{r.graph.input("x"), r.graph.input("dx")}, {r.graph.input("y"), r.graph.number(2)}});
  const int node = along.derivative(f.node_in(r.graph));
  const std::map<std::string, double> at{{"x", 3}, {"y", 5}, {"dx", 0.5}};
  CHECK(r.graph.evaluate({node}, at)[static_cast<std::size_t>(node)] == 2 * 3 * 5 * 0.5 + 9 * 2);
}

TEST_CASE("every operation prints as OpenCL C that computes it, at every width", "[derivative]") {
  const int width = GENERATE(1, 4, 8, 16);
  Recording r;
  const Recorded x = r.x, y = r.y;
  const auto mask = ((x < y) & !(y <= 0.5)) | (x == y);
  const Recorded f = choose(mask, sqrt(fabs(x - 2 * y)), -exp(x) / (y + 3) + log(y + 1e-3));
  const int node = f.node_in(r.graph);
  const std::string text = print_function(r.graph, "printed", {"REAL x", "REAL y", "REAL* value", "REAL* other"},
                                          {{"*value", node}, {"other[0]", -1}, {"other[1]", r.x.node_in(r.graph)}});
  test::LaneFunction call{{},
                          {"a", "b"},
                          {"value", "nothing", "copy"},
                          "REAL other[2];\nprinted(a, b, &value, other);\nnothing = other[0];\ncopy = other[1];"};
  call.functions = text;
  const auto a = test::uniform_numbers(1000, 1, -2, 2), b = test::uniform_numbers(1000, 2, 0, 2);
  const test::Columns out = test::run_lanes(call, width, {a, b});
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) worst = std::max(worst, std::abs(out[0][i] - r.at(f, a[i], b[i])));
  CHECK(worst < 5e-6);
  CHECK(out[1] == std::vector<float>(1000, 0));
  CHECK(out[2] == a);
}

namespace {

// A random expression of x and y, the same for every scalar that is given the same seed; built from a pool so that
// sub-expressions recur, with the small numbers that identities look for.
template <class Real>
Real random_expression(unsigned seed, const Real& x, const Real& y) {
  using std::exp, std::fabs, std::log, std::sqrt, portable::choose;
  std::mt19937 random(seed);
  std::vector<Real> pool{x, y, Real(0), Real(1), Real(-1), Real(2), Real(-0.5)};
  for (int step = 0; step < 40; ++step) {
    // named one by one: the order in which arguments are evaluated is open
    const Real a = pool[random() % pool.size()], b = pool[random() % pool.size()];
    const Real c = pool[random() % pool.size()], d = pool[random() % pool.size()];
    const auto less = a < b;
    const auto other = c <= d;
    Real result = a;
    switch (random() % 12) {
      case 0:
        result = a + b;
        break;
      case 1:
        result = a - b;
        break;
      case 2:
        result = a * b;
        break;
      case 3:
        result = a / (Real(1) + b * b);
        break;
      case 4:
        result = -a;
        break;
      case 5:
        result = sqrt(Real(1) + a * a);
        break;
      case 6:
        result = exp(Real(-1) * fabs(a));
        break;
      case 7:
        result = log(Real(2) + b * b);
        break;
      case 8:
        result = choose(less, c, d);
        break;
      case 9:
        result = choose((!less) & other, a, d);
        break;
      case 10:
        result = choose(less | (!other), c, a);
        break;
      default:
        result = a * (b / (Real(3) + c * c)) - d;
        break;
    }
    pool.push_back(result);
  }
  return pool.back();
}

}  // namespace

TEST_CASE("random expressions: simplified graphs and their derivatives equal double and dual arithmetic",
          "[derivative]") {
  double worst = 0;
  int large = 0, moving = 0;
  for (unsigned seed = 0; seed < 3000; ++seed) {
    Recording r;
    const Recorded f = random_expression(seed, r.x, r.y);
    const Recorded derivative = r.derivative(f), log_derivative = r.log_derivative(f);
    for (const double x : {-1.7, 0.3, 2.9})
      for (const double y : {-0.6, 1.1}) {
        const auto expected = random_expression(seed, Dual<1>::variable(x, 0), Dual<1>(y));
        const double d = expected.derivative[0];
        if (!(std::abs(expected.value) < 1e6 && std::abs(d) < 1e6)) {
          ++large;  // grown beyond what rounding allows to compare
          continue;
        }
        moving += d != 0;
        worst = std::max({worst, std::abs(r.at(f, x, y) - expected.value) / (1 + std::abs(expected.value)),
                          std::abs(r.at(derivative, x, y) - d) / (1 + std::abs(d))});
        if (std::abs(expected.value) > 1e-3)
          worst = std::max(worst, std::abs(r.at(log_derivative, x, y) * expected.value - d) / (1 + std::abs(d)));
      }
  }
  CHECK(large < 1000);
  CHECK(moving > 5000);
  CHECK(worst < 1e-9);
}

TEST_CASE("misuse of recordings is an error that says what is wrong", "[derivative]") {
  Recording r, other;
  CHECK_THROWS_WITH(r.x + other.x, "a formula mixes two recordings");
  CHECK_THROWS_WITH(r.derivative(Recorded(r.graph, (r.x < r.y).node_in(r.graph))), "a mask has no derivative");
  CHECK_THROWS_WITH(print_function(r.graph, "f", {}, {{"y", (r.x * 1e-50).node_in(r.graph)}}),
                    Catch::Contains("1e-50") && Catch::Contains("does not fit single precision"));
  CHECK_THROWS_AS(r.graph.evaluate({r.x.node_in(r.graph)}, {}), std::out_of_range);
}
