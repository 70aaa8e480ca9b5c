#include "itn/parameters.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numeric>

#include "itn/error.h"
#include "kernels/shared/declaration.h"
#include "runtime/scene/parameter_refusal.h"

namespace itn {
namespace {

const char* const textured_value = "a texture, not a number";
const char* const texel_value = "a texture, not a number; itn gradient and itn invert take it texel by texel";
const char* const uneven_attributes =
    "an attribute of other channels than the parameter has; itn gradient and itn invert take those of one channel, or "
    "of "
    "three for a colour";
const char* const packed_value =
    "a packed grid of voxels; without \"bits\", and up to 2^24 voxels, itn gradient and itn invert take it voxel by "
    "voxel";
const char* const voxels_value = "a grid of voxels, not a number; itn gradient and itn invert take it voxel by voxel";

// Values of an attribute on meshes that have it.
Bitmap attribute_values(const std::vector<const Mesh*>& meshes, const Texture& texture) {
  Bitmap result{0, 1, 1, {}};
  for (const Mesh* mesh : meshes) {
    const MeshAttribute& attribute = *mesh->attribute(texture.attribute);
    const bool first = result.data.empty();
    const auto channels = static_cast<int>(attribute.channels);
    result.channels = first || result.channels == channels ? channels : 0;  // 0: they differ
    for (const float v : attribute.values)
      result.data.push_back(static_cast<float>(texture.scale * static_cast<double>(v)));
  }
  result.width = result.channels > 0 ? static_cast<int>(result.data.size()) / result.channels : 0;
  return result;
}

// The picture of an environment, which no model declares: Mitsuba's name.
const char* const environment_picture = "data";

Bitmap texels_shown(const Scene& scene, const std::vector<int>& bsdfs, const Texture& texture) {
  if (texture.bitmap) return *texture.bitmap;
  return attribute_values(attribute_meshes(scene, bsdfs, texture.attribute), texture);
}

const Instance& textured_instance(const Scene& scene, const Parameter& p, int index) {
  const auto i = static_cast<std::size_t>(index);
  if (p.owner == Owner::light) return scene.lights.at(i);
  return scene.bsdfs.at(i);
}

Instance& textured_instance(Scene& scene, const Parameter& p, int index) {
  const auto i = static_cast<std::size_t>(index);
  if (p.owner == Owner::light) return scene.lights.at(i);
  return scene.bsdfs.at(i);
}

const Texture& texture_of(const Scene& scene, const Parameter& p) {
  const Instance& instance = textured_instance(scene, p, p.indices.at(0));
  return instance.values.at(instance.values_called(p.id, p.member).at(0));
}

// Gives the meshes that have `attribute` there another one named after the parameter; returns its name.
std::string set_attribute(Scene& scene, const Parameter& p, const std::string& attribute, const Bitmap& texels) {
  auto from = texels.data.begin();
  std::string name = attribute.substr(0, attribute.find('_') + 1) + p.name;  // "face_" or "vertex_" stays
  for (const Mesh* mesh : attribute_meshes(scene, p.indices, attribute)) {
    MeshAttribute other = *mesh->attribute(attribute);
    const auto count = static_cast<std::ptrdiff_t>(other.values.size());
    other.name = name;
    std::copy(from, from + count, other.values.begin());
    from += count;
    auto changed = std::make_shared<Mesh>(*mesh);
    const auto same = [&](const MeshAttribute& a) { return a.name == other.name; };
    std::erase_if(changed->attributes, same);
    changed->attributes.push_back(std::move(other));
    for (Shape& shape : scene.shapes)
      if (shape.mesh.get() == mesh) shape.mesh = changed;
  }
  return name;
}

struct Range {
  double low, high;
  bool low_included = true, high_included = true;
};

class List {
 public:
  explicit List(const Scene& scene) : scene_(scene) {}

  // Sets the owner of the next parameters, and its id.
  void begin(Owner owner, int index, const std::string& id) {
    owner_ = owner;
    index_ = index;
    id_ = id;
  }
  void number(const std::string& member, double value, const Range& range, const char* why_not,
              const std::string& unit = "", int component = -1) {
    const std::string suffix = component < 0 ? "" : std::string(".") + "RGB"[component];
    parameters.push_back({id_ + "." + member + suffix,
                          value,
                          range.low,
                          range.high,
                          range.low_included,
                          range.high_included,
                          unit,
                          why_not,
                          owner_,
                          member,
                          id_,
                          {index_},
                          component,
                          false,
                          false});
  }
  // why_not: for a component of that value.
  void colour(const std::string& member, const Rgb& value, const Range& range,
              const std::function<const char*(double, int)>& why_not, bool by_component = false,
              const std::string& unit = "") {
    if (!by_component && value[0] == value[1] && value[1] == value[2])
      return number(member, value[0], range, why_not(value[0], 0), unit);
    for (int c = 0; c < 3; ++c) {
      const double v = value[static_cast<std::size_t>(c)];
      number(member, v, range, why_not(v, c), unit, c);
    }
  }

