// Mixtures of phase functions, tables and mixtures among their parts: norm, mean cosine, samplers, scores, and what is
// left where a weight is 0 or 1.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>

#include "../support/chi_square.h"
#include "../support/lane_function.h"
#include "runtime/render/compile/surfaces.h"
#include "runtime/render/derivative/score_functions.h"
#include "runtime/scene/model/phase_formula.h"
#include "runtime/scene/model/sized_model.h"

using namespace itn;
using namespace itn::test;

namespace {

constexpr double significance = 1e-6;

PhaseFunction leaf(const std::string& type, const std::vector<double>& values = {}) {
  PhaseFunction phase;
  phase.become(type == "tabphase" ? tabulated_model(values.size()) : *find_model(phase_models(), type));
  for (std::size_t k = 0; k < values.size(); ++k) phase.values[k].value.fill(values[k]);
  return phase;
}

PhaseFunction blend(double weight, const PhaseFunction& first, const PhaseFunction& second) {
  Instance nest;
  nest.become(blend_phase_model());
  nest.set("weight", weight);
  return make_mixture(nest, {first, second});
}

PhaseFunction dictionary(const std::vector<double>& weights, const std::vector<PhaseFunction>& inside) {
  Instance nest;
  nest.become(dictionary_model(weights.size()));
  for (std::size_t k = 0; k < weights.size(); ++k) nest.values[k].value.fill(weights[k]);
  return make_mixture(nest, inside);
}

struct Named {
  std::string name;
  PhaseFunction phase;
};

std::vector<Named> mixtures() {
  const PhaseFunction forward = leaf("hg", {0.8}), backward = leaf("hg", {-0.3}), even = leaf("isotropic"),
                      drops = leaf("vmf", {30}), air = leaf("rayleigh"), dust = leaf("draine", {0.6, 2}),
                      table = leaf("tabphase", {2, 0.5, 0, 1.5}), other = leaf("tabphase", {1, 3, 2});
  return {
      {"two", blend(0.3, forward, even)},
      {"the same twice", blend(0.6, forward, backward)},
      {"blends in a blend", blend(0.35, air, blend(0.8, blend(0.25, table, forward), drops))},
      {"a dictionary", dictionary({3, 0.5, 2, 1, 0.01}, {forward, even, drops, dust, table})},
      {"a dictionary of one", dictionary({2}, {dust})},
      {"a dictionary in a dictionary", dictionary({1, 2}, {dictionary({0.1, 0.3, 0.1}, {table, other, even}), drops})},
      {"twelve", dictionary(std::vector<double>(12, 1), {forward, even, drops, air, dust, table, backward, other,
                                                         leaf("hg", {0.95}), leaf("vmf", {1}), leaf("hg", {0}), air})},
  };
}

std::vector<double> numbers(const PhaseFunction& phase) { return phase.model->to_numbers(0, phase.slots()); }

double value(const PhaseFunction& phase, double cosine) {
  return phase_value(*phase.model, numbers(phase).data(), cosine);
}

std::string capitals(std::string name) {
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::toupper(c); });
  return name;
}

// Cosine and sine from a uniform number, and the value at that cosine.
LaneFunction drawing(const PhaseFunction& phase) {
  LaunchData data;
  data.phases[phase.model->id] = phase.model;
  LaneFunction call{{"scattering/mixture.h"}, {"u"}, {"c", "s", "value"}, "REAL n[] = {"};
  call.functions = structures_text(data);
  for (const Model* model : made_models(data))
    call.functions +=
        (model->table ? "TABLE_FUNCTIONS(" : "MIXTURE_FUNCTIONS(") + model->name + ", " + capitals(model->name) + ")\n";
  for (const double x : numbers(phase)) call.body += "(REAL)(" + std::to_string(x) + "f), ";
  const std::string& name = phase.model->name;
  call.body += "};\n" + name + "_draw(n, u, &c, &s);\nvalue = " + name + "_value(n, c);";
  return call;
}

