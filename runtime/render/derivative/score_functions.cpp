#include "runtime/render/derivative/score_functions.h"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <functional>
#include <mutex>
#include <stdexcept>

#include "itn/model.h"
#include "kernels/model/models.h"
#include "kernels/model/sky_hosek_wilkie.h"
#include "runtime/render/derivative/differentiate.h"
#include "runtime/render/derivative/print.h"
#include "runtime/render/derivative/recorded.h"
#include "runtime/scene/model/phase_formula.h"
#include "runtime/scene/model/structure_formula.h"

namespace itn {
namespace {

// A function as its callers see it. Its formula waits until somebody asks for it: most programs need few of them or
// none, and the time to record them all grows with the models.
struct Declared {
  std::string name, formula;
  std::vector<std::string> arguments;  // as of ScoreFunction
  int slots = 0;                       // of n, which scores are by
  std::function<ScoreFunction(const Declared&)> record;
  int results = 0;  // where it is no score: 0: one number; else an array of so many
};

// Hands out a function's inputs while its formula is recorded.
class Recorder {
 public:
  explicit Recorder(const Declared& declared) : slots_(declared.slots) {
    function_.name = declared.name;
    function_.formula = declared.formula;
    function_.arguments = declared.arguments;
  }

  Recorded real(const std::string& name) { return {function_.graph, function_.graph.input(name)}; }
  Vector3<Recorded> real3(const std::string& name) { return {real(name + ".x"), real(name + ".y"), real(name + ".z")}; }
  std::vector<Recorded> reals(const std::string& name, int count) {
    std::vector<Recorded> result;
    result.reserve(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) result.push_back(real(fmt::format("{}[{}]", name, i)));
    return result;
  }
  // n of a model: at least one, since a model may have none
  std::vector<Recorded> numbers() { return reals("n", std::max(slots_, 1)); }

  // d log f / d n[slot] + d edge / d n[slot]; f: a channel each, or one for all
  ScoreFunction scores(const std::vector<Recorded>& f, const Recorded& edge = 0) {
    Graph& graph = function_.graph;
    for (const Recorded& value : f) function_.values.push_back(value.node_in(graph));
    const int edge_node = edge.node_in(graph);
    for (int slot = 0; slot < slots_; ++slot) {
      Differentiator along(graph, {{graph.input(fmt::format("n[{}]", slot)), graph.number(1)}});
      for (int channel = 0; channel < 3; ++channel) {
        const int value = function_.values[f.size() == 1 ? 0 : static_cast<std::size_t>(channel)];
        const int node = graph.make(Op::add, along.log_derivative(value), along.derivative(edge_node));
        if (!graph.is(node, 0)) function_.derivatives[{slot, channel}] = node;
      }
    }
    return std::move(function_);
  }

  // df when each of `moving` has the tangent beside it
  ScoreFunction derivative(const std::vector<Recorded>& f, const std::vector<Recorded>& moving,
                           const std::vector<Recorded>& tangents) {
    Graph& graph = function_.graph;
    std::map<int, int> tangent;
    for (std::size_t i = 0; i < moving.size(); ++i) tangent[moving[i].node_in(graph)] = tangents[i].node_in(graph);
    Differentiator along(graph, tangent);
    for (std::size_t k = 0; k < f.size(); ++k) {
      function_.values.push_back(f[k].node_in(graph));
      function_.derivatives[{static_cast<int>(k), 0}] = along.derivative(function_.values[k]);
    }
    return std::move(function_);
  }

