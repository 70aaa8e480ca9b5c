#include "runtime/render/compile/geometry.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <stdexcept>

#include "itn/error.h"
#include "kernels/model/shading_frame.h"
#include "kernels/shared/declaration.h"
#include "runtime/base/memory.h"
#include "runtime/render/compile/bvh.h"
#include "runtime/render/compile/flight_grid.h"
#include "runtime/scene/transform.h"

namespace itn {

namespace {

// Rounding errors of positions and of the tests stay below this part of the largest coordinate (float: 2^-24 an
// operation).
constexpr float tolerance_ratio = 0x1p-21f;
constexpr float widen_ratio = 0x1p-19f;

using Point = std::array<float, 3>;

Vec3 to_double(const Point& p) { return {p[0], p[1], p[2]}; }
Point to_float(const Vec3& p) { return {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])}; }

Vec3 some_normal(const Vec3& direction) {
  const Vec3 other = std::fabs(direction[0]) < 0.5 * length(direction) ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  const Vec3 n = cross(direction, other);
  return length(n) > 0 ? normalize(n) : Vec3{0, 0, 1};
}

float largest_coordinate(const Box& box) {
  float m = 0;
  for (std::size_t k = 0; k < 3; ++k) m = std::max({m, std::fabs(box.low[k]), std::fabs(box.high[k])});
  return m;
}

// One flat or round primitive with everything that a block keeps of it.
struct Entry {
  std::array<float, BLOCK_ROWS> rows{};
  Box box;
};

// dp/du and dp/dv of a triangle in the frame around its normal.
using TextureAxes = std::array<float, 4>;

struct Surfaces {
  std::vector<PrimitiveRecord> records;
  std::vector<TextureAxes> axes;
  std::vector<Entry> entries;  // rows of BLOCK_PRIMITIVE are filled in later
  std::vector<bool> is_round;
};

void copy(const Vec3& from, float* to) {
  for (std::size_t k = 0; k < 3; ++k) to[k] = static_cast<float>(from[k]);
}

// Stores the direction in which a triangle's first texture coordinate grows, in the frame that the device makes around
// its normal; the frame's first axis, as in Mitsuba, where the coordinates do not tell. e1, e2: the edges from the
// first vertex
TextureAxes store_tangent(const Vec3& e1, const Vec3& e2, PrimitiveRecord& record) {
  const float* uv = record.uv;
  const double du1 = static_cast<double>(uv[2]) - uv[0], dv1 = static_cast<double>(uv[3]) - uv[1];
  const double du2 = static_cast<double>(uv[4]) - uv[0], dv2 = static_cast<double>(uv[5]) - uv[1];
  const double determinant = du1 * dv2 - du2 * dv1;
  const Vec3 tangent = (determinant < 0 ? -1.0 : 1.0) * (dv2 * e1 - dv1 * e2);
  Vector3<double> s{}, t{};
  shading_frame(Vector3<double>{record.normal[0], record.normal[1], record.normal[2]}, &s, &t);
  const double x = dot(tangent, {s.x, s.y, s.z}), y = dot(tangent, {t.x, t.y, t.z}), size = std::hypot(x, y);
  const bool told = determinant != 0 && size > 0;
  record.tangent[0] = told ? static_cast<float>(x / size) : 1;
  record.tangent[1] = told ? static_cast<float>(y / size) : 0;
  if (!told) return {1, 0, 0, 1};
  const Vec3 along_u = (1 / determinant) * (dv2 * e1 - dv1 * e2), along_v = (1 / determinant) * (du1 * e2 - du2 * e1);
  const auto in_plane = [&](const Vec3& v) {
    return std::array{static_cast<float>(dot(v, {s.x, s.y, s.z})), static_cast<float>(dot(v, {t.x, t.y, t.z}))};
  };
  const auto u = in_plane(along_u), v = in_plane(along_v);
  return {u[0], u[1], v[0], v[1]};
}

