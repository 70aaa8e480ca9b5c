// <shape type="shapegroup"> and <shape type="instance">: an instance is a copy of the group's shapes, moved.
#include <fmt/core.h>

#include "runtime/scene/shape_transform.h"
#include "runtime/scene/xml/builder.h"
#include "runtime/scene/xml/message.h"

namespace itn {
namespace {

// Copies take memory as if they stood in the file: 400 bytes a triangle while the hierarchy is built, 170 afterwards.
constexpr std::size_t most_copied_triangles = std::size_t{1} << 25;

Shape moved(Builder& builder, const Shape& shape, const Transform& to_world, const Properties& instance) {
  Shape copy = shape;
  copy.where = instance.element().where;
  if (shape.kind == Shape::Kind::mesh) {
    PlacedMesh mesh{*shape.mesh};
    if (const auto own = builder.mesh_origins.find(shape.mesh.get()); own != builder.mesh_origins.end())
      mesh.origin = own->second;
    transform_mesh(to_world, mesh, true);
    copy.mesh = builder.keep(std::move(mesh));
  } else if (!transform_round(to_world, copy)) {
    copy = shape;
    copy.where = instance.element().where;
    copy.mesh = builder.keep(bent_round_mesh(builder, shape, to_world, "shape " + quote(shape.id) + " in an instance"));
    copy.kind = Shape::Kind::mesh;
    copy.flip_normals = false;
  }
  check_single_precision(builder, instance, copy);
  return copy;
}

}  // namespace

const std::vector<Shape>& shapes_of_group(Builder& builder, const Element& element) {
  const auto known = builder.shapes_of_group.find(&element);
  if (known != builder.shapes_of_group.end()) return known->second;
  Properties properties = builder.properties(element);
  std::vector<Shape> shapes;
  for (const Element* child : properties.objects("shape")) {
    const std::string& type = child->attribute("type");
    if (type == "shapegroup" || type == "instance")
      fail(child->where, "<shape type=" + quote(type) +
                             "> in a shapegroup; need plain shapes: groups cannot be nested, as in Mitsuba");
    const std::size_t sensors = builder.scene.sensors.size();
    shapes.push_back(make_shape(builder, *child));
    if (builder.scene.sensors.size() > sensors)
      fail(child->where, "a sensor in a shapegroup; need a plain shape for it to lie on");
    if (shapes.back().light >= 0)
      fail(child->where, "an emitter in a shapegroup; need shapes that do not shine there, as in Mitsuba");
  }
  properties.finish();
  return builder.shapes_of_group[&element] = std::move(shapes);
}

void build_instance(Builder& builder, const Element& element) {
  Properties properties = builder.properties(element);
  const Transform to_world = properties.transform("to_world");
  const Element* group = properties.object("shape");
  properties.number("silhouette_sampling_weight", 1);  // how Mitsuba samples edges: not used here
  properties.finish();
  if (!group || group->attribute("type") != "shapegroup")
    fail(element.where, properties.title() + " has no shapegroup; need <ref id=\"...\"/> to one");
  for (const Shape& shape : shapes_of_group(builder, *group)) {
    builder.copied_triangles += shape.mesh ? shape.mesh->triangle.size() : 1;
    if (builder.copied_triangles > most_copied_triangles)
      fail(
          element.where,
          fmt::format("{}: instances are copies here, and those up to this one have {} triangles; need at most {}: use "
                      "fewer instances or smaller meshes",
                      properties.title(), builder.copied_triangles, most_copied_triangles));
    builder.scene.shapes.push_back(moved(builder, shape, to_world, properties));
  }
}

}  // namespace itn
