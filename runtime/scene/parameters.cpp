#include "runtime/scene/parameters.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "runtime/error.h"

namespace itn {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
const char* const smooth = "smooth interface: use roughdielectric with a small alpha";
const char* const texture = "a texture, not a number";
const char* const zero = "0: the paths that a change would bring have no probability; start from a small value";
const char* const tiny = "below 1e-30, where single precision loses its score; start from a larger value";
const char* const straight = "the two indices are nearly equal, and light goes straight on: use a bsdf null";
const char* const far_apart = "the ratio of the two indices is beyond 1000, where single precision loses its score";
const char* const too_dense = "sigma_t times scale above 1e30 is rendered as 1e30";
const char* const too_sharp = "g beyond 0.999999 is rendered as 0.999999";
const char* const too_smooth = "alpha below 0.0001 is rendered as 0.0001";
const char* const yes = "";

// Of numbers that are factors of a path's throughput: its score, 1 / value, is not defined where they are 0.
const char* unless_zero(double value) { return value == 0 ? zero : value < 1e-30 ? tiny : yes; }
// Of numbers in which radiance is linear or at least smooth.
const char* always(double /*value*/) { return yes; }

struct Range {
  double low, high;
  bool low_included = true, high_included = true;
};
constexpr Range unit_interval{0, 1}, non_negative{0, infinity, true, false}, index_range{least_ior, greatest_ior};

class List {
 public:
  void owner(int index) { index_ = index; }
  void number(const std::string& name, ParameterKind kind, double value, const Range& range, const char* why_not,
              const std::string& unit = "", int component = -1) {
    parameters.push_back({name,
                          value,
                          range.low,
                          range.high,
                          range.low_included,
                          range.high_included,
                          unit,
                          why_not,
                          kind,
                          {index_},
                          component});
  }
  // why_not: for a component of that value.
  void colour(const std::string& name, ParameterKind kind, const Rgb& value, const Range& range,
              const std::function<const char*(double)>& why_not, bool by_component = false,
              const std::string& unit = "") {
    if (!by_component && value[0] == value[1] && value[1] == value[2])
      return number(name, kind, value[0], range, why_not(value[0]), unit);
    for (std::size_t c = 0; c < 3; ++c)
      number(name + "." + "RGB"[c], kind, value[c], range, why_not(value[c]), unit, static_cast<int>(c));
  }

  std::vector<Parameter> parameters;