void add_mesh(const Shape& shape, int index, Surfaces& out) {
  const Mesh& mesh = *shape.mesh;
  Box bounds;
  for (const Point& p : mesh.position) {
    if (!std::isfinite(p[0] + p[1] + p[2]))
      throw InputError(shape.where.file + ":" + std::to_string(shape.where.line) +
                       ": shape has a vertex position that is not finite; repair the mesh file");
    bounds.add(p);
  }
  const float tolerance = tolerance_ratio * largest_coordinate(bounds);
  for (const auto& triangle : mesh.triangle) {
    Entry entry;
    std::array<Vec3, 3> p;
    for (std::size_t j = 0; j < 3; ++j) {
      const Point& vertex = mesh.position[triangle[j]];
      p[j] = to_double(vertex);
      entry.box.add(vertex);
      std::copy(vertex.begin(), vertex.end(), &entry.rows[BLOCK_A + 3 * j]);
    }
    const Vec3 e0 = p[1] - p[0], e1 = p[2] - p[1], e2 = p[0] - p[2];
    const double longest = std::max({length(e0), length(e1), length(e2)});
    // Two vertices at one place: nothing to hit. Other slivers stay, so that no crack opens beside them.
    if (std::min({length(e0), length(e1), length(e2)}) == 0) continue;
    Vec3 normal = cross(e0, e1);
    const double area2 = length(normal);
    normal = area2 > 0 ? (1 / area2) * normal : some_normal(e0);
    entry.rows[BLOCK_TOLERANCE] = static_cast<float>(tolerance * area2);
    // Keeps returned positions away from edges, where rounding could put them outside a neighbour's plane.
    entry.rows[BLOCK_MARGIN] = static_cast<float>(std::min(0.25, 16 * tolerance * longest / std::max(area2, 1e-30)));
    PrimitiveRecord record{};
    copy(normal, record.normal);
    record.offset = tolerance;
    record.shape = index;
    if (mesh.texcoord.empty())
      record.uv[2] = record.uv[5] = 1;  // the barycentric coordinates, as in Mitsuba
    else
      for (std::size_t j = 0; j < 3; ++j) std::copy_n(mesh.texcoord[triangle[j]].begin(), 2, record.uv + 2 * j);
    out.axes.push_back(store_tangent(e0, -1.0 * e2, record));
    if (!mesh.normal.empty()) {
      record.flags = PRIMITIVE_SMOOTH;
      for (std::size_t j = 0; j < 3; ++j) std::copy_n(mesh.normal[triangle[j]].begin(), 3, record.frame + 3 * j);
    }
    out.records.push_back(record);
    out.entries.push_back(entry);
    out.is_round.push_back(false);
  }
}

// Adds what all round primitives have in common; `entry` has its box. normal, frame: of the record.
void add_round(const Shape& shape, int index, layout_uint kind, const Vec3& normal, const std::array<Vec3, 3>& frame,
               Entry entry, Surfaces& out) {
  const float tolerance = tolerance_ratio * largest_coordinate(entry.box);
  copy(shape.center, &entry.rows[BLOCK_CENTER]);
  entry.rows[BLOCK_TOLERANCE] = tolerance;
  PrimitiveRecord record{};
  copy(normal, record.normal);
  record.radius = std::fabs(entry.rows[BLOCK_RADIUS]);
  record.offset = tolerance;
  record.shape = index;
  record.flags = kind | (shape.flip_normals ? layout_uint{PRIMITIVE_FLIPPED} : 0u);
  for (std::size_t k = 0; k < 3; ++k) copy(frame[k], record.frame + 3 * k);
  out.records.push_back(record);
  out.axes.emplace_back();  // they follow from the shape
  out.entries.push_back(entry);
  out.is_round.push_back(true);
}