 private:
  int slots_;
  ScoreFunction function_;
};

std::string variant_name(const std::string& model, int variant) { return fmt::format("{}_{}", model, variant); }

using RecordedVector = Vector3<Recorded>;

const std::vector<std::string> value_arguments{"const REAL* n", "REAL3 wi", "REAL3 wo", "REAL* d"};
const std::vector<std::string> decision_arguments{"const REAL* n", "REAL3 wi", "REAL3 outcome", "REAL reflected",
                                                  "REAL* d"};

// The functions of one variant of a BSDF; those of its model choose among them.
#define ITN_BSDF_SCORES(model, PREFIX, type, variants)                                                          \
  Declared model##_score(int variant, const std::string& name) {                                                \
    const auto record = [variant](const Declared& declared) {                                                   \
      Recorder r(declared);                                                                                     \
      const std::vector<Recorded> n = r.numbers();                                                              \
      const RecordedVector wi = r.real3("wi"), wo = r.real3("wo");                                              \
      std::vector<Recorded> f(3);                                                                               \
      model##_value(variant, n.data(), wi, wo, f.data());                                                       \
      return r.scores(f, model##_edge(variant, n.data(), wi, wo));                                              \
    };                                                                                                          \
    return {"score_" + name, #model "_value(n, wi, wo)", value_arguments, PREFIX##_SLOTS, record};              \
  }                                                                                                             \
  Declared model##_chosen_score(int variant, const std::string& name) {                                         \
    const auto record = [variant](const Declared& declared) {                                                   \
      Recorder r(declared);                                                                                     \
      const std::vector<Recorded> n = r.numbers();                                                              \
      const RecordedVector wi = r.real3("wi"), wo = r.real3("wo");                                              \
      std::vector<Recorded> f(3);                                                                               \
      model##_chosen(variant, n.data(), wi, wo, f.data());                                                      \
      return r.scores(f);                                                                                       \
    };                                                                                                          \
    return {"score_" + name + "_chosen", #model "_chosen(n, wi, wo)", value_arguments, PREFIX##_SLOTS, record}; \
  }                                                                                                             \
  Declared model##_decision_score(int variant, const std::string& name) {                                       \
    const auto record = [variant](const Declared& declared) {                                                   \
      Recorder r(declared);                                                                                     \
      const std::vector<Recorded> n = r.numbers();                                                              \
      const RecordedVector wi = r.real3("wi"), outcome = r.real3("outcome");                                    \
      const Recorded reflected = r.real("reflected");                                                           \
      return r.scores({model##_decision(variant, n.data(), wi, outcome, reflected)});                           \
    };                                                                                                          \
    return {"score_" + name + "_decision", #model "_decision(n, wi, outcome, reflected)", decision_arguments,   \
            PREFIX##_SLOTS, record};                                                                            \
  }
BSDF_LIST(ITN_BSDF_SCORES)

// The same of a structure.
Declared structure_score(const Structure& structure) {
  const auto record = [&structure](const Declared& declared) {
    Recorder r(declared);
    const std::vector<Recorded> n = r.numbers();
    const RecordedVector wi = r.real3("wi"), wo = r.real3("wo");
    return r.scores(StructureFormula<Recorded>(structure, n.data()).value(wi, wo));
  };
  const Model& model = structure.model;
  return {"score_" + variant_name(model.name, 0), model.name + "_value(n, wi, wo)", value_arguments, model.number_slots,
          record};
}

Declared structure_chosen_score(const Structure& structure) {
  const auto record = [&structure](const Declared& declared) {
    Recorder r(declared);
    const std::vector<Recorded> n = r.numbers();
    const RecordedVector wi = r.real3("wi"), wo = r.real3("wo");
    return r.scores(StructureFormula<Recorded>(structure, n.data()).chosen(wi, wo));
  };
  const Model& model = structure.model;
  return {"score_" + variant_name(model.name, 0) + "_chosen", model.name + "_chosen(n, wi, wo)", value_arguments,
          model.number_slots, record};
}

Declared phase_score(const Model& model) {
  const auto record = [&model](const Declared& declared) {
    Recorder r(declared);
    const std::vector<Recorded> n = r.numbers();
    const Recorded cosine = r.real("cosine");
    return r.scores({phase_value(model, n.data(), cosine)});
  };
  return {"score_" + model.name,
          model.name + "_value(n, cosine)",
          {"const REAL* n", "REAL cosine", "REAL* d"},
          model.number_slots,
          record};
}

#define ITN_MEDIUM_SCORE(name, PREFIX, event)              \
  Declared name##_##event##_score() {                      \
    const auto record = [](const Declared& declared) {     \
      Recorder r(declared);                                \
      const std::vector<Recorded> n = r.numbers();         \
      const Recorded distance = r.real("distance");        \
      std::vector<Recorded> f(3);                          \
      name##_##event(n.data(), distance, f.data());        \
      return r.scores(f);                                  \
    };                                                     \
    return {"score_" #name "_" #event,                     \
            #name "_" #event "(n, distance)",              \
            {"const REAL* n", "REAL distance", "REAL* d"}, \
            PREFIX##_SLOTS,                                \
            record};                                       \
  }
#define ITN_MEDIUM_SCORES(name, PREFIX, type) \
  ITN_MEDIUM_SCORE(name, PREFIX, scattering) ITN_MEDIUM_SCORE(name, PREFIX, passage)
MEDIUM_LIST(ITN_MEDIUM_SCORES)

Declared sky_derivative() {
  const auto record = [](const Declared& declared) {
    Recorder r(declared);
    constexpr int coefficients = 10;
    const std::vector<Recorded> k = r.reals("k", coefficients), d_k = r.reals("d_k", coefficients);
    const Recorded cos_theta = r.real("cos_theta"), gamma = r.real("gamma"), one_minus_cos = r.real("one_minus_cos");
    return r.derivative({sky_hosek_wilkie(k.data(), cos_theta, gamma, one_minus_cos)}, k, d_k);
  };
  return {
      "derivative_sky_hosek_wilkie",
      "sky_hosek_wilkie(k, cos_theta, gamma, one_minus_cos), k moving along d_k",
      {"const REAL* k", "const REAL* d_k", "REAL cos_theta", "REAL gamma", "REAL one_minus_cos", "REAL* d_radiance"},
      0,
      record};
}

Declared bumped_normal_derivative() {
  const auto record = [](const Declared& declared) {
    Recorder r(declared);
    const RecordedVector u = r.real3("u"), v = r.real3("v"), n = r.real3("n"), normal = r.real3("normal");
    const std::vector<Recorded> slopes = r.reals("slopes", 2), d_slopes = r.reals("d_slopes", 2);
    const RecordedVector bent = bumped_normal(u, v, n, normal, slopes[0], slopes[1]);
    return r.derivative({bent.x, bent.y, bent.z}, slopes, d_slopes);
  };
  return {
      "derivative_bumped_normal",
      "bumped_normal(u, v, n, normal, slopes[0], slopes[1]), slopes moving along d_slopes",
      {"REAL3 u", "REAL3 v", "REAL3 n", "REAL3 normal", "const REAL* slopes", "const REAL* d_slopes", "REAL* d_normal"},
      0,
      record,
      3};
}

int variant_count(const std::string& name) {
  const auto& all = bsdf_models();
  const auto found = std::find_if(all.begin(), all.end(), [&](const Model& model) { return model.name == name; });
  return static_cast<int>(found->variants.size());
}

// A function, and its recording from when it is first asked for.
class Function {
 public:
  explicit Function(Declared of) : declared(std::move(of)) {}

  const ScoreFunction& recorded() {
    std::call_once(once_, [&] { recorded_ = declared.record(declared); });
    return recorded_;
  }

  const Declared declared;

 private:
  std::once_flag once_;
  ScoreFunction recorded_;
};

std::deque<Function> declare_all() {
  std::deque<Function> all;
#define ITN_DECLARE_BSDF(model, PREFIX, type, variants)                   \
  for (int v = 0; v < variant_count(#model); ++v) {                       \
    all.emplace_back(model##_score(v, variant_name(#model, v)));          \
    all.emplace_back(model##_chosen_score(v, variant_name(#model, v)));   \
    all.emplace_back(model##_decision_score(v, variant_name(#model, v))); \
  }
#define ITN_DECLARE_MEDIUM(name, PREFIX, type) \
  all.emplace_back(name##_scattering_score()); \
  all.emplace_back(name##_passage_score());
  BSDF_LIST(ITN_DECLARE_BSDF)
  for (const Model& phase : phase_models()) all.emplace_back(phase_score(phase));
  MEDIUM_LIST(ITN_DECLARE_MEDIUM)
  all.emplace_back(sky_derivative());
  all.emplace_back(bumped_normal_derivative());
  return all;
}

std::deque<Function>& all_functions() {
  static std::deque<Function> all = declare_all();
  return all;
}

// Functions of models that are made for scenes; each is added when it is first asked for.
class MadeFunctions {
 public:
  Function& of(const Declared& declared) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (Function* known = named(declared.name)) return *known;
    return all_.emplace_back(declared);
  }

  Function* find(const std::string& name) {
    const std::lock_guard<std::mutex> lock(mutex_);
    return named(name);
  }

 private:
  Function* named(const std::string& name) {
    for (Function& function : all_)
      if (function.declared.name == name) return &function;
    return nullptr;
  }

  std::mutex mutex_;
  std::deque<Function> all_;
};

MadeFunctions& made_functions() {
  static MadeFunctions all;
  return all;
}

// The function of a model that calls that of its variant: variant is a constant wherever it is called.
std::string choose_variant(const std::string& model, int variants, const std::string& suffix,
                           const std::vector<std::string>& arguments) {
  std::vector<std::string> passed;
  passed.reserve(arguments.size());
  for (const std::string& argument : arguments) passed.push_back(argument.substr(argument.rfind(' ') + 1));
  std::string text =
      fmt::format("INLINE void score_{}{}(int variant, {}) {{\n", model, suffix, fmt::join(arguments, ", "));
  for (int v = 0; v < variants; ++v)
    text += fmt::format("  if (variant == {}) score_{}{}({});\n", v, variant_name(model, v), suffix,
                        fmt::join(passed, ", "));
  return text + "}\n\n";
}

bool is_score(const std::string& name) { return name.rfind("score_", 0) == 0; }

// The results to which the last argument, "REAL* d_name", points: one number, or an array of `results`.
std::vector<std::string> results_of(const std::vector<std::string>& arguments, int results) {
  if (results == 0) return {arguments.back().substr(4)};
  const std::string name = arguments.back().substr(arguments.back().rfind(' ') + 1);
  std::vector<std::string> all(static_cast<std::size_t>(results));
  for (std::size_t k = 0; k < all.size(); ++k) all[k] = fmt::format("{}[{}]", name, k);
  return all;
}

std::vector<Output> outputs_of(const ScoreFunction& function, const std::set<int>& slots, int channels) {
  std::vector<Output> outputs;
  if (!is_score(function.name)) {
    const auto count = static_cast<int>(function.values.size());
    const std::vector<std::string> results = results_of(function.arguments, count == 1 ? 0 : count);
    for (int k = 0; k < count; ++k)
      outputs.push_back({results[static_cast<std::size_t>(k)], function.derivatives.at({k, 0})});
    return outputs;
  }
  for (const auto& [at, node] : function.derivatives)
    if (at.second < channels)
      outputs.push_back({fmt::format("d[{}]", at.first * channels + at.second), slots.count(at.first) > 0 ? node : -1});
  return outputs;
}

// Outputs of a function that nothing is asked of: zeros.
std::vector<Output> zeros_of(const Declared& declared, int channels) {
  std::vector<Output> outputs;
  if (!is_score(declared.name)) {
    for (const std::string& result : results_of(declared.arguments, declared.results)) outputs.push_back({result, -1});
    return outputs;
  }
  outputs.reserve(static_cast<std::size_t>(declared.slots * channels));
  for (int i = 0; i < declared.slots * channels; ++i) outputs.push_back({fmt::format("d[{}]", i), -1});
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

std::vector<std::string> score_function_names() {
  std::vector<std::string> names;
  for (const Function& function : all_functions()) names.push_back(function.declared.name);
  return names;
}

const ScoreFunction& score_function(const std::string& name) {
  for (Function& function : all_functions())
    if (function.declared.name == name) return function.recorded();
  if (Function* function = made_functions().find(name)) return function->recorded();
  throw std::invalid_argument("no score function " + name);
}

const ScoreFunction& score_function(const Structure& structure, bool chosen) {
  return made_functions().of(chosen ? structure_chosen_score(structure) : structure_score(structure)).recorded();
}

const ScoreFunction& score_function(const Model& phase) {
  if (!phase.mixture && !phase.table) return score_function("score_" + phase.name);
  return made_functions().of(phase_score(phase)).recorded();
}

std::string print_scores(const ScoreRequest& wanted, int channels, const std::vector<const Model*>& made) {
  for (const auto& [name, slots] : wanted) {
    const ScoreFunction& function = score_function(name);
    for (const int slot : slots)
      if (function.derivatives.count({slot, 0}) + function.derivatives.count({slot, 1}) +
              function.derivatives.count({slot, 2}) ==
          0)
        throw std::invalid_argument(fmt::format("{} does not depend on n[{}]", name, slot));
  }
  std::string text;
  const auto add = [&](Function& function) {
    const Declared& declared = function.declared;
    const auto asked = wanted.find(declared.name);
    const auto print = [&](const Graph& graph, const std::vector<Output>& outputs) {
      return print_function(graph, declared.name, declared.arguments, outputs);
    };
    const bool needed = asked != wanted.end() && !asked->second.empty();
    text += fmt::format("/* {} */\n", declared.formula) +
            (needed ? print(function.recorded().graph, outputs_of(function.recorded(), asked->second, channels))
                    : print({}, zeros_of(declared, channels))) +
            "\n";
  };
  for (Function& function : all_functions()) add(function);
  for (const Model* model : made) {
    if (!model->structure) {
      add(made_functions().of(phase_score(*model)));
      continue;
    }
    add(made_functions().of(structure_score(*model->structure)));
    add(made_functions().of(structure_chosen_score(*model->structure)));
    text += choose_variant(model->name, 1, "", value_arguments) +
            choose_variant(model->name, 1, "_chosen", value_arguments);
  }
  for (const Model& model : bsdf_models()) {
    const int variants = static_cast<int>(model.variants.size());
    text += choose_variant(model.name, variants, "", value_arguments) +
            choose_variant(model.name, variants, "_chosen", value_arguments) +
            choose_variant(model.name, variants, "_decision", decision_arguments);
  }
  return text;
}

}  // namespace itn