  // The model is asked at the mean texel for reasons not to be differentiable: those of a few texels only leave these
  // out.
  void texels(const Instance& instance, const DeclaredParameter& p, const Texture& of, const Range& range) {
    const Model& model = *instance.model;
    const DeclaredNumber& its_number = model.number_called(p.name);
    const Bitmap texels = texels_shown(scene_, {index_}, of);
    std::vector<double> slots = instance.slots();
    std::fill_n(slots.begin() + p.slot, p.kind.channels,
                std::accumulate(texels.data.begin(), texels.data.end(), 0.0) /
                    static_cast<double>(std::max<std::size_t>(1, texels.data.size())));
    const char* why_not = its_number.role == ROLE_FIXED ? textured_value : model.obstacle(slots.data(), p.slot);
    const bool even = of.bitmap || texels.channels == 1 || (texels.channels == 3 && its_number.channels == 3);
    if (!even) why_not = uneven_attributes;
    const bool by_texels = std::string(why_not).empty();
    number(p.shown(), std::nan(""), range, by_texels ? texel_value : why_not, p.unit);
    parameters.back().by_texels = by_texels;
  }

  void environment_pixels() {
    number(environment_picture, std::nan(""), {0, std::numeric_limits<double>::infinity(), true, false}, texel_value);
    parameters.back().by_texels = true;
  }

  void grid(const Instance& instance, const DeclaredParameter& p, const Texture& of, const Range& range) {
    const Model& model = *instance.model;
    const char* why_not = model.obstacle(instance.slots().data(), p.slot);
    if (!*why_not && of.volume->grid->packed) why_not = packed_value;
    number(p.shown(), std::nan(""), range, *why_not ? why_not : voxels_value, p.unit);
    parameters.back().by_voxels = !*why_not;
  }

  // Lists the parameters that the instance's model declares.
  void declared(const Instance& instance) {
    const Model& model = *instance.model;
    const std::vector<double> slots = instance.slots();
    for (std::size_t i = 0; i < model.parameters.size(); ++i) {
      const DeclaredParameter& p = model.parameters[i];
      const Texture& of = instance.values[i];
      const bool has_texels = of.bitmap || !of.attribute.empty();
      if (!p.kind.listed && !has_texels) continue;
      id_ = instance.owner(i);
      const Range range{p.kind.low, p.kind.high, p.kind.low_included, p.kind.high_included};
      const auto value = [&](int c) { return slots[static_cast<std::size_t>(p.slot + c)]; };
      const auto why_not = [&](double, int c) { return model.obstacle(slots.data(), p.slot + c); };
      if (of.is_grid() && of.is_constant())
        grid(instance, p, of, range);
      else if (has_texels)
        texels(instance, p, of, range);
      else if (!of.is_constant())
        number(p.shown(), std::nan(""), range, textured_value, p.unit);
      else if (p.kind.channels == 3)
        colour(p.shown(), {value(0), value(1), value(2)}, range, why_not, of.by_component, p.unit);
      else
        number(p.shown(), value(0), range, why_not(0, 0), p.unit);
    }
  }

  std::vector<Parameter> parameters;

