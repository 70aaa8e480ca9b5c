#include "runtime/derivative/score_functions.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "kernels/model/models.h"
#include "kernels/model/sky_hosek_wilkie.h"
#include "runtime/derivative/differentiate.h"
#include "runtime/derivative/print.h"
#include "runtime/derivative/recorded.h"
#include "runtime/scene/model.h"

namespace itn {
namespace {

// Declares the arguments of a function while its formula is recorded.
class Recorder {
 public:
  Recorder(const std::string& name, const std::string& formula) {
    function_.name = name;
    function_.formula = formula;
  }

  Recorded real(const std::string& name) {
    function_.arguments.push_back("REAL " + name);
    return input(name);
  }
  Vector3<Recorded> real3(const std::string& name) {
    function_.arguments.push_back("REAL3 " + name);
    return {input(name + ".x"), input(name + ".y"), input(name + ".z")};
  }
  std::vector<Recorded> reals(const std::string& name, int count) {
    function_.arguments.push_back("const REAL* " + name);
    std::vector<Recorded> result;
    result.reserve(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) result.push_back(input(fmt::format("{}[{}]", name, i)));
    return result;
  }

  // d log f / d n[slot] + d edge / d n[slot] of `slots` numbers; f: a channel each, or one for all
  ScoreFunction scores(const std::vector<Recorded>& f, int slots, const Recorded& edge = 0) {
    Graph& graph = function_.graph;
    function_.arguments.emplace_back("REAL* d");
    for (const Recorded& value : f) function_.values.push_back(value.node_in(graph));
    const int edge_node = edge.node_in(graph);
    for (int slot = 0; slot < slots; ++slot) {
      Differentiator along(graph, {{graph.input(fmt::format("n[{}]", slot)), graph.number(1)}});
      for (int channel = 0; channel < 3; ++channel) {
        const int value = function_.values[f.size() == 1 ? 0 : static_cast<std::size_t>(channel)];
        const int node = graph.make(Op::add, along.log_derivative(value), along.derivative(edge_node));
        if (!graph.is(node, 0)) function_.derivatives[{slot, channel}] = node;
      }
    }
    return std::move(function_);
  }

  // df when each of `moving` has the tangent beside it; named d_<name>
  ScoreFunction derivative(const Recorded& f, const std::string& name, const std::vector<Recorded>& moving,
                           const std::vector<Recorded>& tangents) {
    Graph& graph = function_.graph;
    function_.values = {f.node_in(graph)};
    function_.arguments.push_back("REAL* d_" + name);
    std::map<int, int> tangent;
    for (std::size_t i = 0; i < moving.size(); ++i) tangent[moving[i].node_in(graph)] = tangents[i].node_in(graph);
    function_.derivatives[{0, 0}] = Differentiator(graph, tangent).derivative(function_.values[0]);
    return std::move(function_);
  }

 private:
  Recorded input(const std::string& name) { return {function_.graph, function_.graph.input(name)}; }

