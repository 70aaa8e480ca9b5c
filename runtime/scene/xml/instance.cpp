// Reading what models declare (kernels/shared/declaration.h).
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "itn/colour.h"
#include "itn/error.h"
#include "kernels/model/obstacle.h"
#include "kernels/shared/declaration.h"
#include "runtime/scene/model/sized_model.h"
#include "runtime/scene/transform.h"
#include "runtime/scene/xml/builder.h"
#include "runtime/scene/xml/ior.h"
#include "runtime/scene/xml/message.h"
#include "runtime/scene/xml/metal.h"
#include "runtime/scene/xml/values.h"

namespace itn {
namespace {

std::string range_of(const ParameterKind& kind) {
  return fmt::format("{}{}, {}{}", kind.low_included ? '[' : '(', kind.low, kind.high, kind.high_included ? ']' : ')');
}

}  // namespace

void check_in_range(Properties& properties, const DeclaredParameter& p, double value) {
  const ParameterKind& k = p.kind;
  const bool above = k.low_included ? value >= k.low : value > k.low;
  const bool below = k.high_included ? value <= k.high : value < k.high;
  if (!above || !below)
    properties.fail_at(p.name, fmt::format("{} = {} is outside {}{}", p.name, to_text(value), range_of(k),
                                           *k.meaning ? fmt::format("; it is {}", k.meaning) : ""));
}

namespace {

double roughness(Properties& properties, const std::string& name, double fallback) {
  const double alpha = properties.number(name, fallback);
  if (!(alpha > 0))
    properties.fail_at(name,
                       name + " = " + to_text(alpha) + "; need more than 0: for a smooth boundary use dielectric");
  if (alpha > 1) properties.fail_at(name, name + " = " + to_text(alpha) + "; need at most 1");
  return alpha;
}

// alpha, or alpha_u and alpha_v where they are equal: else the model is another one, or there is none.
double roughness(Properties& properties, double fallback) {
  const bool two_axes = properties.has("alpha_u") || properties.has("alpha_v");
  if (!two_axes) return roughness(properties, "alpha", fallback);
  if (properties.has("alpha"))
    properties.fail_at("alpha", "both alpha and alpha_u, alpha_v given; need one or the other");
  if (!properties.has("alpha_u") || !properties.has("alpha_v"))
    properties.fail_at("", "only one of alpha_u and alpha_v given; need both, or alpha");
  const double u = roughness(properties, "alpha_u", fallback), v = roughness(properties, "alpha_v", fallback);
  if (u != v)
    properties.fail_at("alpha_v", "alpha_u = " + to_text(u) + " differs from alpha_v = " + to_text(v) +
                                      "; need isotropic roughness: give alpha");
  return u;
}

// `name`, or where to_world moves the origin.
Vec3 position(Properties& properties, const std::string& name) {
  if (!properties.has(name)) return transform_point(properties.transform("to_world"), {0, 0, 0});
  if (properties.has("to_world"))
    properties.fail_at(name, fmt::format("both {} and to_world given; need one or the other", name));
  return properties.vector(name, {0, 0, 0});
}

// Image of a unit vector under to_world, of length 1.
Vec3 axis(Properties& properties, const Vec3& of) {
  const Vec3 turned = transform_vector(properties.transform("to_world"), of);
  if (!(length(turned) > 0))
    properties.fail_at("to_world", "it gives no direction; need a matrix that can be inverted");
  return normalize(turned);
}

// A texture of any values from 0 on, or a colour of light.
Texture light_texture(Builder& builder, Properties& properties, const std::string& name, double fallback) {
  Texture texture;
  if (properties.is_object(name) && !properties.is_spectrum(name)) {
    const Element* element = properties.object("texture", name);
    if (!element) properties.fail_at(name, quote(name) + " is no texture and no colour; need one of them");
    Texture read = build_texture(builder, *element);
    if (!read.attribute.empty())
      properties.fail_at(name, quote(name) + " of a light is an attribute of a mesh; need a bitmap or a checkerboard");
    if (read.volume) properties.fail_at(name, quote(name) + " of a light is a volume; need a bitmap or a checkerboard");
    return read;
  }
  texture.value = properties.color(name, {{fallback, fallback, fallback}}, Quantity::emission).value;
  for (const double v : texture.value)
    if (v < 0) properties.fail_at(name, name + " = " + to_text(v) + " is negative; need 0 or more");
  return texture;
}

// Width over height of the picture that is thrown; of a colour: 1.
double picture_aspect(Builder& builder, Properties& properties) {
  const Texture picture = light_texture(builder, properties, "irradiance", 1);
  return picture.bitmap ? static_cast<double>(picture.bitmap->width) / picture.bitmap->height : 1;
}

// `name`, or the image of the z axis under to_world; of length 1.
Vec3 direction(Properties& properties, const std::string& name) {
  const bool given = properties.has(name);
  if (given && properties.has("to_world"))
    properties.fail_at(name, fmt::format("both {} and to_world given; need one or the other", name));
  const Vec3 d =
      given ? properties.vector(name, {0, 0, 1}) : transform_vector(properties.transform("to_world"), {0, 0, 1});
  if (!(length(d) > 0)) properties.fail_at(given ? name : "to_world", "it gives no direction; need one that is not 0");
  return normalize(d);
}

// One number of each colour, as Mitsuba takes it: the mean of a colour, the luminance of a pixel; not below `least`.
void make_numbers(Texture& texture, double least) {
  for (Rgb& colour : texture.colours) colour.fill(std::max((colour[0] + colour[1] + colour[2]) / 3, least));
  // Mitsuba 3.9.1 exchanges a checkerboard's two colours where it takes numbers from it, not colours: half a unit of u.
  if (texture.model->type == "checkerboard") texture.to_uv[2] += 0.5;
  if (texture.volume) {
    Volume volume = *texture.volume;
    VoxelGrid grey = *volume.grid;
    for (std::size_t i = 0; grey.channels == 3 && i < grey.data.size() / 3; ++i)
      grey.data[i] = static_cast<float>(
          luminance({static_cast<double>(grey.data[3 * i]), static_cast<double>(grey.data[3 * i + 1]),
                     static_cast<double>(grey.data[3 * i + 2])}));
    if (grey.channels == 3) grey.data.resize(grey.data.size() / 3);
    grey.channels = 1;
    for (float& v : grey.data) v = std::max(v, static_cast<float>(least));
    volume.grid = std::make_shared<const VoxelGrid>(std::move(grey));
    texture.volume = std::make_shared<const Volume>(std::move(volume));
  }
  if (!texture.bitmap) return;
  auto grey = std::make_shared<Bitmap>(*texture.bitmap);
  const auto channels = static_cast<std::size_t>(grey->channels);
  const std::size_t pixels = grey->data.size() / channels;
  for (std::size_t i = 0; i < pixels; ++i) {
    const auto at = [&](std::size_t c) {
      return static_cast<double>(grey->data[i * channels + std::min(c, channels - 1)]);
    };
    const double value = channels == 1 ? at(0) : luminance({at(0), at(1), at(2)});
    grey->data[i] = static_cast<float>(std::max(value, least));
  }
  grey->data.resize(pixels);
  grey->channels = 1;
  texture.bitmap = grey;
}

// A number in [0, 1], or a texture of numbers.
Texture share(Builder& builder, Properties& properties, const DeclaredParameter& p) {
  if (p.fallback < 0 && !properties.has(p.name))
    properties.fail_at("", fmt::format("no {}; need <float name=\"{}\"> in [0, 1] or a <texture>", p.name, p.name));
  Texture value = build_texture(builder, properties, p.name, p.fallback);
  if (!value.is_constant()) {
    make_numbers(value, 0);
    value.value.fill(std::max(p.fallback, 0.0));
  } else if (!grey(value.value)) {
    value.value.fill(luminance(value.value));
  }
  return value;
}

// A texture whose colours are directions, or one of them.
Texture normals(Builder& builder, Properties& properties, const DeclaredParameter& p) {
  const bool is_object = properties.has(p.name) && properties.is_object(p.name);
  const Element* element = is_object ? properties.object("texture", p.name) : nullptr;
  if (!element) properties.fail_at(p.name, fmt::format("need a nested <texture name=\"{}\"> with raw = true", p.name));
  Texture value;
  if (element->attribute("type") == "rawconstant") {
    Properties constant = builder.properties(*element);
    value.value = constant.vector("value", {0.5, 0.5, 1});
    constant.finish();
    for (const double v : value.value) check_in_range(properties, p, v);
    return value;
  }
  value = build_texture(builder, properties, p.name, 0);
  if (value.model && (!value.bitmap || value.bitmap->channels != 3))
    properties.fail_at(p.name, "need a bitmap of three channels, whose colours are normals, or a rawconstant");
  return value;
}

// The picture of heights: the one texture inside, whatever its name.
Texture bumps(Builder& builder, Properties& properties) {
  const std::vector<const Element*> found = properties.objects("texture");
  if (found.size() != 1)
    properties.fail_at("",
                       fmt::format("{} textures; need one nested <texture>, whose values are heights", found.size()));
  Texture value = build_texture(builder, *found[0]);
  if (!value.bitmap)
    fail(found[0]->where, "heights are a " + quote(found[0]->attribute("type")) + "; need a <texture type=\"bitmap\">");
  make_numbers(value, -std::numeric_limits<double>::infinity());
  return value;
}

// The table that the parameter `filename` names; files are read once.
std::shared_ptr<const MeasuredBrdf> measured(Builder& builder, Properties& properties) {
  const std::string file = properties.file("filename");
  std::shared_ptr<const MeasuredBrdf>& table = builder.measured_of_file[file];
  if (!table) {
    try {
      table = std::make_shared<const MeasuredBrdf>(read_merl_file(file));
    } catch (const InputError& error) {
      properties.fail_at("filename", error.what());
    }
  }
  return table;
}

// A number, or a texture of numbers.
Texture number_texture(Builder& builder, Properties& properties, const DeclaredParameter& p) {
  Texture value;
  if (properties.is_object(p.name) && !properties.is_spectrum(p.name)) {
    value = build_texture(builder, properties, p.name, p.fallback, p.kind.high);
    if (!value.model) return value;  // a stand-in, which is reported
    make_numbers(value, 0);
    if (value.bitmap)
      for (const float texel : value.bitmap->data) check_in_range(properties, p, static_cast<double>(texel));
    for (const Rgb& colour : value.colours) check_in_range(properties, p, colour[0]);
    if (value.volume)
      for (const float voxel : value.volume->grid->data) check_in_range(properties, p, static_cast<double>(voxel));
    value.value.fill(p.fallback);
    return value;
  }
  value.value.fill(properties.number(p.name, p.fallback));
  check_in_range(properties, p, value.value[0]);
  return value;
}

// Index of refraction of a principled surface: `eta`, or `specular`, 0.08 times the root of which is the reflectance of
// a facet that faces the light. Where light passes it there must be a difference between the two sides, as in Mitsuba.
double index_or_specular(Properties& properties, const DeclaredParameter& p, bool transmits) {
  if (properties.has("eta") && properties.has("specular"))
    properties.fail_at("specular", "both eta and specular given; need one or the other");
  if (!properties.has("specular")) {
    const double eta = properties.number("eta", p.fallback);
    check_in_range(properties, p, eta);
    return transmits && eta == 1 ? 1.001 : eta;
  }
  const double specular = properties.number("specular");
  if (!(specular >= 0 && specular <= 1))
    properties.fail_at("specular", fmt::format("specular = {} is outside [0, 1]", to_text(specular)));
  return 2 / (1 - std::sqrt(0.08 * (transmits && specular == 0 ? 1e-3 : specular))) - 1;
}

// Metals reflect by the squares of eta and k, so that a sign says nothing: as in Mitsuba it is left away. Colours of
// spectra come out a little below 0, and some write k with a minus.
void take_magnitude(Builder& builder, Properties& properties, const DeclaredParameter& p, Rgb& value) {
  if (*std::min_element(value.begin(), value.end()) >= 0) return;
  builder.warn(properties.element().where,
               fmt::format("{}: {} = {}, {}, {} is below 0; its magnitude is taken, as in Mitsuba", properties.title(),
                           p.name, to_text(value[0]), to_text(value[1]), to_text(value[2])));
  for (double& v : value) v = std::fabs(v);
}

Texture read(Builder& builder, Properties& properties, const Model& model, const DeclaredParameter& p) {
  Texture value;
  const auto number = [&](double v) { value.value = {v, v, v}; };
  switch (p.kind.reader) {
    case ParameterKind::Reader::number:
      number(properties.number(p.name, p.fallback));
      check_in_range(properties, p, value.value[0]);
      break;
    case ParameterKind::Reader::number_volume:
      value = read_number_volume(builder, properties, p);
      break;
    case ParameterKind::Reader::flag:
      number(properties.boolean(p.name, p.fallback != 0) ? 1 : 0);
      break;
    case ParameterKind::Reader::colour: {
      const Color colour = properties.color(p.name, {{p.fallback, p.fallback, p.fallback}}, p.kind.quantity);
      value.value = colour.value;
      value.by_component = p.kind.by_component && colour.is_rgb;
      for (const double v : value.value) check_in_range(properties, p, v);
      break;
    }
    case ParameterKind::Reader::position:
      value.value = position(properties, p.name);
      break;
    case ParameterKind::Reader::origin:
      value.value = transform_point(properties.transform("to_world"), {0, 0, 0});
      break;
    case ParameterKind::Reader::axis_x:
      value.value = axis(properties, {1, 0, 0});
      break;
    case ParameterKind::Reader::axis_y:
      value.value = axis(properties, {0, 1, 0});
      break;
    case ParameterKind::Reader::axis_z:
      value.value = axis(properties, {0, 0, 1});
      break;
    case ParameterKind::Reader::light_texture:
      value = light_texture(builder, properties, p.name, p.fallback);
      break;
    case ParameterKind::Reader::aspect:
      number(picture_aspect(builder, properties));
      break;
    case ParameterKind::Reader::field_of_view:
      number(parse_fov(properties, picture_aspect(builder, properties)));
      break;
    case ParameterKind::Reader::direction:
      value.value = direction(properties, p.name);
      break;
    case ParameterKind::Reader::beam:  // by default three quarters of the cone
      number(properties.number(p.name, 0.75 * properties.number("cutoff_angle", 20)));
      check_in_range(properties, p, value.value[0]);
      break;
    case ParameterKind::Reader::texture:
      value = build_texture(builder, properties, p.name, p.fallback);
      break;
    case ParameterKind::Reader::share:
      value = share(builder, properties, p);
      break;
    case ParameterKind::Reader::normals:
      value = normals(builder, properties, p);
      break;
    case ParameterKind::Reader::bumps:
      value = bumps(builder, properties);
      break;
    case ParameterKind::Reader::of_phase:  // Medium::slots
      break;
    case ParameterKind::Reader::of_shape:  // place_beam
      number(0);
      break;
    case ParameterKind::Reader::any_number:
      number(properties.number(p.name, p.fallback));
      break;
    case ParameterKind::Reader::measured_table:
      value.measured = measured(builder, properties);
      number(0);
      break;
    case ParameterKind::Reader::measured_roughness:
      number(measured(builder, properties)->alpha);
      break;
    case ParameterKind::Reader::measured_gloss:
      number(measured(builder, properties)->gloss);
      break;
    case ParameterKind::Reader::index:
      number(parse_ior(properties, p.name, p.fallback));
      break;
    case ParameterKind::Reader::metal:
      if (properties.is_object(p.name) && !properties.is_spectrum(p.name)) {
        metal_instead_of(properties, p.name);
        value = build_texture(builder, properties, p.name, p.fallback, p.kind.high);
        value.value.fill(p.fallback);
        break;
      }
      value.value = parse_metal(properties, p.name, p.fallback);
      take_magnitude(builder, properties, p, value.value);
      for (const double v : value.value) check_in_range(properties, p, v);
      break;
    case ParameterKind::Reader::volume:
      value = read_medium_parameter(builder, properties, p);
      break;
    case ParameterKind::Reader::number_texture:
      return number_texture(builder, properties, p);
    case ParameterKind::Reader::index_or_specular:
      number(index_or_specular(properties, p, (model.traits & BSDF_TRANSMITS) != 0));
      break;
    case ParameterKind::Reader::roughness_texture:
      if (properties.is_object(p.name) && !properties.is_spectrum(p.name)) {
        value = build_texture(builder, properties, p.name, p.fallback);
        value.value.fill(p.fallback);
        if (value.model) make_numbers(value, least_alpha);  // else a stand-in, which is reported
        break;
      }
      [[fallthrough]];
    case ParameterKind::Reader::roughness:
      number(p.name == "alpha" ? roughness(properties, p.fallback) : roughness(properties, p.name, p.fallback));
      break;
  }
  return value;
}

}  // namespace

void read_parameters(Builder& builder, Properties& properties, Instance& instance) {
  for (std::size_t i = 0; i < instance.values.size(); ++i)
    instance.values[i] = read(builder, properties, *instance.model, instance.model->parameters[i]);
}

void read_weights(Properties& properties, const std::string& tag, std::size_t entries, Instance& nest) {
  const std::string text = properties.text("weights");
  const std::vector<double> weights = parse_numbers(text, properties.element().where, "\"weights\"");
  if (weights.size() != entries)
    properties.fail_at("weights",
                       fmt::format("{} weights for {} nested <{}>; need one each", weights.size(), entries, tag));
  nest.become(dictionary_model(entries));
  double sum = 0;
  for (std::size_t k = 0; k < entries; ++k) {
    if (weights[k] < 0)
      properties.fail_at("weights", fmt::format("weight {} is {}; need one not below 0", k, weights[k]));
    nest.values[k].value.fill(weights[k]);
    sum += weights[k];
  }
  if (!(sum > 0 && std::isfinite(sum)))
    properties.fail_at("weights", "their sum is " + fmt::format("{}", sum) + "; need one above 0");
}

std::vector<std::string> types_of(const std::vector<Model>& models) {
  std::vector<std::string> types;
  types.reserve(models.size());
  for (const Model& model : models)
    if (std::find(types.begin(), types.end(), model.type) == types.end()) types.push_back(model.type);
  return types;
}

}  // namespace itn
