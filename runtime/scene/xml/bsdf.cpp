#include "runtime/scene/xml/builder.h"
#include "runtime/scene/xml/ior.h"
#include "runtime/scene/xml/message.h"

namespace itn {
namespace {

const std::vector<std::string> types = {"null", "diffuse", "dielectric", "roughdielectric", "twosided"};

Rgb specular(Properties& properties, const std::string& name) {
  const Rgb value = properties.color(name, {{1, 1, 1}}).value;
  for (double v : value)
    if (!(v >= 0 && v <= 1)) properties.fail_at(name, quote(name) + " = " + to_text(v) + " is outside [0, 1]");
  return value;
}

double roughness(Properties& properties, const std::string& name, double fallback) {
  const double alpha = properties.number(name, fallback);
  if (!(alpha > 0))
    properties.fail_at(name,
                       name + " = " + to_text(alpha) + "; need more than 0: for a smooth boundary use dielectric");
  if (alpha > 1) properties.fail_at(name, name + " = " + to_text(alpha) + "; need at most 1");
  return alpha;
}

double roughness(Properties& properties) {
  const bool two_axes = properties.has("alpha_u") || properties.has("alpha_v");
  if (!two_axes) return roughness(properties, "alpha", 0.1);
  if (properties.has("alpha"))
    properties.fail_at("alpha", "both alpha and alpha_u, alpha_v given; need one or the other");
  if (!properties.has("alpha_u") || !properties.has("alpha_v"))
    properties.fail_at("", "only one of alpha_u and alpha_v given; need both, or alpha");
  const double u = roughness(properties, "alpha_u", 0.1), v = roughness(properties, "alpha_v", 0.1);
  if (u != v)
    properties.fail_at("alpha_v", "alpha_u = " + to_text(u) + " differs from alpha_v = " + to_text(v) +
                                      "; need isotropic roughness: give alpha");
  return u;
}

}  // namespace

int build_bsdf(Builder& builder, const Element& element) {
  if (const auto built = builder.bsdf_of.find(&element); built != builder.bsdf_of.end()) return built->second;
  Properties properties = builder.properties(element);

  if (properties.type() == "twosided") {
    const Element* inner = properties.object("bsdf");
    properties.finish();
    if (!inner) fail(element.where, "bsdf \"twosided\" is empty; need a nested <bsdf type=\"diffuse\">");
    if (inner == &element) fail(element.where, "bsdf \"twosided\" contains a reference to itself; break the circle");
    if (inner->attribute("type") != "diffuse")
      fail(inner->where, "bsdf \"twosided\" around " + quote(inner->attribute("type")) + "; need \"diffuse\"");
    Bsdf bsdf = builder.scene.bsdfs[static_cast<std::size_t>(build_bsdf(builder, *inner))];
    bsdf.twosided = true;
    builder.scene.bsdfs.push_back(bsdf);
    return builder.bsdf_of[&element] = static_cast<int>(builder.scene.bsdfs.size()) - 1;
  }

  Bsdf bsdf;
  bsdf.id = element.id;
  bsdf.where = element.where;
  if (properties.type() == "null") {
    bsdf.kind = BsdfKind::null;
  } else if (properties.type() == "diffuse") {
    bsdf.kind = BsdfKind::diffuse;
    bsdf.reflectance = build_texture(builder, properties, "reflectance", 0.5);
  } else if (properties.type() == "dielectric" || properties.type() == "roughdielectric") {
    bsdf.kind = properties.type() == "dielectric" ? BsdfKind::dielectric : BsdfKind::roughdielectric;
    bsdf.int_ior = parse_ior(properties, "int_ior", "bk7");
    bsdf.ext_ior = parse_ior(properties, "ext_ior", "air");
    bsdf.specular_reflectance = specular(properties, "specular_reflectance");
    bsdf.specular_transmittance = specular(properties, "specular_transmittance");
    if (bsdf.kind == BsdfKind::roughdielectric) {
      if (bsdf.int_ior == bsdf.ext_ior)
        properties.fail_at("int_ior", "int_ior and ext_ior are both " + to_text(bsdf.int_ior) +
                                          "; need different ones: for an "
                                          "index-matched boundary use null");
      bsdf.distribution =
          properties.choice("distribution", {"beckmann", "ggx"}) == "ggx" ? Distribution::ggx : Distribution::beckmann;
      bsdf.alpha = roughness(properties);
      properties.boolean("sample_visible", true);  // how Mitsuba samples: changes no expected value
    }
  } else {
    fail_type(element, types);
  }
  properties.finish();
  builder.scene.bsdfs.push_back(bsdf);
  return builder.bsdf_of[&element] = static_cast<int>(builder.scene.bsdfs.size()) - 1;
}

}  // namespace itn
