#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "kernels/shared/declaration.h"
#include "runtime/scene/mesh/curve_mesh.h"
#include "runtime/scene/mesh/level_set_mesh.h"
#include "runtime/scene/mesh/mesh_close.h"
#include "runtime/scene/mesh/mesh_file.h"
#include "runtime/scene/mesh/mesh_repair.h"
#include "runtime/scene/mesh/round_mesh.h"
#include "runtime/scene/mesh/shape_meshes.h"
#include "runtime/scene/shape_transform.h"
#include "runtime/scene/transform.h"
#include "runtime/scene/volume/volume_file.h"
#include "runtime/scene/xml/builder.h"
#include "runtime/scene/xml/message.h"

namespace itn {
namespace {

const std::vector<std::string> shape_types = {"obj",          "ply",     "serialized", "mesh",     "sphere",
                                              "rectangle",    "cube",    "disk",       "cylinder", "linearcurve",
                                              "bsplinecurve", "sdfgrid", "shapegroup", "instance"};

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

void check_single_precision(const Properties& properties, const Vec3& position) {
  for (const double v : position)
    if (!(std::fabs(v) <= largest_extent))
      properties.fail_at("to_world",
                         fmt::format("a coordinate or size of {:.3g} in the world; need at most {:.0e}, for single "
                                     "precision: set a smaller scale in to_world",
                                     v, largest_extent));
}

void check_single_precision(const Properties& properties, const Mesh& mesh, const Vec3& origin) {
  for (const auto& p : mesh.position) check_single_precision(properties, Vec3{p[0], p[1], p[2]} + origin);
}

// A mesh in world space and what is left to do once it is closed.
struct LoadedMesh {
  PlacedMesh mesh;
  bool lacks_normals = false, flip = false;
};

// Warns of a file whose mesh is so far from its origin that single precision has lost its shape, or refuses it.
void check_rounding(Builder& builder, Properties& properties, const std::string& file, const PlacedMesh& mesh) {
  if (mesh.rounding < loss_said_from) return;
  const std::string what = fmt::format(
      "{}: vertices are stored in single precision and so far from the file's origin that they are rounded to {:.2g} % "
      "of the mesh's size; export the mesh about its middle, or with vertices of type double",
      file, 100 * mesh.rounding);
  if (mesh.rounding >= loss_refused_from) properties.fail_at("filename", what);
  builder.warn(properties.element().where, what);
}

LoadedMesh load_mesh(Builder& builder, Properties& properties) {
  const bool is_serialized = properties.type() == "serialized";
  const std::string file = properties.file("filename");
  const long index = is_serialized ? properties.integer("shape_index", 0) : 0;
  if (index < 0) properties.fail_at("shape_index", fmt::format("shape_index = {}; need 0 or more", index));
  const bool face_normals = properties.boolean("face_normals", false);
  const bool flip_texcoords = properties.boolean("flip_tex_coords", properties.type() == "obj");
  const bool flip_normals = properties.boolean("flip_normals", false);
  const Transform to_world = properties.transform("to_world");
  PlacedMesh mesh;
  try {
    mesh = is_serialized ? read_serialized(file, index) : read_mesh(file);
  } catch (const InputError& error) {
    properties.fail_at("filename", error.what());
  }
  check_rounding(builder, properties, file, mesh);
  if (face_normals) mesh.normal.clear();
  if (flip_texcoords)
    for (auto& uv : mesh.texcoord) uv[1] = 1 - uv[1];
  transform_mesh(to_world, mesh, !mesh.normal.empty());
  check_single_precision(properties, mesh, mesh.origin);
  const bool lacks_normals = !face_normals && mesh.normal.empty();
  return {std::move(mesh), lacks_normals, flip_normals};
}

LoadedMesh load_flat(Properties& properties, Mesh flat) {
  PlacedMesh mesh{std::move(flat)};
  const bool flip_normals = properties.boolean("flip_normals", false);
  properties.boolean("face_normals", false);  // they are flat either way
  transform_mesh(properties.transform("to_world"), mesh, true);
  check_single_precision(properties, mesh, mesh.origin);
  return {std::move(mesh), false, flip_normals};
}

// to_world moves the control points and leaves their radii as they are, as in Mitsuba.
LoadedMesh load_curves(Properties& properties) {
  const bool is_spline = properties.type() == "bsplinecurve";
  const std::string file = properties.file("filename");
  const Transform to_world = properties.transform("to_world");
  std::vector<Curve> curves;
  try {
    curves = read_curves(file, is_spline ? 4 : 2);
  } catch (const InputError& error) {
    properties.fail_at("filename", error.what());
  }
  Extent box = Extent::empty();
  for (Curve& curve : curves)
    for (ControlPoint& point : curve) {
      point.position = transform_point(to_world, point.position);
      box.add(point.position);
    }
  const Vec3 origin = own_origin(box);
  for (Curve& curve : curves)
    for (ControlPoint& point : curve) point.position = point.position - origin;
  PlacedMesh mesh{is_spline ? bspline_curve_mesh(curves) : linear_curve_mesh(curves), origin};
  check_single_precision(properties, mesh, origin);
  return {std::move(mesh), false, false};
}

// Mesh of the zero set of the file's values, which fill the unit cube from face to face.
LoadedMesh load_level_set(Properties& properties) {
  const std::string file = properties.file("filename");
  const bool smooth = properties.choice("normals", {"smooth", "analytic"}) == "smooth";
  const Transform to_world = properties.transform("to_world");
  LevelSet field;
  try {
    VoxelGrid grid = read_volume_file(file, VoxelValues::of_any_sign);
    const std::array<int, 3> size{grid.width, grid.height, grid.depth};
    if (grid.channels != 1 || *std::min_element(size.begin(), size.end()) < 2)
      throw InputError(fmt::format("{}: {} x {} x {} values of {} channels; need 2 or more along each axis, of one",
                                   file, size[0], size[1], size[2], grid.channels));
    for (std::size_t k = 0; k < 3; ++k) field.size[k] = static_cast<std::size_t>(size[k]);
    field.value = std::move(grid.data);
  } catch (const InputError& error) {
    properties.fail_at("filename", error.what());
  }
  PlacedMesh mesh;
  try {
    mesh = {level_set_mesh(field, smooth ? LevelSetNormals::smooth : LevelSetNormals::analytic)};
  } catch (const InputError& error) {
    properties.fail_at("filename", file + ": " + error.what());
  }
  if (mesh.triangle.empty())
    properties.fail_at("filename", file + ": the values have one sign; need a surface where they are 0");
  mesh.texcoord.assign(mesh.position.size(), {0, 0});  // the same everywhere, as in Mitsuba
  transform_mesh(to_world, mesh, true);
  check_single_precision(properties, mesh, mesh.origin);
  return {std::move(mesh), false, false};
}

void drop_degenerate(Builder& builder, Properties& properties, Mesh& mesh) {
  const std::size_t total = mesh.triangle.size(), dropped = drop_degenerate(mesh);
  if (dropped == 0) return;
  if (dropped == total) properties.fail_at("filename", "no triangle of the mesh has an area; mend the mesh");
  builder.warn(properties.element().where,
               fmt::format("{}: dropped {} of {} triangles, which have no area", properties.title(), dropped, total));
}

double radius_of(Properties& properties) {
  const double radius = properties.number("radius", 1);
  if (!(radius > 0)) properties.fail_at("radius", "radius = " + to_text(radius) + "; need more than 0");
  return radius;
}

void check_round(const Properties& properties, const Shape& shape) {
  for (const Vec3& v : {shape.center, shape.edge_u, shape.edge_v, shape.axis, Vec3{shape.radius, 0, 0}})
    check_single_precision(properties, v);
}

// As in Mitsuba: a sphere stays one where to_world would make an ellipsoid of it.
void move_sphere(Builder& builder, const Properties& properties, const Transform& to_world, Shape& shape) {
  const double radius = shape.radius;
  if (transform_round(to_world, shape)) return;
  shape.radius = radius * length(transform_vector(to_world, {1, 0, 0}));
  const Vec3 along = normalize(shape.edge_u);
  shape.edge_v = normalize(shape.edge_v - dot(shape.edge_v, along) * along);
  shape.edge_u = along;
  shape.axis = (dot(cross(along, shape.edge_v), shape.axis) < 0 ? -1.0 : 1.0) * cross(along, shape.edge_v);
  builder.warn(shape.where, fmt::format("{}: to_world would make an ellipsoid of it; it stays a sphere, of the radius "
                                        "along x, {:.6g}, as in Mitsuba; an ellipsoid is an instance that is scaled",
                                        properties.title(), shape.radius));
}

void build_sphere(Builder& builder, Properties& properties, Shape& shape) {
  shape.kind = Shape::Kind::sphere;
  shape.center = properties.vector("center", {0, 0, 0});
  shape.radius = radius_of(properties);
  const Transform to_world = properties.transform("to_world");
  move_sphere(builder, properties, to_world, shape);
  check_round(properties, shape);
  shape.flip_normals = properties.boolean("flip_normals", false) != (determinant(to_world) < 0);  // as in Mitsuba 3.9
}

void build_disk(Properties& properties, Shape& shape) {
  shape.kind = Shape::Kind::disk;
  shape.flip_normals = properties.boolean("flip_normals", false);
  transform_round(properties.transform("to_world"), shape);
  check_round(properties, shape);
}

// The mesh where to_world makes an elliptic or an oblique cylinder.
LoadedMesh build_cylinder(Builder& builder, Properties& properties, Shape& shape) {
  shape.kind = Shape::Kind::cylinder;
  shape.center = properties.vector("p0", {0, 0, 0});
  shape.axis = properties.vector("p1", {0, 0, 1}) - shape.center;
  if (!(length(shape.axis) > 0)) properties.fail_at("p1", "p0 and p1 are the same point; need two");
  shape.radius = radius_of(properties);
  const Vec3 along = normalize(shape.axis), across = some_perpendicular(along);
  shape.edge_u = shape.radius * across;
  shape.edge_v = shape.radius * cross(along, across);
  shape.flip_normals = properties.boolean("flip_normals", false);
  const Transform to_world = properties.transform("to_world");
  LoadedMesh bent;
  if (Shape moved = shape; transform_round(to_world, moved)) {
    shape = std::move(moved);
    check_round(properties, shape);
  } else {
    bent.mesh = bent_round_mesh(builder, shape, to_world, properties.title());
    shape.kind = Shape::Kind::mesh;
    shape.flip_normals = false;
    check_single_precision(properties, bent.mesh, bent.mesh.origin);
  }
  return bent;
}

// origin: of the mesh
std::string at(const EdgePlace& place, const Vec3& origin) {
  const Vec3 p = origin + place.middle;
  return fmt::format("({:.6g}, {:.6g}, {:.6g}), of triangle {}", p[0], p[1], p[2], place.triangle);
}

// Why the inside and the outside of a mesh cannot be told apart, and what to do about it; empty when they can.
std::string fault_of(const Topology& t, const Vec3& origin) {
  if (t.open_edges > 0)
    return fmt::format(
        "has holes: {} open edges, one at {}; need a closed mesh: close it in a modeller (only holes of up to {:.0f} % "
        "of the area are closed by themselves)",
        t.open_edges, at(t.open_at, origin), 100 * small_area);
  if (t.non_manifold_edges > 0)
    return fmt::format(
        "has {} non-manifold edges, of more than two triangles that do not wind as often one way as the other, one at "
        "{}; need a closed surface: remove the inner walls in a modeller",
        t.non_manifold_edges, at(t.non_manifold_at, origin));
  if (t.turned_edges > 0)
    return fmt::format(
        "has {} edges whose two triangles wind against each other, one at {}; need a consistent orientation: let a "
        "modeller recalculate it",
        t.turned_edges, at(t.turned_at, origin));
  if (t.volume <= 0)
    return fmt::format(
        "is turned inside out (signed volume {:.6g}); need normals that point out: set flip_normals, or mend the mesh",
        t.volume);
  return "";
}

std::string fault_of(const Shape& shape) {
  if (shape.kind != Shape::Kind::sphere) return "is not closed; need a closed shape";
  return shape.flip_normals ? "is turned inside out; take flip_normals or the reflection in to_world away, or exchange "
                              "interior and exterior"
                            : "";
}

// Does the mesh wind against most of its own normals?
bool winds_against_normals(const Mesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangle) {
    const Vec3 area = area_normal(mesh, t);
    for (const std::uint32_t corner : t) {
      const auto& n = mesh.normal[corner];
      sum += dot(area, Vec3{n[0], n[1], n[2]});
    }
  }
  return sum < 0;
}

// Flips a closed surface whose normals point inside, and whose medium would be outside.
void turn_out(Builder& builder, Shape& shape, LoadedMesh& loaded, Topology& found, const std::string& title) {
  if (shape.interior < 0) return;  // as in Mitsuba: the exterior is where the normals point
  if (shape.kind == Shape::Kind::sphere && shape.flip_normals) {
    shape.flip_normals = false;
  } else if (shape.kind == Shape::Kind::mesh && found.closed() && found.volume < 0) {
    found.volume = -found.volume;
    loaded.flip = !loaded.flip;
    if (!loaded.mesh.normal.empty() && winds_against_normals(loaded.mesh))
      for (auto& n : loaded.mesh.normal) n = {-n[0], -n[1], -n[2]};
  } else {
    return;
  }
  builder.warn(shape.where, title + " bounds a medium but is turned inside out: its normals are turned to point out");
}

// Light never passes it: paths stay in the medium on their side, whether it is closed or not.
bool is_opaque(const Builder& builder, const Shape& shape) {
  const Model* bsdf = builder.scene.bsdfs[static_cast<std::size_t>(shape.bsdf)].model;
  return bsdf && (bsdf->traits & (BSDF_TRANSMITS | BSDF_PASSES)) == 0;
}

// A medium must not leak: small defects of the mesh are repaired, others refused. Glass alone refracts at each hit by
// itself, so that a pane of it is no more than suspicious.
void check_boundary(Builder& builder, Shape& shape, LoadedMesh& loaded, const std::string& title) {
  const bool is_mesh = shape.kind == Shape::Kind::mesh;
  if (shape.interior == shape.exterior) {
    const Model* bsdf = builder.scene.bsdfs[static_cast<std::size_t>(shape.bsdf)].model;
    if (!bsdf || !(bsdf->traits & BSDF_TRANSMITS) || (bsdf->traits & BSDF_THIN)) return;
    Topology found = is_mesh ? topology(loaded.mesh) : Topology{};
    if (loaded.flip) found.volume = -found.volume;
    if (const std::string fault = is_mesh ? fault_of(found, loaded.mesh.origin) : fault_of(shape); !fault.empty())
      builder.warn(shape.where, title + " bounds a dielectric but " + fault);
    return;
  }
  if (shape.exterior >= 0 && is_opaque(builder, shape)) return;
  Closing closing;
  if (is_mesh) closing = close_mesh(loaded.mesh);
  if (loaded.flip) closing.left.volume = -closing.left.volume;
  turn_out(builder, shape, loaded, closing.left, title);
  const bool faces_in = shape.interior < 0 && (is_mesh ? closing.left.closed() && closing.left.volume < 0
                                                       : shape.kind == Shape::Kind::sphere);
  if (faces_in) return;
  if (const std::string fault = is_mesh ? fault_of(closing.left, loaded.mesh.origin) : fault_of(shape);
      !fault.empty()) {
    const std::string what = title + " bounds a medium but " + fault;
    if (!builder.open) fail(shape.where, what + "; or render it as it is (open)");
    builder.warn(shape.where, what + "; rendered as it is (open)");
  } else if (closing.changes_mesh()) {
    builder.warn(shape.where, title + " bounds a medium and was not closed: " + closing.summary());
  }
}

PlacedMesh finish_mesh(Builder& builder, Properties& properties, LoadedMesh loaded) {
  if (loaded.lacks_normals) compute_normals(loaded.mesh);
  replace_zero_normals(builder, properties, loaded.mesh);
  if (loaded.flip) flip(loaded.mesh);
  drop_degenerate(builder, properties, loaded.mesh);  // only now: a sliver may close the surface
  drop_unused_vertices(loaded.mesh);
  return std::move(loaded.mesh);
}

// A mesh attribute that a texture refers to must exist, with as many channels as the parameter, within its range.
void check_attribute(Builder& builder, const Texture& texture, const DeclaredParameter& p, const Shape& shape,
                     const Mesh& mesh, const std::string& title) {
  const MeshAttribute* attribute = mesh.attribute(texture.attribute);
  if (!attribute) {
    std::vector<std::string> names;
    for (const MeshAttribute& a : mesh.attributes) names.push_back(quote(a.name));
    fail(shape.where, fmt::format("{} has no attribute {} for the texture of {}; need a PLY mesh with it{}", title,
                                  quote(texture.attribute), quote(p.name),
                                  names.empty() ? "" : fmt::format("; there is {}", fmt::join(names, ", "))));
  }
  if (p.kind.channels == 1 && attribute->channels != 1)
    fail(shape.where, fmt::format("{}: the attribute {} has {} channels, and {} is one number; need one channel", title,
                                  quote(texture.attribute), attribute->channels, quote(p.name)));
  // Bytes are up to 255 where nothing scales them: as in Mitsuba they are rendered as they are.
  const float greatest =
      attribute->values.empty() ? 0 : *std::max_element(attribute->values.begin(), attribute->values.end());
  const bool is_bright = p.kind.channels == 3 && texture.scale * static_cast<double>(greatest) > p.kind.high;
  if (is_bright)
    builder.warn(
        shape.where,
        fmt::format("{}: the attribute {} has the value {}{}, and {} goes to {}: rendered as it is, as in Mitsuba; "
                    "bytes need the texture's scale = {:.9f}",
                    title, quote(texture.attribute), greatest,
                    texture.scale == 1 ? "" : fmt::format(" times {}", texture.scale), quote(p.name), p.kind.high,
                    1.0 / 255));
  for (const float v : attribute->values) {
    const double value = texture.scale * static_cast<double>(v);
    if (is_bright && value > p.kind.high) continue;
    if (value < p.kind.low || value > p.kind.high || (value == p.kind.low && !p.kind.low_included))
      fail(shape.where,
           fmt::format("{}: the attribute {} has the value {}{}, and {} goes from {} to {}: set the texture's scale",
                       title, quote(texture.attribute), v,
                       texture.scale == 1 ? "" : fmt::format(" times {}", texture.scale), quote(p.name), p.kind.low,
                       p.kind.high));
  }
}

void check_texture(Builder& builder, const Bsdf& bsdf, const Shape& shape, const Mesh& mesh, const std::string& title) {
  for (std::size_t i = 0; i < bsdf.values.size(); ++i)
    if (!bsdf.values[i].attribute.empty())
      check_attribute(builder, bsdf.values[i], bsdf.model->parameters[i], shape, mesh, title);
  const bool textured = std::any_of(bsdf.values.begin(), bsdf.values.end(), [](const Texture& v) {
    return !v.is_constant() && v.attribute.empty() && !v.volume;
  });
  if (textured && shape.kind == Shape::Kind::mesh && mesh.texcoord.empty())
    fail(shape.where, title + " has a texture on its surface but no texture coordinates; export the mesh with them");
  if (bsdf.model && (bsdf.model->traits & BSDF_BUMPED) && shape.kind == Shape::Kind::disk)
    fail(shape.where, title + " has a bumpmap, which is not rendered on disks; need another shape, such as a mesh");
}

void check_texture(const Light& light, const Shape& shape, const Mesh& mesh, const std::string& title) {
  const bool textured =
      std::any_of(light.values.begin(), light.values.end(), [](const Texture& v) { return !v.is_constant(); });
  if (textured && shape.kind == Shape::Kind::mesh && mesh.texcoord.empty())
    fail(shape.where, title + " shines as a texture shows but has no texture coordinates; export the mesh with them");
}

// As in Mitsuba: grey, and black where it shines.
int default_bsdf(Builder& builder, const Shape& shape) {
  Bsdf bsdf = make_bsdf("diffuse");
  if (shape.light >= 0) bsdf.set("reflectance", 0);
  bsdf.id = shape.id + "_bsdf";
  bsdf.where = shape.where;
  builder.scene.bsdfs.push_back(bsdf);
  return static_cast<int>(builder.scene.bsdfs.size()) - 1;
}

// A light of the shape that has no extent in directions: it takes the shape's place, and the shape itself does not
// shine.
void place_beam(Builder& builder, Shape& shape, const std::string& type) {
  std::vector<Light>& lights = builder.scene.lights;
  const auto index = static_cast<std::size_t>(shape.light);
  if (!lights[index].model || !(lights[index].model->traits & LIGHT_BEAM))
    return;  // without a model: a stand-in, which is reported
  Vec3 center = shape.center, u = shape.edge_u, v = shape.edge_v, normal{};
  const bool round = shape.kind == Shape::Kind::disk;
  if (round) {
    normal = (shape.flip_normals ? -1.0 : 1.0) * cross(u, v);
  } else if (type == "rectangle") {
    const auto at = [&](std::size_t k) {
      const auto& p = shape.mesh->position[k];
      return Vec3{p[0], p[1], p[2]};
    };
    const auto& t = shape.mesh->triangle[0];
    center = 0.5 * (at(0) + at(2));
    if (const auto own = builder.mesh_origins.find(shape.mesh.get()); own != builder.mesh_origins.end())
      center = center + own->second;
    u = 0.5 * (at(1) - at(0));
    v = 0.5 * (at(3) - at(0));
    normal = cross(at(t[1]) - at(t[0]), at(t[2]) - at(t[0]));
  } else {
    fail(lights[index].where,
         "a directionalarea in a " + quote(type) + "; need a rectangle or a disk: from others the beam would spread");
  }
  normal = normalize(normal);
  if (length(lights[index].value("normal").value) > 0) lights.push_back(lights[index]);  // of another shape, too
  Light& light = length(lights[index].value("normal").value) > 0 ? lights.back() : lights[index];
  light.value("center").value = center;
  light.value("normal").value = normal;
  light.value("to_u").value = (1 / dot(u, cross(v, normal))) * cross(v, normal);
  light.value("to_v").value = (1 / dot(v, cross(normal, u))) * cross(normal, u);
  light.set("round", round ? 1 : 0);
  shape.light = -1;
  shape.sends_beam = true;
}

}  // namespace

