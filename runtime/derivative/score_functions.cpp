#include "runtime/derivative/score_functions.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "kernels/model/diffuse.h"
#include "kernels/model/medium_homogeneous.h"
#include "kernels/model/phase_henyey_greenstein.h"
#include "kernels/model/rough_dielectric.h"
#include "kernels/model/sky_hosek_wilkie.h"
#include "runtime/derivative/differentiate.h"
#include "runtime/derivative/print.h"
#include "runtime/derivative/recorded.h"

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

  // d log f / d parameter + d edge / d parameter, for inputs of those names
  ScoreFunction scores(const Recorded& f, const std::vector<std::string>& parameters, const Recorded& edge = 0) {
    Graph& graph = function_.graph;
    function_.value = f.node_in(graph);
    function_.parameters = parameters;
    for (const std::string& parameter : parameters) {
      Differentiator along(graph, {{graph.input(parameter), graph.number(1)}});
      function_.derivatives.push_back(
          graph.make(Op::add, along.log_derivative(function_.value), along.derivative(edge.node_in(graph))));
    }
    return std::move(function_);
  }

  // df when each of `moving` has the tangent beside it; named d_<name>
  ScoreFunction derivative(const Recorded& f, const std::string& name, const std::vector<Recorded>& moving,
                           const std::vector<Recorded>& tangents) {
    Graph& graph = function_.graph;
    function_.value = f.node_in(graph);
    function_.parameters = {name};
    std::map<int, int> tangent;
    for (std::size_t i = 0; i < moving.size(); ++i) tangent[moving[i].node_in(graph)] = tangents[i].node_in(graph);
    function_.derivatives = {Differentiator(graph, tangent).derivative(function_.value)};
    return std::move(function_);
  }

 private:
  Recorded input(const std::string& name) { return {function_.graph, function_.graph.input(name)}; }

  ScoreFunction function_;
};

ScoreFunction henyey_greenstein_score() {
  Recorder r("score_henyey_greenstein", "henyey_greenstein(cosine, g)");
  const Recorded cosine = r.real("cosine"), g = r.real("g");
  return r.scores(henyey_greenstein(cosine, g), {"g"});
}

ScoreFunction medium_scattering_score() {
  Recorder r("score_medium_scattering", "medium_free_flight(sigma_t, distance) * albedo");
  const Recorded sigma_t = r.real("sigma_t"), albedo = r.real("albedo"), distance = r.real("distance");
  return r.scores(medium_free_flight(sigma_t, distance) * albedo, {"sigma_t", "albedo"});
}

ScoreFunction medium_passage_score() {
  Recorder r("score_medium_passage", "medium_transmittance(sigma_t, distance)");
  const Recorded sigma_t = r.real("sigma_t"), distance = r.real("distance");
  return r.scores(medium_transmittance(sigma_t, distance), {"sigma_t"});
}

ScoreFunction diffuse_score() {
  Recorder r("score_diffuse", "diffuse_eval(albedo, wo)");
  const Recorded albedo = r.real("albedo");
  return r.scores(diffuse_eval(albedo, r.real3("wo")), {"albedo"});
}

ScoreFunction rough_dielectric_score(int distribution, const std::string& name) {
  Recorder r("score_rough_dielectric_" + name,
             "rough_dielectric_eval(" + name + ", alpha, far_over_near(eta, wi.z), wi, wo)");
  const Recorded alpha = r.real("alpha"), eta = r.real("eta");
  const Vector3<Recorded> wi = r.real3("wi"), wo = r.real3("wo");
  const Recorded far = far_over_near(eta, wi.z);
  const Recorded edge = distribution == MICROFACET_GGX ? rough_dielectric_edge(far, wi, wo) : Recorded(0);
  return r.scores(rough_dielectric_eval(distribution, alpha, far, wi, wo), {"alpha", "eta"}, edge);
}

ScoreFunction rough_dielectric_decision_score(int distribution, const std::string& name) {
  Recorder r("score_rough_dielectric_decision_" + name,
             "rough_dielectric_decision(" + name + ", alpha, far_over_near(eta, wi.z), wi, m, reflected)");
  const Recorded alpha = r.real("alpha"), eta = r.real("eta");
  const Vector3<Recorded> wi = r.real3("wi"), m = r.real3("m");
  const Recorded reflected = r.real("reflected");
  return r.scores(rough_dielectric_decision(distribution, alpha, far_over_near(eta, wi.z), wi, m, reflected),
                  {"alpha", "eta"});
}

ScoreFunction sky_derivative() {
  Recorder r("derivative_sky_hosek_wilkie", "sky_hosek_wilkie(k, cos_theta, gamma, one_minus_cos), k moving along d_k");
  constexpr int coefficients = 10;
  const std::vector<Recorded> k = r.reals("k", coefficients), d_k = r.reals("d_k", coefficients);
  const Recorded cos_theta = r.real("cos_theta"), gamma = r.real("gamma"), one_minus_cos = r.real("one_minus_cos");
  return r.derivative(sky_hosek_wilkie(k.data(), cos_theta, gamma, one_minus_cos), "radiance", k, d_k);
}

}  // namespace

const std::vector<ScoreFunction>& score_functions() {
  static const std::vector<ScoreFunction> all{henyey_greenstein_score(),
                                              medium_scattering_score(),
                                              medium_passage_score(),
                                              diffuse_score(),
                                              rough_dielectric_score(MICROFACET_BECKMANN, "beckmann"),
                                              rough_dielectric_score(MICROFACET_GGX, "ggx"),
                                              rough_dielectric_decision_score(MICROFACET_BECKMANN, "beckmann"),
                                              rough_dielectric_decision_score(MICROFACET_GGX, "ggx"),
                                              sky_derivative()};
  return all;
}

std::string print_scores(const ScoreRequest& wanted) {
  const auto& all = score_functions();
  for (const auto& [name, parameters] : wanted) {
    const auto function = std::find_if(all.begin(), all.end(), [&, &n = name](const auto& f) { return f.name == n; });
    if (function == all.end()) throw std::invalid_argument("no score function " + name);
    const auto& known = function->parameters;
    for (const std::string& parameter : parameters)
      if (std::find(known.begin(), known.end(), parameter) == known.end())
        throw std::invalid_argument(
            fmt::format("{} has no parameter {}; it has {}", name, parameter, fmt::join(known, ", ")));
  }
  std::string text;
  for (const ScoreFunction& function : all) {
    const auto asked = wanted.find(function.name);
    std::vector<Output> outputs;
    for (std::size_t i = 0; i < function.parameters.size(); ++i) {
      const bool needed = asked != wanted.end() && asked->second.count(function.parameters[i]) > 0;
      outputs.push_back({"d_" + function.parameters[i], needed ? function.derivatives[i] : -1});
    }
    text += fmt::format("/* {} */\n", function.formula) +
            print_function(function.graph, function.name, function.arguments, outputs) + "\n";
  }
  return text;
}

}  // namespace itn