constexpr Grid cosines{-1, 1, 0, 1, 4096, 1};

}  // namespace

TEST_CASE("mixtures integrate to 1, and their mean cosine is the mean of their parts'", "[model]") {
  for (const Named& named : mixtures()) {
    CAPTURE(named.name);
    const std::vector<double> n = numbers(named.phase);
    const Model& model = *named.phase.model;
    const auto density = [&](double c, double) { return 2 * PI_ * phase_value(model, n.data(), c); };
    CHECK(integrate(density, cosines, 1e-9) == Approx(1).epsilon(1e-6));
    const std::vector<double> at = named.phase.slots(), mean = mean_cosine(model, at);
    CHECK(integrate([&](double c, double b) { return c * density(c, b); }, cosines, 1e-9) ==
          Approx(mean[0]).margin(1e-6));
    for (std::size_t k = 0; k < at.size(); ++k) {
      const double h = 1e-5 * std::max(at[k], 0.1);
      std::vector<double> low = at, high = at;
      low[k] -= h;
      high[k] += h;
      CHECK(mean[1 + k] ==
            Approx((mean_cosine(model, high)[0] - mean_cosine(model, low)[0]) / (2 * h)).epsilon(1e-5).margin(1e-8));
    }
  }
}

TEST_CASE("a mixture's parts count by the products of the weights on the way to them") {
  const PhaseFunction forward = leaf("hg", {0.8}), even = leaf("isotropic"), drops = leaf("vmf", {30});
  const PhaseFunction nested = blend(0.3, forward, dictionary({1, 3}, {even, drops}));
  for (const double c : {-1.0, -0.2, 0.6, 1.0}) {
    CHECK(value(nested, c) ==
          Approx(0.7 * value(forward, c) + 0.3 * 0.25 * value(even, c) + 0.3 * 0.75 * value(drops, c)));
    CHECK(value(blend(0, forward, drops), c) == value(forward, c));
    CHECK(value(blend(1, forward, drops), c) == value(drops, c));
    CHECK(value(dictionary({0, 2, 0}, {forward, drops, even}), c) == value(drops, c));
  }
}

TEST_CASE("samples of mixtures follow them (chi-square), with sine and cosine of one angle", "[model][stat]") {
  const int width = GENERATE(1, 16);
  constexpr std::size_t count = 1 << 16;
  for (const Named& named : mixtures()) {
    const Columns out = run_lanes(drawing(named.phase), width, {uniform_numbers(count, 4)});
    const std::vector<double> n = numbers(named.phase);
    const auto exact = [&](double c) { return phase_value(*named.phase.model, n.data(), c); };
    std::vector<Point> samples;
    double off_circle = 0, off_value = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const double c = out[0][i], s = out[1][i];
      samples.push_back({c, 0.5});
      off_circle = std::max(off_circle, std::abs(c * c + s * s - 1));
      off_value = std::max(off_value, std::abs(out[2][i] - exact(c)) / exact(c));
    }
    const auto density = [&](double c, double) { return 2 * PI_ * exact(c); };
    const ChiSquare result = chi_square(samples, density, {-1, 1 + 1e-6, 0, 1, 200, 1});
    CAPTURE(named.name, width, result.statistic, result.degrees_of_freedom);
    CHECK(result.p_value > significance);
    CHECK(off_circle < 1e-5);
    CHECK(off_value < 1e-5);
  }
}

TEST_CASE("where a weight is 0 or 1, the others alone are sampled", "[model]") {
  const PhaseFunction forward = leaf("hg", {0.8}), drops = leaf("vmf", {30});
  const auto u = uniform_numbers(1 << 12, 7);
  const auto drawn = [&](const PhaseFunction& phase) { return run_lanes(drawing(phase), 16, {u})[0]; };
  const auto one = drawn(dictionary({1}, {forward}));
  CHECK(drawn(blend(0, forward, drops)) == one);
  CHECK(drawn(blend(1, drops, forward)) == one);
  CHECK(drawn(dictionary({0, 1, 0}, {drops, forward, drops})) == one);
}