void add_sphere(const Shape& shape, int index, Surfaces& out) {
  Entry entry;
  const Point center = to_float(shape.center);
  const auto radius = static_cast<float>(shape.radius);
  for (std::size_t k = 0; k < 3; ++k) {
    entry.box.low[k] = center[k] - radius;
    entry.box.high[k] = center[k] + radius;
  }
  entry.rows[BLOCK_RADIUS] = radius;
  add_round(shape, index, PRIMITIVE_SPHERE, shape.center,
            {normalize(shape.edge_u), normalize(shape.edge_v), normalize(shape.axis)}, entry, out);
}

void add_cylinder(const Shape& shape, int index, Surfaces& out) {
  const Vec3 dual = (1 / dot(shape.axis, shape.axis)) * shape.axis;
  Entry entry;
  entry.box = box_of(shape);
  copy(dual, &entry.rows[BLOCK_DUAL_AXIS]);
  entry.rows[BLOCK_RADIUS] = -static_cast<float>(shape.radius);
  add_round(shape, index, PRIMITIVE_CYLINDER, shape.center, {normalize(shape.edge_u), normalize(shape.edge_v), dual},
            entry, out);
}

void add_disk(const Shape& shape, int index, Surfaces& out) {
  const Vec3 &u = shape.edge_u, &v = shape.edge_v;
  Vec3 normal = cross(u, v);
  const double area = length(normal);
  if (area == 0) return;
  normal = (1 / area) * normal;
  // dual_u . u = 1, dual_u . v = 0 and vice versa
  const Vec3 dual_u = (1 / area) * cross(v, normal), dual_v = (1 / area) * cross(normal, u);
  Entry entry;
  for (std::size_t k = 0; k < 3; ++k) {
    const double extent = std::hypot(u[k], v[k]);
    entry.box.low[k] = static_cast<float>(shape.center[k] - extent);
    entry.box.high[k] = static_cast<float>(shape.center[k] + extent);
  }
  copy(dual_u, &entry.rows[BLOCK_DUAL_U]);
  copy(dual_v, &entry.rows[BLOCK_DUAL_V]);
  add_round(shape, index, PRIMITIVE_DISK, (shape.flip_normals ? -1.0 : 1.0) * normal, {shape.center, dual_u, dual_v},
            entry, out);
}

// Writes trees into the flat arrays of one geometry.
class Writer {
 public:
  Writer(const Surfaces& surfaces, float widen, Geometry& geometry)
      : surfaces_(surfaces),
        widen_(widen),
        width_(static_cast<std::size_t>(geometry.box_width)),
        geometry_(geometry),
        first_node_(geometry.nodes.size()),
        first_leaf_(geometry.leaves.size()) {}

  // The code of the tree's root, CHILD_NONE when there is none.
  int add(const WideTree& tree, bool is_round) {
    if (tree.nodes.empty()) return CHILD_NONE;
    const std::size_t block_size = BLOCK_ROWS * width_;
    const int first_node = node_count(),
              first_block = static_cast<int>((geometry_.leaves.size() - first_leaf_) / block_size);
    for (const WideTree::Block& block : tree.blocks) add_block(tree, block, is_round);
    for (const WideNode& node : tree.nodes) {
      std::vector<std::pair<Box, int>> children;
      for (const auto& child : node.children) {
        const auto i = static_cast<int>(child.index);
        children.emplace_back(child.box, child.is_block ? CHILD_BLOCK(first_block + i, is_round) : first_node + i);
      }
      add_node(children);
    }
    return first_node;
  }

  int add_node(const std::vector<std::pair<Box, int>>& children) {
    const int index = node_count();
    const std::size_t at = geometry_.nodes.size();
    geometry_.nodes.resize(at + NODE_ROWS * width_);
    for (std::size_t i = 0; i < width_; ++i) {
      float* lane = &geometry_.nodes[at + i];
      const bool used = i < children.size();
      for (std::size_t k = 0; k < 3; ++k) {
        lane[(2 * k) * width_] = used ? children[i].first.low[k] - widen_ : 1e30f;
        lane[(2 * k + 1) * width_] = used ? children[i].first.high[k] + widen_ : -1e30f;
      }
      lane[NODE_CHILD * width_] = std::bit_cast<float>(used ? children[i].second : CHILD_NONE);
    }
    return index;
  }