void check_single_precision(const Builder& builder, const Properties& properties, const Shape& shape) {
  if (!shape.mesh) return check_round(properties, shape);
  const auto own = builder.mesh_origins.find(shape.mesh.get());
  check_single_precision(properties, *shape.mesh, own == builder.mesh_origins.end() ? Vec3{} : own->second);
}

PlacedMesh bent_round_mesh(Builder& builder, const Shape& shape, const Transform& to_world, const std::string& title) {
  // The surface lies within 4e-5 of the radius; many such shapes are coarser, within 6e-4, to take less memory.
  constexpr std::size_t many = std::size_t{1} << 22;
  const int turn = builder.copied_triangles < many ? 256 : 64;
  PlacedMesh mesh = round_mesh(shape, turn);
  transform_mesh(to_world, mesh, true);
  builder.copied_triangles += mesh.triangle.size();
  builder.warn(shape.where,
               fmt::format("{}: to_world makes {} of it, which is rendered as a mesh of {} triangles", title,
                           shape.kind == Shape::Kind::sphere ? "an ellipsoid" : "an elliptic or oblique cylinder",
                           mesh.triangle.size()));
  return mesh;
}

namespace {

// Warns where a small file becomes a large mesh.
void warn_of_many_triangles(Builder& builder, const Properties& properties, const Mesh& mesh) {
  constexpr std::size_t many = 2'000'000;
  constexpr double bytes_a_triangle = 450;
  const auto triangles = static_cast<double>(mesh.triangle.size());
  if (mesh.triangle.size() > many)
    builder.warn(properties.element().where,
                 fmt::format("{} is rendered as {:.1f} million triangles, which take about {:.1f} GB of memory: fewer "
                             "points or values in the file make fewer",
                             properties.title(), 1e-6 * triangles, 1e-9 * bytes_a_triangle * triangles));
}

// Reads the geometry of a shape. Returns its mesh if it is one.
LoadedMesh read_geometry(Builder& builder, Properties& properties, Shape& shape) {
  LoadedMesh loaded;
  const std::string& type = properties.type();
  if (type == "obj" || type == "ply" || type == "serialized" || type == "mesh") {
    loaded = load_mesh(builder, properties);
  } else if (type == "rectangle") {
    loaded = load_flat(properties, rectangle_mesh());
  } else if (type == "cube") {
    loaded = load_flat(properties, cube_mesh());
  } else if (type == "linearcurve" || type == "bsplinecurve") {
    loaded = load_curves(properties);
    warn_of_many_triangles(builder, properties, loaded.mesh);
  } else if (type == "sdfgrid") {
    loaded = load_level_set(properties);
    warn_of_many_triangles(builder, properties, loaded.mesh);
  } else if (type == "sphere") {
    build_sphere(builder, properties, shape);
  } else if (type == "disk") {
    build_disk(properties, shape);
  } else if (type == "cylinder") {
    loaded = build_cylinder(builder, properties, shape);
  } else {
    fail_type(properties.element(), shape_types);
  }
  return loaded;
}

}  // namespace

