#include <fmt/core.h>

#include <algorithm>
#include <set>

#include "kernels/model/models.h"
#include "kernels/shared/declaration.h"
#include "runtime/scene/model/sized_model.h"
#include "runtime/scene/transform.h"
#include "runtime/scene/xml/builder.h"
#include "runtime/scene/xml/message.h"
#include "runtime/scene/xml/sun_position.h"

namespace itn {
namespace {

// A rotation: Mitsuba also takes scalings, which shear the directions of an environment.
Transform rotation(Properties& properties) {
  const Transform t = properties.transform("to_world");
  if (!is_rigid(t))
    properties.fail_at("to_world", "to_world scales or shears; an environment can only be turned: need a rotation");
  return t;
}

// name_rest, for each of the list: reads the properties of an environment that are no numbers.
void constant_rest(Builder& /*builder*/, Properties& /*properties*/, Environment& /*environment*/) {}

// Mitsuba's least size of an environment map: below it the last column and the last row are repeated.
std::shared_ptr<const Bitmap> padded(const std::shared_ptr<const Bitmap>& bitmap) {
  constexpr int least_width = 2, least_height = 3;
  if (bitmap->width < 1 || bitmap->height < 1 || (bitmap->width >= least_width && bitmap->height >= least_height))
    return bitmap;
  Bitmap larger;
  larger.width = std::max(bitmap->width, least_width);
  larger.height = std::max(bitmap->height, least_height);
  larger.channels = bitmap->channels;
  for (int y = 0; y < larger.height; ++y)
    for (int x = 0; x < larger.width; ++x)
      for (int c = 0; c < larger.channels; ++c) {
        const int pixel = std::min(y, bitmap->height - 1) * bitmap->width + std::min(x, bitmap->width - 1);
        larger.data.push_back(bitmap->data[static_cast<std::size_t>(pixel * bitmap->channels + c)]);
      }
  return std::make_shared<const Bitmap>(std::move(larger));
}

void envmap_rest(Builder& builder, Properties& properties, Environment& environment) {
  const std::shared_ptr<const Bitmap> given = load_bitmap(builder, properties, "filename", false);
  environment.bitmap = padded(given);
  if (environment.bitmap != given)
    builder.warn(
        environment.where,
        fmt::format("{}: a picture of {} x {} pixels is taken as one of {} x {}, whose last column and row are "
                    "repeated, as in Mitsuba",
                    properties.title(), given->width, given->height, environment.bitmap->width,
                    environment.bitmap->height));
  environment.to_world = rotation(properties);
  properties.boolean("mis_compensation", false);  // how Mitsuba samples: changes no expected value
}

PlaceAndTime parse_place_and_time(Properties& properties) {
  PlaceAndTime when;
  const auto within = [&](const char* name, double value, double low, double high) {
    if (!(value >= low && value <= high))
      properties.fail_at(name, fmt::format("{} = {} is outside [{}, {}]", name, value, low, high));
    return value;
  };
  when.latitude = within("latitude", properties.number("latitude", when.latitude), -90, 90);
  when.longitude = within("longitude", properties.number("longitude", when.longitude), -180, 180);
  when.timezone = within("timezone", properties.number("timezone", when.timezone), -15, 15);
  const auto whole = [&](const char* name, int fallback, double low, double high) {
    return static_cast<int>(within(name, static_cast<double>(properties.integer(name, fallback)), low, high));
  };
  when.year = whole("year", when.year, 1, 9999);
  when.month = whole("month", when.month, 1, 12);
  when.day = whole("day", when.day, 1, 31);
  when.hour = within("hour", properties.number("hour", when.hour), 0, 24);
  when.minute = within("minute", properties.number("minute", when.minute), 0, 60);
  when.second = within("second", properties.number("second", when.second), 0, 60);
  return when;
}

// In the sky's own coordinates. sun_direction is given in world space, a place and time tell the local direction.
Vec3 parse_sun_direction(Properties& properties, const Transform& to_world) {
  if (!properties.has("sun_direction")) return sun_direction(parse_place_and_time(properties));
  for (const char* name : {"latitude", "longitude", "timezone", "year", "month", "day", "hour", "minute", "second"})
    if (properties.has(name))
      properties.fail_at(name, fmt::format("both sun_direction and {} given; need one or the other", name));
  const Vec3 world = properties.vector("sun_direction", {0, 0, 1});
  if (!(length(world) > 0)) properties.fail_at("sun_direction", "sun_direction is (0, 0, 0); need a direction");
  const auto& m = to_world.m;  // rigid: its transpose is its inverse
  return normalize(Vec3{m[0] * world[0] + m[4] * world[1] + m[8] * world[2],
                        m[1] * world[0] + m[5] * world[1] + m[9] * world[2],
                        m[2] * world[0] + m[6] * world[1] + m[10] * world[2]});
}

void sunsky_rest(Builder& builder, Properties& properties, Environment& environment) {
  Sun& sun = environment.sun;
  sun.aperture = properties.number("sun_aperture", 0.5358);
  if (!(sun.aperture > 0 && sun.aperture <= 90))
    properties.fail_at("sun_aperture", "sun_aperture = " + to_text(sun.aperture) + "; need degrees in (0, 90]");
  sun.complex = properties.boolean("complex_sun", false);
  environment.to_world = rotation(properties);
  sun.direction = parse_sun_direction(properties, environment.to_world);
  if (sun.direction[2] < 0) builder.warn(environment.where, "emitter \"sunsky\": the sun is below the horizon");
}

void spherical_harmonics_rest(Builder& /*builder*/, Properties& properties, Environment& environment) {
  environment.to_world = rotation(properties);
}

// The highest order of which there is a coefficient; -1: there is none.
int harmonics_order(Properties& properties) {
  std::set<std::string> given;
  for (const auto& child : properties.element().children) given.insert(child->attribute("name"));
  int order = -1;
  for (int l = 0; l <= GREATEST_HARMONICS_ORDER; ++l)
    for (int m = -l; m <= l; ++m)
      if (given.count(fmt::format("c_{}_{}", l, m)) > 0) order = l;
  if (order < 0)
    properties.fail_at(
        "", fmt::format("no coefficient; need <rgb name=\"c_0_0\" value=\"...\"/>, and others c_l_m, l up to "
                        "{} and m from -l to l",
                        GREATEST_HARMONICS_ORDER));
  return order;
}

#define ITN_REST(name, PREFIX, type) \
  if (environment.model->id == MODEL_##name) name##_rest(builder, properties, environment);
void read_rest(Builder& builder, Properties& properties, Environment& environment) { ENVIRONMENT_LIST(ITN_REST) }

bool is_in_shape(const Model& model) { return (model.traits & (LIGHT_ON_SHAPE | LIGHT_BEAM)) != 0; }

// Types of the lights that belong into a shape, or of the others.
std::vector<std::string> light_types(bool in_shape) {
  std::vector<std::string> types;
  for (const Model& model : light_models())
    if (is_in_shape(model) == in_shape && (types.empty() || types.back() != model.type)) types.push_back(model.type);
  return types;
}

// Mean of a texture, for the guess of a light's power.
Rgb mean_of(const Texture& texture) {
  std::vector<Rgb> values = texture.colours;
  if (texture.bitmap) {
    const auto channels = static_cast<std::size_t>(texture.bitmap->channels);
    const std::vector<float>& data = texture.bitmap->data;
    for (std::size_t i = 0; i < data.size(); i += channels) {
      const auto at = [&](std::size_t c) { return static_cast<double>(data[i + std::min(c, channels - 1)]); };
      values.push_back({at(0), at(1), at(2)});
    }
  }
  Rgb sum{0, 0, 0};
  for (const Rgb& v : values)
    for (std::size_t c = 0; c < 3; ++c) sum[c] += v[c] / static_cast<double>(values.size());
  return sum;
}

bool shows_texture(const Model& model) {
  return (model.traits & LIGHT_ON_SHAPE) != 0 && (model.traits & LIGHT_TINTED) != 0;
}

// Relative frequency with which Mitsuba samples an emitter.
double sampling_weight(Properties& properties) {
  const double weight = properties.number("sampling_weight", 1);
  if (!(weight >= 0))
    properties.fail_at("sampling_weight", "sampling_weight = " + to_text(weight) + "; need 0 or more");
  return weight;
}

int read_light(Builder& builder, const Element& element, const Model& model) {
  Properties properties = builder.properties(element);
  Light light;
  light.become(model);
  light.id = element.id;
  light.where = element.where;
  read_parameters(builder, properties, light);
  if (Texture* texture = shows_texture(model) ? &light.value("radiance") : nullptr; texture && texture->model)
    texture->value = mean_of(*texture);
  // Paths find a light with extent by themselves; one without is never sampled then.
  const bool sampled = sampling_weight(properties) > 0;
  if (!(sampled && builder.samples_emitters) && !(model.traits & LIGHT_ON_SHAPE)) {
    builder.put_out.push_back(element.where);
    builder.warn(element.where, fmt::format("{}: {} 0 puts it out, as in Mitsuba: no path finds it", properties.title(),
                                            sampled ? "the integrator's emitter_samples" : "sampling_weight"));
  }
  properties.finish();
  builder.scene.lights.push_back(light);
  return static_cast<int>(builder.scene.lights.size()) - 1;
}

std::vector<std::string> emitter_types() {
  std::vector<std::string> types = types_of(environment_models());
  for (const std::string& type : light_types(false)) types.push_back(type);
  return types;
}

}  // namespace

int read_shape_light(Builder& builder, const Element& element) {
  const Model* model = find_model(light_models(), element.attribute("type"));
  if (!model || !is_in_shape(*model)) fail_type(element, light_types(true));
  Properties properties = builder.properties(element);
  const bool textured = properties.is_object("radiance") && !properties.is_spectrum("radiance");
  for (const Model& other : light_models())
    if (textured && other.type == model->type && shows_texture(other)) return read_light(builder, element, other);
  return read_light(builder, element, *model);
}

void read_emitter(Builder& builder, const Element& element) {
  Properties properties = builder.properties(element);
  if (const Model* model = find_model(light_models(), properties.type())) {
    if (is_in_shape(*model)) {
      build_shape_light(builder, element);  // a shape refers to it
      return;
    }
    read_light(builder, element, *model);
    return;
  }
  const Model* model = find_model(environment_models(), properties.type());
  if (!model) fail_type(element, emitter_types());
  Environment environment;
  environment.become(model->id == MODEL_spherical_harmonics ? spherical_harmonics_model(harmonics_order(properties))
                                                            : *model);
  environment.id = element.id;
  environment.where = element.where;
  read_parameters(builder, properties, environment);
  read_rest(builder, properties, environment);
  sampling_weight(properties);  // paths find its light by themselves: it changes no expected value
  properties.finish();
  if (builder.scene.environment)
    fail(element.where, "second environment emitter, the first is at " + to_string(builder.scene.environment->where) +
                            "; need one a scene");
  builder.scene.environment = environment;
}

}  // namespace itn
