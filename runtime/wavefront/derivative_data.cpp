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

  // image: which derivative this is
  void add(const Parameter& p, int image) {
    if (is_of_light(p)) {
      DerivativeRecord record{{0, 0, 0}, static_cast<int>(launch_.emitters.size())};
      const EmitterRecord light = launch_.emitters[static_cast<std::size_t>(emitter_)];
      launch_.emitters.push_back(emitter_derivative(*scene_.environment, p, light, launch_.emitter_tables));
      if (light.kind == EMITTER_SUNSKY) want("derivative_sky_hosek_wilkie", "radiance");
      data.derivatives.push_back(record);
      data.parts.push_back({image, {-1, -1, -1}});
      return;
    }
    launch_.coloured_light |= p.component >= 0;  // where all components are equal, the derivatives are not
    for (const int index : p.indices) {
      DerivativeRecord record{{0, 0, 0}, -1};
      PartRecord part{image, {-1, -1, -1}};
      for (int c = 0; c < 3; ++c) {
        if (p.component >= 0 && p.component != c) continue;
        record.factor[c] = static_cast<float>(factor(p, index, c));
        if (record.factor[c] != 0) part.score[c] = score(p, index, c);
      }
      data.derivatives.push_back(record);
      data.parts.push_back(part);
    }
  }

  DerivativeData data;

 private:
  // Index of the score that the parameter's channel needs of the medium or BSDF `index`.
  int score(const Parameter& p, int index, int channel) {
    ScoreRecord r{SCORE_SIGMA_T, index, channel};
    switch (p.kind) {
      case ParameterKind::scale:
      case ParameterKind::sigma_t:
        r.kind = SCORE_SIGMA_T;
        if (grey(medium(index).sigma_t)) r.channel = 0;
        want("score_medium_scattering", "sigma_t");
        want("score_medium_passage", "sigma_t");
        break;
      case ParameterKind::albedo:
        r.kind = SCORE_ALBEDO;
        if (grey(medium(index).albedo)) r.channel = 0;
        want("score_medium_scattering", "albedo");
        break;
      case ParameterKind::g:
        r = {SCORE_G, index, 0};
        want("score_henyey_greenstein", "g");
        break;
      case ParameterKind::alpha:
        r = {SCORE_ALPHA, index, 0};
        want("score_rough_dielectric_" + boundary(index), "alpha");
        want("score_rough_dielectric_decision_" + boundary(index), "alpha");
        break;
      case ParameterKind::int_ior:
      case ParameterKind::ext_ior:
        r = {SCORE_ETA, index, 0};
        want("score_rough_dielectric_" + boundary(index), "eta");
        break;
      case ParameterKind::reflectance:
        r.kind = SCORE_REFLECTANCE;
        if (grey(bsdf(index).reflectance.value)) r.channel = 0;
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
  double factor(const Parameter& p, int index, int channel) const {
    switch (p.kind) {
      case ParameterKind::sigma_t:
      case ParameterKind::scale: {
        const Medium& m = medium(index);
        const auto chain =
            jacobian(scaled_extinction, std::array{m.sigma_t[static_cast<std::size_t>(channel)], m.scale});
        return chain.by[0][p.kind == ParameterKind::scale ? 1 : 0];
      }
      case ParameterKind::int_ior:
      case ParameterKind::ext_ior:
        return jacobian(relative_index, std::array{bsdf(index).int_ior, bsdf(index).ext_ior})
            .by[0][p.kind == ParameterKind::ext_ior ? 1 : 0];
      default:
        return 1;
    }
  }

  static bool grey(const Rgb& c) { return c[0] == c[1] && c[1] == c[2]; }
  const Medium& medium(int index) const { return scene_.media[static_cast<std::size_t>(index)]; }
  const Bsdf& bsdf(int index) const { return scene_.bsdfs[static_cast<std::size_t>(index)]; }
  std::string boundary(int index) const { return bsdf(index).distribution == Distribution::ggx ? "ggx" : "beckmann"; }
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
    builder.add(p, static_cast<int>(name - names.begin()));
  }
  return std::move(builder.data);
}

}  // namespace itn