PlacedMesh read_surface(Builder& builder, const Element& element) {
  Properties properties = builder.properties(element);
  Shape shape;
  LoadedMesh loaded = read_geometry(builder, properties, shape);
  properties.finish();
  if (shape.kind != Shape::Kind::mesh)
    fail(element.where,
         "a " + quote(properties.type()) + " has no mesh; need a shape that has: export it as PLY or OBJ");
  PlacedMesh mesh = finish_mesh(builder, properties, std::move(loaded));
  if (mesh.texcoord.empty())
    fail(element.where, properties.title() + " has no texture coordinates; export the mesh with them");
  return mesh;
}

Shape make_shape(Builder& builder, const Element& element) {
  Properties properties = builder.properties(element);
  Shape shape;
  shape.id = element.id;
  shape.where = element.where;
  LoadedMesh loaded = read_geometry(builder, properties, shape);
  if (const Element* emitter = properties.object("emitter")) shape.light = build_shape_light(builder, *emitter);
  if (const Element* bsdf = properties.object("bsdf"))
    shape.bsdf = build_bsdf(builder, *bsdf);
  else
    shape.bsdf = default_bsdf(builder, shape);
  if (const Element* medium = properties.object("medium", "interior")) shape.interior = build_medium(builder, *medium);
  if (const Element* medium = properties.object("medium", "exterior")) shape.exterior = build_medium(builder, *medium);
  properties.number("silhouette_sampling_weight", 1);  // how Mitsuba samples edges: not used here
  const Element* sensor = properties.object("sensor");
  properties.finish();
  check_texture(builder, builder.scene.bsdfs[static_cast<std::size_t>(shape.bsdf)], shape, loaded.mesh,
                properties.title());
  if (shape.light >= 0)
    check_texture(builder.scene.lights[static_cast<std::size_t>(shape.light)], shape, loaded.mesh, properties.title());
  check_boundary(builder, shape, loaded, properties.title());
  if (shape.kind == Shape::Kind::mesh) shape.mesh = builder.keep(finish_mesh(builder, properties, std::move(loaded)));
  if (sensor) build_sensor(builder, *sensor, &shape);
  return shape;
}

void read_shape(Builder& builder, const Element& element) {
  const std::string& type = element.attribute("type");
  if (type == "shapegroup") {
    shapes_of_group(builder, element);  // checked, and seen only where it has instances
  } else if (type == "instance") {
    build_instance(builder, element);
  } else {
    builder.scene.shapes.push_back(make_shape(builder, element));
    if (builder.scene.shapes.back().light >= 0) place_beam(builder, builder.scene.shapes.back(), type);
  }
}

}  // namespace itn
