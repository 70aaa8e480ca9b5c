#include <cmath>

#include "runtime/scene/transform.h"
#include "runtime/scene/xml/builder.h"
#include "runtime/scene/xml/message.h"

namespace itn {
namespace {

void build_constant(Properties& properties, Emitter& emitter) {
  emitter.kind = Emitter::Kind::constant;
  emitter.radiance = properties.color("radiance", {{1, 1, 1}}).value;
  for (double v : emitter.radiance)
    if (v < 0) properties.fail_at("radiance", "radiance = " + to_text(v) + " is negative; need 0 or more");
}

double not_negative(Properties& properties, const std::string& name, double fallback) {
  const double value = properties.number(name, fallback);
  if (value < 0) properties.fail_at(name, name + " = " + to_text(value) + " is negative; need 0 or more");
  return value;
}

// A rotation: Mitsuba also takes scalings, which shear the directions of an environment.
Transform rotation(Properties& properties) {
  const Transform t = properties.transform("to_world");
  if (!is_rigid(t))
    properties.fail_at("to_world", "to_world scales or shears; an environment can only be turned: need a rotation");
  return t;
}

void build_envmap(Builder& builder, Properties& properties, Emitter& emitter) {
  emitter.kind = Emitter::Kind::envmap;
  emitter.bitmap = load_bitmap(builder, properties, "filename", false);
  emitter.scale = not_negative(properties, "scale", 1);
  emitter.to_world = rotation(properties);
  properties.boolean("mis_compensation", false);  // how Mitsuba samples: changes no expected value
}

void build_sunsky(Properties& properties, Emitter& emitter) {
  emitter.kind = Emitter::Kind::sunsky;
  SunSky& sky = emitter.sunsky;
  sky.turbidity = properties.number("turbidity", 3);
  if (!(sky.turbidity >= 1 && sky.turbidity <= 10))
    properties.fail_at("turbidity", "turbidity = " + to_text(sky.turbidity) + " is outside [1, 10]");
  sky.albedo = properties.color("albedo", {{0.3, 0.3, 0.3}}).value;
  for (double v : sky.albedo)
    if (!(v >= 0 && v <= 1)) properties.fail_at("albedo", "albedo = " + to_text(v) + " is outside [0, 1]");
  sky.sun_scale = not_negative(properties, "sun_scale", 1);
  sky.sky_scale = not_negative(properties, "sky_scale", 1);
  sky.sun_aperture = properties.number("sun_aperture", 0.5358);
  if (!(sky.sun_aperture > 0 && sky.sun_aperture <= 90))
    properties.fail_at("sun_aperture", "sun_aperture = " + to_text(sky.sun_aperture) + "; need degrees in (0, 90]");
  sky.complex_sun = properties.boolean("complex_sun", false);
  emitter.to_world = rotation(properties);
  if (!properties.has("sun_direction"))
    properties.fail_at("sun_direction",
                       "no sun_direction; need a vector towards the sun (places and times are not supported)");
  const Vec3 direction = properties.vector("sun_direction", {0, 0, 1});
  if (!(length(direction) > 0)) properties.fail_at("sun_direction", "sun_direction is (0, 0, 0); need a direction");
  sky.sun_direction = normalize(direction);
}

}  // namespace

void build_emitter(Builder& builder, const Element& element) {
  Properties properties = builder.properties(element);
  Emitter emitter;
  emitter.id = element.id;
  emitter.where = element.where;
  if (properties.type() == "constant") {
    build_constant(properties, emitter);
  } else if (properties.type() == "envmap") {
    build_envmap(builder, properties, emitter);
  } else if (properties.type() == "sunsky") {
    build_sunsky(properties, emitter);
  } else {
    fail_type(element, {"constant", "envmap", "sunsky"});
  }
  properties.number("sampling_weight", 1);  // how often Mitsuba samples it: changes no expected value
  properties.finish();
  if (builder.scene.environment)
    fail(element.where, "second environment emitter, the first is at " + to_string(builder.scene.environment->where) +
                            "; need one a scene");
  builder.scene.environment = emitter;
}

}  // namespace itn