  ScoreFunction function_;
};

// Numbers n of a model: at least one, since a model may have none.
std::vector<Recorded> numbers(Recorder& r, int slots) { return r.reals("n", std::max(slots, 1)); }

using RecordedVector = Vector3<Recorded>;

// The functions of one variant of a BSDF; those of its model choose among them.
#define ITN_BSDF_SCORES(model, PREFIX)                                                              \
  ScoreFunction model##_score(int variant, const std::string& name) {                               \
    Recorder r("score_" + name, #model "_value(n, wi, wo)");                                        \
    const std::vector<Recorded> n = numbers(r, PREFIX##_SLOTS);                                     \
    const RecordedVector wi = r.real3("wi"), wo = r.real3("wo");                                    \
    std::vector<Recorded> f(3);                                                                     \
    model##_value(variant, n.data(), wi, wo, f.data());                                             \
    return r.scores(f, PREFIX##_SLOTS, model##_edge(variant, n.data(), wi, wo));                    \
  }                                                                                                 \
  ScoreFunction model##_chosen_score(int variant, const std::string& name) {                        \
    Recorder r("score_" + name + "_chosen", #model "_chosen(n, wi, wo)");                           \
    const std::vector<Recorded> n = numbers(r, PREFIX##_SLOTS);                                     \
    const RecordedVector wi = r.real3("wi"), wo = r.real3("wo");                                    \
    std::vector<Recorded> f(3);                                                                     \
    model##_chosen(variant, n.data(), wi, wo, f.data());                                            \
    return r.scores(f, PREFIX##_SLOTS);                                                             \
  }                                                                                                 \
  ScoreFunction model##_decision_score(int variant, const std::string& name) {                      \
    Recorder r("score_" + name + "_decision", #model "_decision(n, wi, outcome, reflected)");       \
    const std::vector<Recorded> n = numbers(r, PREFIX##_SLOTS);                                     \
    const RecordedVector wi = r.real3("wi"), outcome = r.real3("outcome");                          \
    const Recorded reflected = r.real("reflected");                                                 \
    return r.scores({model##_decision(variant, n.data(), wi, outcome, reflected)}, PREFIX##_SLOTS); \
  }
#define ITN_BSDF_SCORES_OF(name, PREFIX, type, variants) ITN_BSDF_SCORES(name, PREFIX)
BSDF_LIST(ITN_BSDF_SCORES_OF)

#define ITN_PHASE_SCORE(name, PREFIX, type)                            \
  ScoreFunction name##_score() {                                       \
    Recorder r("score_" #name, #name "_value(n, cosine)");             \
    const std::vector<Recorded> n = numbers(r, PREFIX##_SLOTS);        \
    const Recorded cosine = r.real("cosine");                          \
    return r.scores({name##_value(n.data(), cosine)}, PREFIX##_SLOTS); \
  }
PHASE_LIST(ITN_PHASE_SCORE)

#define ITN_MEDIUM_SCORE(name, PREFIX, event)                                \
  ScoreFunction name##_##event##_score() {                                   \
    Recorder r("score_" #name "_" #event, #name "_" #event "(n, distance)"); \
    const std::vector<Recorded> n = numbers(r, PREFIX##_SLOTS);              \
    const Recorded distance = r.real("distance");                            \
    std::vector<Recorded> f(3);                                              \
    name##_##event(n.data(), distance, f.data());                            \
    return r.scores(f, PREFIX##_SLOTS);                                      \
  }
#define ITN_MEDIUM_SCORES(name, PREFIX, type) \
  ITN_MEDIUM_SCORE(name, PREFIX, scattering) ITN_MEDIUM_SCORE(name, PREFIX, passage)
MEDIUM_LIST(ITN_MEDIUM_SCORES)

ScoreFunction sky_derivative() {
  Recorder r("derivative_sky_hosek_wilkie", "sky_hosek_wilkie(k, cos_theta, gamma, one_minus_cos), k moving along d_k");
  constexpr int coefficients = 10;
  const std::vector<Recorded> k = r.reals("k", coefficients), d_k = r.reals("d_k", coefficients);
  const Recorded cos_theta = r.real("cos_theta"), gamma = r.real("gamma"), one_minus_cos = r.real("one_minus_cos");
  return r.derivative(sky_hosek_wilkie(k.data(), cos_theta, gamma, one_minus_cos), "radiance", k, d_k);
}

int variant_count(const std::string& name) {
  const auto& all = bsdf_models();
  const auto found = std::find_if(all.begin(), all.end(), [&](const Model& model) { return model.name == name; });
  return static_cast<int>(found->variants.size());
}

std::string variant_name(const std::string& model, int variant) { return fmt::format("{}_{}", model, variant); }

std::vector<ScoreFunction> record_all() {
  std::vector<ScoreFunction> all;
#define ITN_RECORD_BSDF(model, PREFIX, type, variants)                 \
  for (int v = 0; v < variant_count(#model); ++v) {                    \
    all.push_back(model##_score(v, variant_name(#model, v)));          \
    all.push_back(model##_chosen_score(v, variant_name(#model, v)));   \
    all.push_back(model##_decision_score(v, variant_name(#model, v))); \
  }
#define ITN_RECORD_PHASE(name, PREFIX, type) all.push_back(name##_score());
#define ITN_RECORD_MEDIUM(name, PREFIX, type) \
  all.push_back(name##_scattering_score());   \
  all.push_back(name##_passage_score());
  BSDF_LIST(ITN_RECORD_BSDF)
  PHASE_LIST(ITN_RECORD_PHASE)
  MEDIUM_LIST(ITN_RECORD_MEDIUM)
  all.push_back(sky_derivative());
  return all;
}

// The function of a model that calls that of its variant: variant is a constant wherever it is called.
std::string choose_variant(const std::string& model, int variants, const std::string& suffix,
                           const std::string& declared, const std::string& passed) {
  std::string text = fmt::format("inline void score_{}{}(int variant, {}) {{\n", model, suffix, declared);
  for (int v = 0; v < variants; ++v)
    text += fmt::format("  if (variant == {}) score_{}{}({});\n", v, variant_name(model, v), suffix, passed);
  return text + "}\n\n";
}

std::vector<Output> outputs_of(const ScoreFunction& function, const std::set<int>& slots, int channels) {
  if (function.name.rfind("score_", 0) != 0) {
    const std::string& last = function.arguments.back();  // "REAL* d_name"
    return {{last.substr(4), slots.empty() ? -1 : function.derivatives.at({0, 0})}};
  }
  std::vector<Output> outputs;
  for (const auto& [at, node] : function.derivatives)
    if (at.second < channels)
      outputs.push_back({fmt::format("d[{}]", at.first * channels + at.second), slots.count(at.first) > 0 ? node : -1});
  return outputs;
}

}  // namespace

bool ScoreFunction::same_in_all_channels(int slot) const {
  const auto of = [&](int channel) {
    const auto found = derivatives.find({slot, channel});
    return found == derivatives.end() ? -1 : found->second;
  };
  return of(0) == of(1) && of(1) == of(2);
}

std::set<std::string> ScoreFunction::inputs_of(int slot, int channel) const {
  std::set<std::string> names;
  const auto found = derivatives.find({slot, channel});
  if (found == derivatives.end()) return names;
  const std::vector<bool> needed = graph.needed({found->second});
  for (int node = 0; node < graph.size(); ++node)
    if (needed[static_cast<std::size_t>(node)] && graph[node].op == Op::input) names.insert(graph[node].name);
  return names;
}

const std::vector<ScoreFunction>& score_functions() {
  static const std::vector<ScoreFunction> all = record_all();
  return all;
}

const ScoreFunction& score_function(const std::string& name) {
  for (const ScoreFunction& function : score_functions())
    if (function.name == name) return function;
  throw std::invalid_argument("no score function " + name);
}

std::string print_scores(const ScoreRequest& wanted, int channels) {
  for (const auto& [name, slots] : wanted) {
    const ScoreFunction& function = score_function(name);
    for (const int slot : slots)
      if (function.derivatives.count({slot, 0}) + function.derivatives.count({slot, 1}) +
              function.derivatives.count({slot, 2}) ==
          0)
        throw std::invalid_argument(fmt::format("{} does not depend on n[{}]", name, slot));
  }
  std::string text;
  for (const ScoreFunction& function : score_functions()) {
    const auto asked = wanted.find(function.name);
    const std::set<int> slots = asked == wanted.end() ? std::set<int>{} : asked->second;
    text += fmt::format("/* {} */\n", function.formula) +
            print_function(function.graph, function.name, function.arguments, outputs_of(function, slots, channels)) +
            "\n";
  }
  for (const Model& model : bsdf_models()) {
    const int variants = static_cast<int>(model.variants.size());
    text += choose_variant(model.name, variants, "", "const REAL* n, REAL3 wi, REAL3 wo, REAL* d", "n, wi, wo, d");
    text +=
        choose_variant(model.name, variants, "_chosen", "const REAL* n, REAL3 wi, REAL3 wo, REAL* d", "n, wi, wo, d");
    text += choose_variant(model.name, variants, "_decision",
                           "const REAL* n, REAL3 wi, REAL3 outcome, REAL reflected, REAL* d",
                           "n, wi, outcome, reflected, d");
  }
  return text;
}

}  // namespace itn
