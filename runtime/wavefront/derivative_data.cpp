#include "runtime/wavefront/derivative_data.h"

#include <fmt/format.h>

#include <algorithm>

#include "runtime/derivative/parameter_chain.h"
#include "runtime/error.h"
#include "runtime/scene/emitter.h"
#include "runtime/scene/parameters.h"

namespace itn {
namespace {

class Builder {
 public:
  Builder(const Scene& scene, int emitter, LaunchData& launch) : scene_(scene), emitter_(emitter), launch_(launch) {}

  void add(const Parameter& p) {
    DerivativeRecord record{};
    record.emitter = -1;
    if (is_of_light(p)) {
      record.emitter = static_cast<int>(launch_.emitters.size());
      const EmitterRecord light = launch_.emitters[static_cast<std::size_t>(emitter_)];
      launch_.emitters.push_back(emitter_derivative(*scene_.environment, p, light, launch_.emitter_tables));
      if (light.kind == EMITTER_SUNSKY) want("derivative_sky_hosek_wilkie", "radiance");
      data.derivatives.push_back(record);
      return;
    }
    launch_.coloured_light |= p.component >= 0;  // where all components are equal, the derivatives are not
    for (int c = 0; c < 3; ++c) {
      if (p.component >= 0 && p.component != c) continue;
      record.score[c] = score(p, c);
      record.factor[c] = static_cast<float>(factor(p, c));
    }
    data.derivatives.push_back(record);
  }

  DerivativeData data;

 private:
  // Index of the score that the parameter's channel needs.
  int score(const Parameter& p, int channel) {
    ScoreRecord r{SCORE_SIGMA_T, p.index, channel};
    switch (p.kind) {
      case ParameterKind::scale:
      case ParameterKind::sigma_t:
        r.kind = SCORE_SIGMA_T;
        if (grey(medium(p).sigma_t)) r.channel = 0;
        want("score_medium_scattering", "sigma_t");
        want("score_medium_passage", "sigma_t");
        break;
      case ParameterKind::albedo:
        r.kind = SCORE_ALBEDO;
        if (grey(medium(p).albedo)) r.channel = 0;
        want("score_medium_scattering", "albedo");
        break;
      case ParameterKind::g:
        r = {SCORE_G, p.index, 0};
        want("score_henyey_greenstein", "g");
        break;
      case ParameterKind::alpha:
        r = {SCORE_ALPHA, p.index, 0};
        want("score_rough_dielectric_" + boundary(p), "alpha");
        want("score_rough_dielectric_decision_" + boundary(p), "alpha");
        break;
      case ParameterKind::int_ior:
      case ParameterKind::ext_ior:
        r = {SCORE_ETA, p.index, 0};
        want("score_rough_dielectric_" + boundary(p), "eta");
        break;
      case ParameterKind::reflectance:
        r.kind = SCORE_REFLECTANCE;
        if (grey(bsdf(p).reflectance.value)) r.channel = 0;
        want("score_diffuse", "albedo");
        break;
      default:
        throw std::logic_error("no score for " + p.name);
    }
    const auto same = [&](const ScoreRecord& o) {
      return o.kind == r.kind && o.target == r.target && o.channel == r.channel;
    };
    const auto found = std::find_if(data.scores.begin(), data.scores.end(), same);
    if (found != data.scores.end()) return static_cast<int>(found - data.scores.begin());
    data.scores.push_back(r);
    return static_cast<int>(data.scores.size()) - 1;
  }

  // d number of the score / d parameter
  double factor(const Parameter& p, int channel) const {
    switch (p.kind) {
      case ParameterKind::sigma_t:
      case ParameterKind::scale: {
        const Medium& m = medium(p);
        const auto chain =
            jacobian(scaled_extinction, std::array{m.sigma_t[static_cast<std::size_t>(channel)], m.scale});
        return chain.by[0][p.kind == ParameterKind::scale ? 1 : 0];
      }
      case ParameterKind::int_ior:
      case ParameterKind::ext_ior:
        return jacobian(relative_index, std::array{bsdf(p).int_ior, bsdf(p).ext_ior})
            .by[0][p.kind == ParameterKind::ext_ior ? 1 : 0];
      default:
        return 1;
    }
  }

  static bool grey(const Rgb& c) { return c[0] == c[1] && c[1] == c[2]; }
  const Medium& medium(const Parameter& p) const { return scene_.media[static_cast<std::size_t>(p.index)]; }
  const Bsdf& bsdf(const Parameter& p) const { return scene_.bsdfs[static_cast<std::size_t>(p.index)]; }
  std::string boundary(const Parameter& p) const {
    return bsdf(p).distribution == Distribution::ggx ? "ggx" : "beckmann";
  }
  void want(const std::string& function, const std::string& parameter) { data.functions[function].insert(parameter); }

  const Scene& scene_;
  int emitter_;
  LaunchData& launch_;
};

}  // namespace

DerivativeData derivative_data(const Scene& scene, const std::vector<std::string>& names, int emitter,
                               LaunchData& launch) {
  const std::vector<Parameter> parameters = list_parameters(scene);
  Builder builder(scene, emitter, launch);
  for (auto name = names.begin(); name != names.end(); ++name) {
    const Parameter p = find_parameter(parameters, *name);
    if (!p.not_differentiable.empty())
      throw UsageError(fmt::format("parameter {} cannot be differentiated by: {}", p.name, p.not_differentiable));
    if (std::find(names.begin(), name, *name) != name)
      throw UsageError(fmt::format("parameter {}: named twice", *name));
    builder.add(p);
  }
  return std::move(builder.data);
}

}  // namespace itn