TEST_CASE("the scores of mixtures are the derivatives of their logarithms, by every parameter", "[model]") {
  for (const Named& named : mixtures()) {
    const Model& model = *named.phase.model;
    const ScoreFunction& score = score_function(model);
    const std::vector<double> at = named.phase.slots(), n = numbers(named.phase);
    const auto by = model.jacobian(0, at);
    for (std::size_t k = 0; k < at.size(); ++k) {
      if (*model.obstacle(at.data(), static_cast<int>(k))) continue;
      CAPTURE(named.name, model.parameters[k].name);
      const double h = 1e-3 * std::max(std::abs(at[k]), 0.01);
      std::vector<std::vector<double>> moved;
      for (const int step : {-2, -1, 1, 2}) {
        std::vector<double> there = at;
        there[k] += step * h;
        moved.push_back(model.to_numbers(0, there));
      }
      double worst = 0;
      for (double c = -0.99; c < 1; c += 0.033) {
        std::map<std::string, double> inputs{{"cosine", c}};
        for (std::size_t i = 0; i < n.size(); ++i) inputs["n[" + std::to_string(i) + "]"] = n[i];
        double sum = 0;
        for (const auto& [place, node] : score.derivatives)
          if (place.second == 0)
            sum += score.graph.evaluate({node}, inputs)[static_cast<std::size_t>(node)] *
                   by[static_cast<std::size_t>(place.first)][k];
        const auto log_value = [&](std::size_t i) { return std::log(phase_value(model, moved[i].data(), c)); };
        const double difference = (8 * (log_value(2) - log_value(1)) - (log_value(3) - log_value(0))) / (12 * h);
        worst = std::max(worst, std::abs(sum - difference) / (1 + std::abs(difference)));
      }
      CHECK(worst < 1e-5);
    }
  }
}

TEST_CASE("the scores of mixtures have the mean 0, by every parameter", "[model]") {
  for (const Named& named : mixtures()) {
    const Model& model = *named.phase.model;
    const ScoreFunction& score = score_function(model);
    const std::vector<double> at = named.phase.slots(), n = numbers(named.phase);
    const auto by = model.jacobian(0, at);
    std::map<std::string, double> inputs{{"cosine", 0}};
    for (std::size_t i = 0; i < n.size(); ++i) inputs["n[" + std::to_string(i) + "]"] = n[i];
    std::vector<int> nodes;
    for (const auto& [place, node] : score.derivatives) nodes.push_back(node);
    std::vector<double> mean(at.size()), size(at.size());
    constexpr int steps = 4000;
    for (int i = 0; i < steps; ++i) {
      // so close where most light goes that a sharp peak is resolved
      const double u = (i + 0.5) / steps, c = 1 - 2 * u * u * u, weight = 2 * PI_ * 6 * u * u / steps;
      inputs["cosine"] = c;
      const std::vector<double> values = score.graph.evaluate(nodes, inputs);
      const double density = weight * phase_value(model, n.data(), c);
      for (std::size_t k = 0; k < at.size(); ++k) {
        double own = 0;
        for (const auto& [place, node] : score.derivatives)
          if (place.second == 0)
            own += values[static_cast<std::size_t>(node)] * by[static_cast<std::size_t>(place.first)][k];
        mean[k] += density * own;
        size[k] += density * std::abs(own);
      }
    }
    for (std::size_t k = 0; k < at.size(); ++k) {
      if (*model.obstacle(at.data(), static_cast<int>(k))) continue;
      CAPTURE(named.name, model.parameters[k].name, size[k]);
      CHECK(std::abs(mean[k]) < 1e-5 * size[k] + 1e-9);
    }
  }
}
