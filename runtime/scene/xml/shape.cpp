#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "runtime/scene/mesh_file.h"
#include "runtime/scene/mesh_repair.h"
#include "runtime/scene/shape_meshes.h"
#include "runtime/scene/transform.h"
#include "runtime/scene/xml/builder.h"
#include "runtime/scene/xml/message.h"

namespace itn {
namespace {

const std::vector<std::string> types = {"obj", "ply", "mesh", "sphere", "rectangle", "cube", "disk"};

std::array<float, 3> to_float(const Vec3& v) {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

// With normals of its own a mesh keeps its outside under a reflection; without, as in Mitsuba, the winding decides,
// which a reflection turns around.
void apply(const Transform& to_world, Mesh& mesh, bool keeps_outside) {
  if (keeps_outside && determinant(to_world) < 0)
    for (auto& t : mesh.triangle) std::swap(t[1], t[2]);
  const Transform for_normals = inverse_transpose(to_world);
  for (auto& p : mesh.position) p = to_float(transform_point(to_world, {p[0], p[1], p[2]}));
  for (auto& n : mesh.normal) {
    const Vec3 turned = transform_vector(for_normals, {n[0], n[1], n[2]});
    if (length(turned) > 0) n = to_float(normalize(turned));
  }
}

// A vertex normal of length 0 shades nothing: such ones are computed.
void replace_zero_normals(Builder& builder, Properties& properties, Mesh& mesh) {
  const auto is_zero = [](const std::array<float, 3>& n) { return n == std::array<float, 3>{0, 0, 0}; };
  const auto count = std::count_if(mesh.normal.begin(), mesh.normal.end(), is_zero);
  if (count == 0) return;
  const std::vector<std::array<float, 3>> given = std::move(mesh.normal);
  compute_normals(mesh);
  for (std::size_t i = 0; i < given.size(); ++i)
    if (!is_zero(given[i])) mesh.normal[i] = given[i];
  builder.warn(properties.element().where,
               fmt::format("{}: {} of {} vertex normals of the file have length 0 and are computed", properties.title(),
                           count, given.size()));
}

void check_single_precision(Properties& properties, const std::array<float, 3>& position) {
  for (const float v : position)
    if (!std::isfinite(v))
      properties.fail_at("to_world",
                         "to_world moves the shape beyond the range of single precision; need a smaller scale");
}

void check_single_precision(Properties& properties, const Mesh& mesh) {
  for (const auto& p : mesh.position) check_single_precision(properties, p);
}

Mesh build_mesh(Builder& builder, Properties& properties) {
  const std::string file = properties.file("filename");
  const bool face_normals = properties.boolean("face_normals", false);
  const bool flip_texcoords = properties.boolean("flip_tex_coords", properties.type() == "obj");
  const bool flip_normals = properties.boolean("flip_normals", false);
  const Transform to_world = properties.transform("to_world");
  Mesh mesh;
  try {
    mesh = read_mesh(file);
  } catch (const InputError& error) {
    properties.fail_at("filename", error.what());
  }
  if (face_normals) mesh.normal.clear();
  if (flip_texcoords)
    for (auto& uv : mesh.texcoord) uv[1] = 1 - uv[1];
  apply(to_world, mesh, !mesh.normal.empty());
  check_single_precision(properties, mesh);
  if (!face_normals && mesh.normal.empty()) compute_normals(mesh);
  replace_zero_normals(builder, properties, mesh);
  if (flip_normals) flip(mesh);
  return mesh;
}

Mesh build_flat(Properties& properties, Mesh mesh) {
  const bool flip_normals = properties.boolean("flip_normals", false);
  properties.boolean("face_normals", false);  // they are flat either way
  apply(properties.transform("to_world"), mesh, true);
  check_single_precision(properties, mesh);
  if (flip_normals) flip(mesh);
  return mesh;
}

void drop_degenerate(Builder& builder, Properties& properties, Mesh& mesh) {
  const std::size_t total = mesh.triangle.size(), dropped = drop_degenerate(mesh);
  if (dropped == 0) return;
  if (dropped == total) properties.fail_at("filename", "no triangle of the mesh has an area; mend the mesh");
  builder.warn(properties.element().where,
               fmt::format("{}: dropped {} of {} triangles, which have no area", properties.title(), dropped, total));
}

void build_sphere(Properties& properties, Shape& shape) {
  shape.kind = Shape::Kind::sphere;
  const Vec3 center = properties.vector("center", {0, 0, 0});
  const double radius = properties.number("radius", 1);
  if (!(radius > 0)) properties.fail_at("radius", "radius = " + to_text(radius) + "; need more than 0");
  const Transform t = properties.transform("to_world");
  const double scale = length(Vec3{t.m[0], t.m[4], t.m[8]});
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      double product = 0;
      for (std::size_t k = 0; k < 3; ++k) product += t.m[4 * k + i] * t.m[4 * k + j];
      if (std::abs(product - (i == j ? scale * scale : 0)) > 1e-4 * scale * scale)
        properties.fail_at("to_world", "to_world makes an ellipsoid; need a uniform scale, or a mesh");
    }
  }
  shape.center = transform_point(t, center);
  shape.radius = radius * scale;
  check_single_precision(properties, to_float(shape.center));
  check_single_precision(properties, to_float({shape.radius, 0, 0}));
  shape.flip_normals = properties.boolean("flip_normals", false) != (determinant(t) < 0);
}

void build_disk(Properties& properties, Shape& shape) {
  shape.kind = Shape::Kind::disk;
  const Transform t = properties.transform("to_world");
  shape.center = transform_point(t, {0, 0, 0});
  shape.edge_u = transform_vector(t, {1, 0, 0});
  shape.edge_v = transform_vector(t, {0, 1, 0});
  for (const Vec3& v : {shape.center, shape.edge_u, shape.edge_v}) check_single_precision(properties, to_float(v));
  shape.flip_normals = properties.boolean("flip_normals", false) != (determinant(t) < 0);
}

std::string at(const Vec3& p) { return fmt::format("({:.6g}, {:.6g}, {:.6g})", p[0], p[1], p[2]); }

// Why the inside and the outside of the shape cannot be told apart; empty when they can.
std::string boundary_fault(const Shape& shape, const Mesh& mesh) {
  if (shape.kind == Shape::Kind::disk) return "is not closed; need a closed shape";
  if (shape.kind == Shape::Kind::sphere)
    return shape.flip_normals
               ? "is turned inside out; take flip_normals or the reflection in to_world away, or exchange "
                 "interior and exterior"
               : "";
  const Topology t = topology(mesh);
  if (t.open_edges > 0)
    return fmt::format("has holes: {} open edges, one at {}; need a closed mesh", t.open_edges, at(t.open_at));
  if (t.non_manifold_edges > 0)
    return fmt::format("has {} non-manifold edges (of more than two triangles), one at {}; need a closed surface",
                       t.non_manifold_edges, at(t.non_manifold_at));
  if (t.turned_edges > 0)
    return fmt::format(
        "has {} edges whose two triangles wind against each other, one at {}; need a consistent orientation",
        t.turned_edges, at(t.turned_at));
  if (t.volume <= 0)
    return fmt::format(
        "is turned inside out (signed volume {:.6g}); need normals that point out: set flip_normals, or "
        "mend the mesh",
        t.volume);
  return "";
}

// A medium must not leak. Glass alone refracts at each hit by itself, so that a pane of it is no more than suspicious.
void check_boundary(Builder& builder, const Shape& shape, const Mesh& mesh, const std::string& title) {
  const BsdfKind kind = builder.scene.bsdfs[static_cast<std::size_t>(shape.bsdf)].kind;
  if (shape.interior != shape.exterior) {
    if (const std::string fault = boundary_fault(shape, mesh); !fault.empty())
      fail(shape.where, title + " bounds a medium but " + fault);
  } else if (kind == BsdfKind::dielectric || kind == BsdfKind::roughdielectric) {
    if (const std::string fault = boundary_fault(shape, mesh); !fault.empty())
      builder.warn(shape.where, title + " bounds a dielectric but " + fault);
  }
}

void check_texture(const Bsdf& bsdf, const Shape& shape, const Mesh& mesh, const std::string& title) {
  if (bsdf.reflectance.bitmap && shape.kind == Shape::Kind::mesh && mesh.texcoord.empty())
    fail(shape.where, title + " has a bitmap on its surface but no texture coordinates; export the mesh with them");
}

int default_bsdf(Builder& builder, const Shape& shape) {
  Bsdf bsdf;
  bsdf.id = shape.id + "_bsdf";
  bsdf.where = shape.where;
  bsdf.kind = BsdfKind::diffuse;
  builder.scene.bsdfs.push_back(bsdf);
  return static_cast<int>(builder.scene.bsdfs.size()) - 1;
}

}  // namespace

