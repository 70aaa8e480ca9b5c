#include "runtime/scene/parameters.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

namespace itn {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
const char* const not_yet = "not yet: this version renders values only";
const char* const smooth = "smooth interface: use roughdielectric with a small alpha";
const char* const texture = "a texture, not a number";

struct Range {
  double low, high;
  bool low_included = true, high_included = true;
};
constexpr Range unit_interval{0, 1}, non_negative{0, infinity, true, false}, positive{0, infinity, false, false};

class List {
 public:
  void number(const std::string& name, double value, const Range& range, const char* why_not,
              const std::string& unit = "") {
    parameters.push_back({name, value, range.low, range.high, range.low_included, range.high_included, unit, why_not});
  }
  void colour(const std::string& name, const Rgb& value, const Range& range, const char* why_not,
              bool by_component = false, const std::string& unit = "") {
    if (!by_component && value[0] == value[1] && value[1] == value[2])
      return number(name, value[0], range, why_not, unit);
    for (std::size_t c = 0; c < 3; ++c) number(name + "." + "RGB"[c], value[c], range, why_not, unit);
  }

  std::vector<Parameter> parameters;
};

void add(List& list, const Medium& m) {
  list.colour(m.id + ".sigma_t", m.sigma_t, non_negative, not_yet, m.sigma_t_is_rgb, "1/scene unit");
  list.colour(m.id + ".albedo", m.albedo, unit_interval, not_yet, m.albedo_is_rgb);
  list.number(m.id + ".scale", m.scale, non_negative, not_yet);
  if (!m.isotropic) list.number(m.phase_id + ".g", m.g, {-1, 1, false, false}, not_yet);
}

void add(List& list, const Bsdf& b) {
  switch (b.kind) {
    case BsdfKind::null:
      return;
    case BsdfKind::diffuse:
      if (b.reflectance.bitmap)
        list.number(b.id + ".reflectance", std::nan(""), unit_interval, texture);
      else
        list.colour(b.id + ".reflectance", b.reflectance.value, unit_interval, not_yet);
      return;
    case BsdfKind::roughdielectric:
      list.number(b.id + ".alpha", b.alpha, {0, 1, false, true}, not_yet);
      list.number(b.id + ".int_ior", b.int_ior, positive, not_yet);
      list.number(b.id + ".ext_ior", b.ext_ior, positive, not_yet);
      return;
    case BsdfKind::dielectric:
      list.number(b.id + ".int_ior", b.int_ior, positive, smooth);
      list.number(b.id + ".ext_ior", b.ext_ior, positive, smooth);
      return;
  }
}

void add(List& list, const Emitter& e) {
  switch (e.kind) {
    case Emitter::Kind::constant:
      return list.colour(e.id + ".radiance", e.radiance, non_negative, not_yet);
    case Emitter::Kind::envmap:
      return list.number(e.id + ".scale", e.scale, non_negative, not_yet);
    case Emitter::Kind::sunsky:
      list.number(e.id + ".turbidity", e.sunsky.turbidity, {1, 10}, not_yet);
      list.colour(e.id + ".albedo", e.sunsky.albedo, unit_interval, not_yet);
      list.number(e.id + ".sun_scale", e.sunsky.sun_scale, non_negative, not_yet);
      list.number(e.id + ".sky_scale", e.sunsky.sky_scale, non_negative, not_yet);
      return;
  }
}

}  // namespace

std::string Parameter::range() const {
  return fmt::format("{}{}, {}{}", low_included ? '[' : '(', low, high, high_included ? ']' : ')');
}

std::vector<Parameter> list_parameters(const Scene& scene) {
  List list;
  for (const Medium& medium : scene.media) add(list, medium);
  for (const Bsdf& bsdf : scene.bsdfs) add(list, bsdf);
  if (scene.environment) add(list, *scene.environment);
  return std::move(list.parameters);
}

}  // namespace itn