 private:
  int node_count() const { return static_cast<int>((geometry_.nodes.size() - first_node_) / (NODE_ROWS * width_)); }

  void add_block(const WideTree& tree, const WideTree::Block& block, bool is_round) {
    const std::size_t at = geometry_.leaves.size();
    geometry_.leaves.resize(at + BLOCK_ROWS * width_);
    for (std::size_t i = 0; i < width_; ++i) {
      float* lane = &geometry_.leaves[at + i];
      const bool used = i < block.count;
      const std::uint32_t primitive = tree.primitives[block.first + (used ? i : 0)].index;
      auto rows = surfaces_.entries[primitive].rows;
      if (!used && !is_round)
        for (std::size_t k = 0; k < 3; ++k) rows[BLOCK_B + k] = rows[BLOCK_C + k] = rows[BLOCK_A + k];
      rows[BLOCK_PRIMITIVE] = std::bit_cast<float>(used ? static_cast<int>(primitive) : -1);
      for (std::size_t row = 0; row < BLOCK_ROWS; ++row) lane[row * width_] = rows[row];
    }
  }

  const Surfaces& surfaces_;
  float widen_;
  std::size_t width_;
  Geometry& geometry_;
  std::size_t first_node_, first_leaf_;
};

Box box_of(const WideTree& tree) {
  Box box;
  if (!tree.nodes.empty())
    for (const auto& child : tree.nodes[0].children) box.add(child.box);
  return box;
}

// With few levels of the heuristic when the device's stack asks for it (meshes whose triangles differ by orders of
// magnitude).
WideTree build_tree(const std::vector<BoxedPrimitive>& primitives, int width) {
  const int limit = TRACE_STACK(width) - 1;  // one entry for the node that joins triangles and round shapes
  for (const int heuristic_depth : {48, 12}) {
    WideTree tree = build_tree(primitives, width, heuristic_depth);
    if (tree.stack_depth <= limit) return tree;
  }
  throw ResultError("geometry: the hierarchy of " + std::to_string(primitives.size()) +
                    " primitives is too deep for the device's stack of " + std::to_string(limit) +
                    "; use a mesh with fewer triangles");
}

std::uint32_t offset(std::size_t size) {
  if (size > 0xffffffffu)
    throw ResultError("geometry: more than 2^32 values; use a smaller mesh or fewer scenes a launch");
  return static_cast<std::uint32_t>(size);
}

}  // namespace