void build_shape(Builder& builder, const Element& element) {
  Properties properties = builder.properties(element);
  Shape shape;
  shape.id = element.id;
  shape.where = element.where;
  Mesh mesh;  // of shapes that are one
  const std::string& type = properties.type();
  if (type == "obj" || type == "ply" || type == "mesh") {
    mesh = build_mesh(builder, properties);
  } else if (type == "rectangle") {
    mesh = build_flat(properties, rectangle_mesh());
  } else if (type == "cube") {
    mesh = build_flat(properties, cube_mesh());
  } else if (type == "sphere") {
    build_sphere(properties, shape);
  } else if (type == "disk") {
    build_disk(properties, shape);
  } else {
    fail_type(element, types);
  }
  if (const Element* bsdf = properties.object("bsdf"))
    shape.bsdf = build_bsdf(builder, *bsdf);
  else
    shape.bsdf = default_bsdf(builder, shape);
  if (const Element* medium = properties.object("medium", "interior")) shape.interior = build_medium(builder, *medium);
  if (const Element* medium = properties.object("medium", "exterior")) shape.exterior = build_medium(builder, *medium);
  properties.number("silhouette_sampling_weight", 1);  // how Mitsuba samples edges: not used here
  properties.finish();
  check_texture(builder.scene.bsdfs[static_cast<std::size_t>(shape.bsdf)], shape, mesh, properties.title());
  check_boundary(builder, shape, mesh, properties.title());
  if (shape.kind == Shape::Kind::mesh) {
    drop_degenerate(builder, properties, mesh);  // only now: a sliver may close the surface
    shape.mesh = std::make_shared<const Mesh>(std::move(mesh));
  }
  builder.scene.shapes.push_back(shape);
}

}  // namespace itn