 private:
  int index_ = 0;
};

void add(List& list, const Medium& m) {
  const auto of_product = [&](double sigma_t) {
    const double product = m.scale > 0 ? sigma_t * m.scale : sigma_t;
    return product > greatest_sigma_t ? too_dense : unless_zero(product);
  };
  list.colour(m.id + ".sigma_t", ParameterKind::sigma_t, m.sigma_t, non_negative, of_product, m.sigma_t_is_rgb,
              "1/scene unit");
  list.colour(m.id + ".albedo", ParameterKind::albedo, m.albedo, unit_interval, unless_zero, m.albedo_is_rgb);
  const char* scale = unless_zero(m.scale);
  for (const double sigma_t : m.sigma_t)
    if (sigma_t > 0 && !*scale) scale = of_product(sigma_t);
  list.number(m.id + ".scale", ParameterKind::scale, m.scale, non_negative, scale);
  if (!m.isotropic)
    list.number(m.phase_id + ".g", ParameterKind::g, m.g, {-1, 1, false, false},
                std::fabs(m.g) > greatest_g ? too_sharp : yes);
}

// Why a rough boundary has no score, if it has none.
const char* rough_score(const Bsdf& b) {
  const double ratio = b.int_ior / b.ext_ior;
  if (std::fabs(ratio - 1) < 1e-4) return straight;
  if (ratio < 1e-3 || ratio > 1e3) return far_apart;
  return b.alpha < least_alpha ? too_smooth : yes;
}

void add(List& list, const Bsdf& b) {
  switch (b.kind) {
    case BsdfKind::null:
      return;
    case BsdfKind::diffuse:
      if (b.reflectance.bitmap)
        list.number(b.id + ".reflectance", ParameterKind::reflectance, std::nan(""), unit_interval, texture);
      else
        list.colour(b.id + ".reflectance", ParameterKind::reflectance, b.reflectance.value, unit_interval, unless_zero);
      return;
    case BsdfKind::roughdielectric:
      list.number(b.id + ".alpha", ParameterKind::alpha, b.alpha, {0, 1, false, true}, rough_score(b));
      list.number(b.id + ".int_ior", ParameterKind::int_ior, b.int_ior, index_range, rough_score(b));
      list.number(b.id + ".ext_ior", ParameterKind::ext_ior, b.ext_ior, index_range, rough_score(b));
      return;
    case BsdfKind::dielectric:
      list.number(b.id + ".int_ior", ParameterKind::int_ior, b.int_ior, index_range, smooth);
      list.number(b.id + ".ext_ior", ParameterKind::ext_ior, b.ext_ior, index_range, smooth);
      return;
  }
}

void add(List& list, const Emitter& e) {
  switch (e.kind) {
    case Emitter::Kind::constant:
      return list.colour(e.id + ".radiance", ParameterKind::radiance, e.radiance, non_negative, always);
    case Emitter::Kind::envmap:
      return list.number(e.id + ".scale", ParameterKind::envmap_scale, e.scale, non_negative, yes);
    case Emitter::Kind::sunsky:
      list.number(e.id + ".turbidity", ParameterKind::turbidity, e.sunsky.turbidity, {1, 10}, yes);
      list.colour(e.id + ".albedo", ParameterKind::ground_albedo, e.sunsky.albedo, unit_interval, always);
      list.number(e.id + ".sun_scale", ParameterKind::sun_scale, e.sunsky.sun_scale, non_negative, yes);
      list.number(e.id + ".sky_scale", ParameterKind::sky_scale, e.sunsky.sky_scale, non_negative, yes);
      return;
  }
}

// What stands inside of a twosided BSDF only has no surface of its own.
bool is_inside_another(const Scene& scene, std::size_t bsdf) {
  const auto same_id = [&](const Bsdf& b) { return b.id == scene.bsdfs[bsdf].id; };
  const bool used = std::any_of(scene.shapes.begin(), scene.shapes.end(),
                                [&](const Shape& s) { return s.bsdf == static_cast<int>(bsdf); });
  return !used && std::count_if(scene.bsdfs.begin(), scene.bsdfs.end(), same_id) > 1;
}

// A phase function that several media share, or a BSDF that is used with one side and with two, is one number of the
// scene.
std::vector<Parameter> each_once(const std::vector<Parameter>& parameters) {
  std::vector<Parameter> result;
  for (const Parameter& p : parameters) {
    const auto same = [&](const Parameter& other) { return other.name == p.name; };
    const auto found = std::find_if(result.begin(), result.end(), same);
    if (found == result.end()) {
      result.push_back(p);
    } else {
      found->indices.push_back(p.indices.front());
      if (found->not_differentiable.empty()) found->not_differentiable = p.not_differentiable;
    }
  }
  return result;
}

// index: of the medium or BSDF
void set_number(Scene& scene, const Parameter& p, std::size_t index, double value) {
  const auto set_colour = [&](Rgb& colour) {
    for (int c = 0; c < 3; ++c)
      if (p.component < 0 || p.component == c) colour[static_cast<std::size_t>(c)] = value;
  };
  switch (p.kind) {
    case ParameterKind::sigma_t:
      return set_colour(scene.media.at(index).sigma_t);
    case ParameterKind::albedo:
      return set_colour(scene.media.at(index).albedo);
    case ParameterKind::scale:
      scene.media.at(index).scale = value;
      return;
    case ParameterKind::g:
      scene.media.at(index).g = value;
      return;
    case ParameterKind::alpha:
      scene.bsdfs.at(index).alpha = value;
      return;
    case ParameterKind::int_ior:
      scene.bsdfs.at(index).int_ior = value;
      return;
    case ParameterKind::ext_ior:
      scene.bsdfs.at(index).ext_ior = value;
      return;
    case ParameterKind::reflectance:
      if (scene.bsdfs.at(index).reflectance.bitmap)
        throw UsageError(fmt::format("parameter {}: cannot be set: {}", p.name, texture));
      return set_colour(scene.bsdfs.at(index).reflectance.value);
    case ParameterKind::radiance:
      return set_colour(scene.environment.value().radiance);
    case ParameterKind::envmap_scale:
      scene.environment.value().scale = value;
      return;
    case ParameterKind::turbidity:
      scene.environment.value().sunsky.turbidity = value;
      return;
    case ParameterKind::ground_albedo:
      return set_colour(scene.environment.value().sunsky.albedo);
    case ParameterKind::sun_scale:
      scene.environment.value().sunsky.sun_scale = value;
      return;
    case ParameterKind::sky_scale:
      scene.environment.value().sunsky.sky_scale = value;
      return;
  }
}

}  // namespace

std::string Parameter::range() const {
  return fmt::format("{}{}, {}{}", low_included ? '[' : '(', low, high, high_included ? ']' : ')');
}

std::vector<Parameter> list_parameters(const Scene& scene) {
  List list;
  for (std::size_t i = 0; i < scene.media.size(); ++i) {
    list.owner(static_cast<int>(i));
    add(list, scene.media[i]);
  }
  for (std::size_t i = 0; i < scene.bsdfs.size(); ++i) {
    if (is_inside_another(scene, i)) continue;
    list.owner(static_cast<int>(i));
    add(list, scene.bsdfs[i]);
  }
  if (scene.environment) add(list, *scene.environment);
  return each_once(list.parameters);
}

bool is_of_light(const Parameter& p) { return p.kind >= ParameterKind::radiance; }

void set_parameter(Scene& scene, const Parameter& p, double value) {
  if (!p.contains(value))
    throw UsageError(fmt::format("parameter {}: got {}, need a number in {}", p.name, value, p.range()));
  for (const int i : p.indices) set_number(scene, p, static_cast<std::size_t>(i), value);
}

Parameter find_parameter(const std::vector<Parameter>& parameters, const std::string& name) {
  std::string names;
  for (const Parameter& p : parameters) {
    if (p.name == name) return p;
    names += (names.empty() ? "" : ", ") + p.name;
  }
  throw UsageError(fmt::format("parameter {}: the scene has none of that name; need one of: {}", name, names));
}

std::vector<std::string> by_component(const std::vector<Parameter>& parameters, const std::vector<std::string>& texts) {
  std::vector<std::string> result;
  for (const std::string& text : texts) {
    const std::string name = text.substr(0, text.find('='));
    const std::size_t before = result.size();
    for (const Parameter& p : parameters)
      if (p.component >= 0 && p.name.substr(0, p.name.size() - 2) == name)
        result.push_back(p.name + text.substr(name.size()));
    if (result.size() == before) result.push_back(text);
  }
  return result;
}

}  // namespace itn