void append_geometry(const Scene& scene, Geometry& geometry) {
  constexpr std::size_t many_triangles = 1'000'000;
  constexpr double bytes_a_triangle = 350;  // at the peak, beside the meshes
  std::size_t all = 0;
  for (const Shape& shape : scene.shapes) all += shape.mesh ? shape.mesh->triangle.size() : 1;
  if (all > many_triangles)
    require_memory(bytes_a_triangle * static_cast<double>(all),
                   "the hierarchy of the scene's " + std::to_string(all) + " triangles",
                   "use fewer instances, curves or triangles");
  Surfaces surfaces;
  for (std::size_t i = 0; i < scene.shapes.size(); ++i) {
    const Shape& shape = scene.shapes[i];
    const int index = static_cast<int>(i);
    switch (shape.kind) {
      case Shape::Kind::mesh:
        add_mesh(shape, index, surfaces);
        break;
      case Shape::Kind::sphere:
        add_sphere(shape, index, surfaces);
        break;
      case Shape::Kind::disk:
        add_disk(shape, index, surfaces);
        break;
      case Shape::Kind::cylinder:
        add_cylinder(shape, index, surfaces);
        break;
    }
  }
  std::vector<BoxedPrimitive> triangles, rounds;
  for (std::uint32_t i = 0; i < surfaces.entries.size(); ++i)
    (surfaces.is_round[i] ? rounds : triangles).push_back({surfaces.entries[i].box, i});
  const WideTree triangle_tree = build_tree(triangles, geometry.box_width);
  const WideTree round_tree = build_tree(rounds, geometry.box_width);

  GeometryRecord record{};
  record.first_node = offset(geometry.nodes.size());
  record.first_leaf = offset(geometry.leaves.size());
  record.first_primitive = offset(geometry.primitives.size());
  record.first_cell = offset(geometry.grid.size());
  Box bounds = box_of(triangle_tree);
  bounds.add(box_of(round_tree));
  const float widen = surfaces.entries.empty() ? 0 : widen_ratio * largest_coordinate(bounds);
  for (std::size_t k = 0; k < 3; ++k) {
    record.low[k] = bounds.low[k] - widen;
    record.high[k] = bounds.high[k] + widen;
  }
  Writer writer(surfaces, widen, geometry);
  const int triangle_root = writer.add(triangle_tree, false), round_root = writer.add(round_tree, true);
  record.root = triangle_root == CHILD_NONE ? round_root : triangle_root;
  if (triangle_root != CHILD_NONE && round_root != CHILD_NONE)
    record.root = writer.add_node({{box_of(triangle_tree), triangle_root}, {box_of(round_tree), round_root}});
  offset(geometry.leaves.size());
  const bool bumped = std::any_of(scene.bsdfs.begin(), scene.bsdfs.end(),
                                  [](const Bsdf& bsdf) { return bsdf.model && (bsdf.model->traits & BSDF_BUMPED); });
  if (bumped || !geometry.texture_axes.empty()) {
    geometry.texture_axes.resize(4 * geometry.primitives.size());
    for (const TextureAxes& axes : surfaces.axes)
      geometry.texture_axes.insert(geometry.texture_axes.end(), axes.begin(), axes.end());
  }
  surfaces.entries = {};  // the records take as much again
  geometry.primitives.insert(geometry.primitives.end(), surfaces.records.begin(), surfaces.records.end());
  surfaces = {};
  const FlightGrid grid = build_flight_grid(scene);
  for (std::size_t k = 0; k < 3; ++k) {
    record.cells[k] = grid.cells[k];
    record.grid_low[k] = grid.low[k];
  }
  record.cell_size = grid.cell_size;
  record.inverse_cell_size = grid.cell_size > 0 ? 1 / grid.cell_size : 0;
  record.ball_step = grid.ball_step;
  record.plane_range = grid.plane_range;
  record.safety = grid.safety;
  geometry.grid.insert(geometry.grid.end(), grid.words.begin(), grid.words.end());
  geometry.records.push_back(record);
}

void append_geometry(const Geometry& from, Geometry& geometry) {
  if (!from.texture_axes.empty() || !geometry.texture_axes.empty()) {
    geometry.texture_axes.resize(4 * geometry.primitives.size());
    geometry.texture_axes.insert(geometry.texture_axes.end(), from.texture_axes.begin(), from.texture_axes.end());
    geometry.texture_axes.resize(4 * (geometry.primitives.size() + from.primitives.size()));
  }
  for (GeometryRecord record : from.records) {
    record.first_node += offset(geometry.nodes.size());
    record.first_leaf += offset(geometry.leaves.size());
    record.first_primitive += offset(geometry.primitives.size());
    record.first_cell += offset(geometry.grid.size());
    geometry.records.push_back(record);
  }
  const auto append = [](const auto& values, auto& to) { to.insert(to.end(), values.begin(), values.end()); };
  append(from.nodes, geometry.nodes);
  append(from.leaves, geometry.leaves);
  append(from.primitives, geometry.primitives);
  append(from.grid, geometry.grid);
  offset(geometry.leaves.size());
}

}  // namespace itn
