#include "python/src/scene.h"

#include <fmt/format.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

#include "itn/error.h"
#include "itn/load_scene.h"
#include "itn/model.h"
#include "itn/texture_model.h"
#include "python/src/arrays.h"
#include "python/src/renderers.h"

namespace itn::python {
namespace {

using namespace nb::literals;

const char* owner_name(Owner owner) {
  switch (owner) {
    case Owner::medium:
      return "medium";
    case Owner::phase:
      return "phase";
    case Owner::bsdf:
      return "bsdf";
    case Owner::texture:
      return "texture";
    case Owner::light:
      return "light";
    default:
      return "environment";
  }
}

// (height, width, channels) of a texture, (depth, height, width, channels) of a grid.
std::vector<std::size_t> shape_of(const Parameter& p, const VoxelGrid& values) {
  std::vector<std::size_t> shape;
  if (p.by_voxels) shape.push_back(static_cast<std::size_t>(values.depth));
  for (const int side : {values.height, values.width, values.channels}) shape.push_back(static_cast<std::size_t>(side));
  return shape;
}

nb::dict describe(const SceneObject& object, const Parameter& p) {
  nb::dict result;
  result["name"] = p.name;
  result["value"] = p.value;
  result["low"] = p.low;
  result["high"] = p.high;
  result["range"] = p.range();
  result["unit"] = p.unit;
  result["differentiable"] = p.not_differentiable.empty() || p.has_values();
  result["reason"] = p.has_values() ? std::string() : p.not_differentiable;
  result["belongs_to"] = owner_name(p.owner);
  result["component"] = p.component;
  result["shape"] = nb::none();
  if (p.has_values()) result["shape"] = nb::tuple(nb::cast(shape_of(p, values_of(*object.scene(), p))));
  return result;
}

std::unique_ptr<SceneObject> load(const std::string& file, const std::map<std::string, std::string>& definitions,
                                  const std::optional<std::pair<int, int>>& size, bool open) {
  LoadOptions options;
  options.open = open;
  if (size) {
    if (std::min(size->first, size->second) < 1 || std::max(size->first, size->second) > largest_film)
      throw UsageError(fmt::format("size: got ({}, {}), need (width, height), each from 1 to {} pixels", size->first,
                                   size->second, largest_film));
    options.size = FilmSize{size->first, size->second};
  }
  const nb::gil_scoped_release release;
  return std::make_unique<SceneObject>(load_scene(file, definitions, options));
}

void set_number(SceneObject& object, const std::string& name, double value) {
  Scene scene = *object.scene();
  itn::set_parameter(scene, object.parameter(name), value);
  object.set_scene(std::move(scene));
}

nb::object get_values(const SceneObject& object, const std::string& name) {
  const Parameter& p = object.parameter(name);
  VoxelGrid values = values_of(*object.scene(), p);
  const std::vector<std::size_t> shape = shape_of(p, values);
  return numpy_array(std::move(values.data), shape);
}

void put(Scene& scene, const Parameter& p, const FloatArray& array) {
  VoxelGrid values = values_of(scene, p);
  const std::vector<std::size_t> shape = shape_of(p, values);
  std::vector<std::size_t> given;
  for (std::size_t i = 0; i < array.ndim(); ++i) given.push_back(array.shape(i));
  if (given != shape)
    throw UsageError(fmt::format("parameter {}: got an array of shape ({}), need ({})", p.name, fmt::join(given, ", "),
                                 fmt::join(shape, ", ")));
  values.data = as_vector(array);
  for (const float v : values.data)
    if (!p.contains(static_cast<double>(v)))
      throw UsageError(fmt::format("parameter {}: got a value of {}, need all in {}", p.name, v, p.range()));
  itn::set_values(scene, p, std::move(values));
}

void set_array(SceneObject& object, const std::string& name, const FloatArray& array) {
  Scene scene = *object.scene();
  put(scene, object.parameter(name), array);
  object.set_scene(std::move(scene));
}

std::unique_ptr<Variant> variant(const SceneObject& object, const std::map<std::string, double>& numbers,
                                 const std::map<std::string, FloatArray>& arrays) {
  Scene scene = *object.scene();
  for (const auto& [name, value] : numbers) itn::set_parameter(scene, object.parameter(name), value);
  for (const auto& [name, values] : arrays) put(scene, object.parameter(name), values);
  return std::make_unique<Variant>(Variant{std::make_shared<const Scene>(std::move(scene))});
}

// The scene as the first sensor of the other one sees it. medium: the id of that in which the sensor stands; "": none
std::unique_ptr<SceneObject> seen_by(const SceneObject& object, const SceneObject& other, const std::string& medium) {
  Scene scene = *object.scene();
  Sensor sensor = other.scene()->sensors.front();
  sensor.medium = -1;
  if (other.scene()->media.size() > 0)
    throw UsageError("sensor: has a medium of its own; need {'type': 'ref', 'id': ...} to one of the scene");
  std::vector<std::string> ids;
  for (std::size_t i = 0; i < scene.media.size(); ++i) {
    ids.push_back(scene.media[i].id);
    if (scene.media[i].id == medium) sensor.medium = static_cast<int>(i);
  }
  if (!medium.empty() && sensor.medium < 0)
    throw UsageError(fmt::format("sensor: refers to {}, and no medium of the scene has this id; need one of: {}",
                                 medium, ids.empty() ? "none" : fmt::format("{}", fmt::join(ids, ", "))));
  scene.sensors = {sensor};
  return std::make_unique<SceneObject>(std::move(scene));
}

// The tag of the element of each type that the program declares.
std::map<std::string, std::string> model_tags() {
  std::map<std::string, std::string> tags;
  const auto add = [&](const auto& models, const char* tag) {
    for (const auto& model : models) tags.emplace(model.type, tag);
  };
  add(bsdf_models(), "bsdf");
  add(medium_models(), "medium");
  add(phase_models(), "phase");
  add(light_models(), "emitter");
  add(environment_models(), "emitter");
  add(texture_models(), "texture");
  return tags;
}

nb::list sensors(const SceneObject& object) {
  nb::list result;
  for (const Sensor& s : object.scene()->sensors) {
    nb::dict sensor;
    sensor["id"] = s.id;
    sensor["width"] = s.crop_width;
    sensor["height"] = s.crop_height;
    sensor["channels"] = s.luminance ? 1 : 3;
    sensor["spp"] = s.spp;
    result.append(sensor);
  }
  return result;
}

}  // namespace

SceneObject::SceneObject(Scene scene) : renderers_(std::make_unique<Renderers>()) { set_scene(std::move(scene)); }
SceneObject::SceneObject(const SceneObject& other)
    : scene_(other.scene_), parameters_(other.parameters_), renderers_(std::make_unique<Renderers>()) {}
SceneObject::~SceneObject() = default;

void SceneObject::set_scene(Scene scene) {
  parameters_ = list_parameters(scene);
  scene_ = std::make_shared<const Scene>(std::move(scene));
}

const Parameter& SceneObject::parameter(const std::string& name) const {
  for (const Parameter& p : parameters_)
    if (p.name == name) return p;
  find_parameter(parameters_, name);  // throws, with the names that there are
  throw std::logic_error(name);
}

void bind_scene(nb::module_& module) {
  nb::class_<Variant>(module, "Variant", "A scene with other values of its parameters.");
  nb::class_<SceneObject>(module, "Scene", "A scene on the host; itn.Scene wraps it.")
      .def_prop_ro("file", [](const SceneObject& o) { return o.scene()->file; })
      .def_prop_ro("warnings", [](const SceneObject& o) { return o.scene()->warnings; })
      .def_prop_ro("sensors", &sensors)
      .def("copy", [](const SceneObject& o) { return std::make_unique<SceneObject>(o); })
      .def("seen_by", &seen_by, "other"_a, "medium"_a, "The scene as the first sensor of another one sees it.")
      .def("names",
           [](const SceneObject& o) {
             std::vector<std::string> names;
             for (const Parameter& p : o.parameters()) names.push_back(p.name);
             return names;
           })
      .def(
          "by_component",
          [](const SceneObject& o, const std::vector<std::string>& names) {
            return itn::by_component(o.parameters(), names);
          },
          "names"_a)
      .def(
          "describe", [](const SceneObject& o, const std::string& name) { return describe(o, o.parameter(name)); },
          "name"_a)
      .def(
          "has_values", [](const SceneObject& o, const std::string& name) { return o.parameter(name).has_values(); },
          "name"_a)
      .def(
          "number", [](const SceneObject& o, const std::string& name) { return o.parameter(name).value; }, "name"_a)
      .def("variant", &variant, "numbers"_a, "arrays"_a, "The scene with these values; it stays as it is.")
      .def("set_number", &set_number, "name"_a, "value"_a)
      .def("values", &get_values, "name"_a)
      .def("set_values", &set_array, "name"_a, "values"_a);
  module.def("model_tags", &model_tags, "Of each type that the program declares the tag of its element.");
  module.def("load", &load, "file"_a, "definitions"_a, "size"_a.none(), "open"_a);
}

}  // namespace itn::python