 private:
  const Scene& scene_;
  Owner owner_ = Owner::medium;
  int index_ = 0;
  std::string id_;
};

// The colours of a BSDF's textures.
void add_textures(List& list, const Bsdf& bsdf, int index) {
  for (std::size_t i = 0; i < bsdf.values.size(); ++i) {
    const Texture& texture = bsdf.values[i];
    for (std::size_t k = 0; k < texture.colours.size(); ++k) {
      const DeclaredColour& colour = texture.model->colours[k];
      const ParameterKind& of = bsdf.model->parameters[i].kind;
      const std::vector<double> slots = bsdf.showing(i, k).slots();
      list.begin(Owner::texture, index, texture.id);
      list.colour(
          colour.name, texture.colours[k], {colour.kind.low, of.high, colour.kind.low_included, of.high_included},
          [&](double, int c) { return bsdf.model->obstacle(slots.data(), bsdf.model->parameters[i].slot + c); });
    }
  }
}

void add(List& list, const Medium& m, int index) {
  list.begin(Owner::medium, index, m.id);
  list.declared(m);
  list.begin(Owner::phase, index, m.phase.id);
  list.declared(m.phase);
}

// True for each BSDF that has no surface of its own, only a place inside of a twosided one.
std::vector<bool> inside_another(const Scene& scene) {
  std::map<std::string, int> named;
  for (const Bsdf& bsdf : scene.bsdfs) ++named[bsdf.id];
  std::vector<bool> inside;
  for (const Bsdf& bsdf : scene.bsdfs) inside.push_back(named[bsdf.id] > 1);
  for (const Shape& shape : scene.shapes) inside.at(static_cast<std::size_t>(shape.bsdf)) = false;
  return inside;
}

// A phase function that several media share, or a BSDF that is used with one side and with two, is one number of the
// scene.
std::vector<Parameter> each_once(const std::vector<Parameter>& parameters) {
  std::vector<Parameter> result;
  std::map<std::string, std::size_t> place;
  for (const Parameter& p : parameters) {
    const auto [known, is_new] = place.try_emplace(p.name, result.size());
    if (is_new) {
      result.push_back(p);
    } else {
      Parameter& found = result[known->second];
      if (!found.belongs_to(p.indices.front())) found.indices.push_back(p.indices.front());
      if (found.not_differentiable.empty()) found.not_differentiable = p.not_differentiable;
    }
  }
  return result;
}

// index: of the medium or BSDF
void set_colour(Rgb& colour, const Parameter& p, double value) {
  for (int c = 0; c < 3; ++c)
    if (p.component < 0 || p.component == c) colour[static_cast<std::size_t>(c)] = value;
}

void set_instance(Instance& instance, const Parameter& p, double value) {
  for (const std::size_t i : instance.values_called(p.id, p.member)) {
    Texture& of = instance.values[i];
    if (of.is_grid() && of.is_constant())
      throw UsageError(fmt::format("parameter {}: cannot be set: {}", p.name, voxels_value));
    if (!of.is_constant()) throw UsageError(fmt::format("parameter {}: cannot be set: {}", p.name, textured_value));
    set_colour(of.value, p, value);
  }
}

void set_texture(Bsdf& bsdf, const Parameter& p, double value) {
  for (Texture& texture : bsdf.values)
    for (std::size_t k = 0; texture.id == p.id && k < texture.colours.size(); ++k)
      if (texture.model->colours[k].name == p.member) set_colour(texture.colours[k], p, value);
}

void set_number(Scene& scene, const Parameter& p, std::size_t index, double value) {
  switch (p.owner) {
    case Owner::medium:
      return set_instance(scene.media.at(index), p, value);
    case Owner::phase:
      return set_instance(scene.media.at(index).phase, p, value);
    case Owner::bsdf:
      return set_instance(scene.bsdfs.at(index), p, value);
    case Owner::texture:
      return set_texture(scene.bsdfs.at(index), p, value);
    case Owner::light:
      return set_instance(scene.lights.at(index), p, value);
    case Owner::environment:
      return set_instance(scene.environment.value(), p, value);
  }
}

}  // namespace

std::vector<const Mesh*> attribute_meshes(const Scene& scene, const std::vector<int>& bsdfs,
                                          const std::string& attribute) {
  std::vector<const Mesh*> meshes;
  for (const Shape& shape : scene.shapes) {
    const Mesh* mesh = shape.mesh.get();
    if (!mesh || std::find(bsdfs.begin(), bsdfs.end(), shape.bsdf) == bsdfs.end()) continue;
    if (mesh->attribute(attribute) && std::find(meshes.begin(), meshes.end(), mesh) == meshes.end())
      meshes.push_back(mesh);
  }
  return meshes;
}

std::string Parameter::range() const {
  return fmt::format("{}{}, {}{}", low_included ? '[' : '(', low, high, high_included ? ']' : ')');
}

std::string refusal(const Parameter& parameter, double value) {
  constexpr double greatest = 1e30;
  const bool too_large = std::abs(value) > greatest;
  if (parameter.contains(value) && !too_large) return "";
  return fmt::format("got {}, need a number in {}{}", value, parameter.range(),
                     too_large ? fmt::format(" of at most {:g}, for single precision", greatest) : "");
}

std::vector<Parameter> list_parameters(const Scene& scene) {
  List list(scene);
  for (std::size_t i = 0; i < scene.media.size(); ++i) add(list, scene.media[i], static_cast<int>(i));
  const std::vector<bool> inside = inside_another(scene);
  for (std::size_t i = 0; i < scene.bsdfs.size(); ++i) {
    if (!scene.bsdfs[i].model || inside[i]) continue;
    list.begin(Owner::bsdf, static_cast<int>(i), scene.bsdfs[i].id);
    list.declared(scene.bsdfs[i]);
    add_textures(list, scene.bsdfs[i], static_cast<int>(i));
  }
  for (std::size_t i = 0; i < scene.lights.size(); ++i) {
    list.begin(Owner::light, static_cast<int>(i), scene.lights[i].id);
    list.declared(scene.lights[i]);
  }
  if (scene.environment) {
    list.begin(Owner::environment, 0, scene.environment->id);
    list.declared(*scene.environment);
    if (scene.environment->bitmap) list.environment_pixels();
  }
  return each_once(list.parameters);
}

bool is_of_light(const Parameter& p) { return p.owner == Owner::light || p.owner == Owner::environment; }

void set_parameter(Scene& scene, const Parameter& p, double value) {
  if (const std::string why = refusal(p, value); !why.empty())
    throw UsageError(fmt::format("parameter {}: {}", p.name, why));
  for (const int i : p.indices) set_number(scene, p, static_cast<std::size_t>(i), value);
}

Bitmap texels_of(const Scene& scene, const Parameter& p) {
  if (p.owner == Owner::environment) return *scene.environment.value().bitmap;
  return texels_shown(scene, p.indices, texture_of(scene, p));
}

bool is_picture(const Scene& scene, const Parameter& p) {
  return p.owner == Owner::environment || texture_of(scene, p).bitmap != nullptr;
}

void set_texels(Scene& scene, const Parameter& p, const Bitmap& texels) {
  if (p.owner == Owner::environment) {
    scene.environment.value().bitmap = std::make_shared<const Bitmap>(texels);
    return;
  }
  const Texture shown = texture_of(scene, p);
  const auto bitmap = shown.bitmap ? std::make_shared<const Bitmap>(texels) : nullptr;
  const std::string attribute = bitmap ? "" : set_attribute(scene, p, shown.attribute, texels);
  for (const int index : p.indices) {
    Instance& instance = textured_instance(scene, p, index);
    for (const std::size_t i : instance.values_called(p.id, p.member)) {
      Texture& texture = instance.values[i];
      texture.bitmap = bitmap;
      if (!bitmap) {
        texture.attribute = attribute;
        texture.scale = 1;
      }
    }
  }
}

namespace {

// The instance that has the grid of a parameter.
const Instance& gridded_instance(const Scene& scene, const Parameter& p, int index) {
  const Medium& medium = scene.media.at(static_cast<std::size_t>(index));
  if (p.owner == Owner::phase) return medium.phase;
  return medium;
}

Instance& gridded_instance(Scene& scene, const Parameter& p, int index) {
  Medium& medium = scene.media.at(static_cast<std::size_t>(index));
  if (p.owner == Owner::phase) return medium.phase;
  return medium;
}

}  // namespace

const std::shared_ptr<const VoxelGrid>& grid_of(const Scene& scene, const Parameter& p) {
  const Instance& instance = gridded_instance(scene, p, p.indices.at(0));
  return instance.values.at(instance.values_called(p.id, p.member).at(0)).volume->grid;
}

void set_grid(Scene& scene, const Parameter& p, const std::shared_ptr<const VoxelGrid>& grid) {
  for (const int index : p.indices) {
    Instance& instance = gridded_instance(scene, p, index);
    for (const std::size_t i : instance.values_called(p.id, p.member)) {
      Volume volume = *instance.values[i].volume;
      volume.grid = grid;
      instance.values[i].volume = std::make_shared<const Volume>(std::move(volume));
    }
  }
}

VoxelGrid values_of(const Scene& scene, const Parameter& p) {
  if (p.by_voxels) return *grid_of(scene, p);
  Bitmap bitmap = texels_of(scene, p);
  VoxelGrid values;
  values.width = bitmap.width;
  values.height = bitmap.height;
  values.depth = 1;
  values.channels = bitmap.channels;
  values.data = std::move(bitmap.data);
  return values;
}

void set_values(Scene& scene, const Parameter& p, VoxelGrid values) {
  if (p.by_voxels) return set_grid(scene, p, std::make_shared<const VoxelGrid>(std::move(values)));
  set_texels(scene, p, {values.width, values.height, values.channels, std::move(values.data)});
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
