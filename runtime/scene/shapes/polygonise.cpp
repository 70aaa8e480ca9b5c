#include "runtime/scene/shapes/polygonise.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <unordered_map>
#include <utility>

#include "runtime/scene/mesh/mesh_repair.h"
#include "runtime/scene/transform.h"

namespace itn {
namespace {

struct Bounds {
  Vec3 low, high;
};

double longest_side(const Bounds& b) {
  return std::max({b.high[0] - b.low[0], b.high[1] - b.low[1], b.high[2] - b.low[2]});
}

// Cubes of the octree over the solids' space, 2^depth along a side, that may hold a piece of the surface.
void add_surface(const Solid& solid, const Vec3& center, double half, int depth, Bounds& bounds) {
  if (std::abs(solid(center)) > std::sqrt(3.0) * half) return;
  if (depth == 0) {
    for (std::size_t k = 0; k < 3; ++k) {
      bounds.low[k] = std::min(bounds.low[k], center[k] - half);
      bounds.high[k] = std::max(bounds.high[k], center[k] + half);
    }
    return;
  }
  for (int i = 0; i < 8; ++i)
    add_surface(solid,
                {center[0] + (i & 1 ? half : -half) / 2, center[1] + (i & 2 ? half : -half) / 2,
                 center[2] + (i & 4 ? half : -half) / 2},
                half / 2, depth - 1, bounds);
}

Bounds bounds_of(const Solid& solid) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Bounds bounds{{infinity, infinity, infinity}, {-infinity, -infinity, -infinity}};
  add_surface(solid, {0, 0, 0}, solid_space, 6, bounds);
  if (!(bounds.low[0] < bounds.high[0])) throw std::invalid_argument("a solid without a surface");
  return bounds;
}

using Index = std::array<int, 3>;

// The corners and the middles of cubes: every tetrahedron has two neighbouring middles and an edge of the square
// between them.
class Lattice {
 public:
  enum class Values { averaged, plain };  // plain: quick, enough for count()

  Lattice(const Solid& solid, const Bounds& bounds, double cell, Values values = Values::averaged)
      : solid_(solid), plain_(values == Values::plain), cell_(cell), origin_(bounds.low) {
    std::size_t points = 2;
    int largest = 1;
    for (std::size_t k = 0; k < 3; ++k) {
      size_[k] = static_cast<int>(std::ceil((bounds.high[k] - bounds.low[k]) / cell)) + 4;
      origin_[k] = (bounds.low[k] + bounds.high[k] - size_[k] * cell) / 2;
      points *= static_cast<std::size_t>(size_[k]);
      largest = std::max(largest, size_[k]);
    }
    value_.resize(points);
    moved_.resize(points, unmoved);
    int block = 1;
    while (block < largest) block *= 2;
    fill({0, 0, 0}, block);
  }

  Mesh surface() {
    for_each_tetrahedron([this](const std::array<std::size_t, 4>& tetrahedron) { cut(tetrahedron); });
    return std::move(mesh_);
  }

  // Number of triangles of all pieces together.
  std::size_t count() const {
    std::size_t triangles = 0;
    for_each_tetrahedron([&](const std::array<std::size_t, 4>& tetrahedron) {
      std::size_t inside = 0;
      for (const std::size_t corner : tetrahedron) inside += value_[corner] < 0;
      triangles += std::min(inside, 4 - inside);
    });
    return triangles;
  }

 private:
  static constexpr std::uint32_t unmoved = 0xffffffffu;

  // Points are numbered cube by cube: its low corner, its middle.
  std::size_t point(const Index& cube, int middle) const {
    const auto at = [&](std::size_t k) { return static_cast<std::size_t>(cube[k]); };
    return 2 * ((at(2) * static_cast<std::size_t>(size_[1]) + at(1)) * static_cast<std::size_t>(size_[0]) + at(0)) +
           static_cast<std::size_t>(middle);
  }

  Vec3 regular_position(const Index& cube, int middle) const {
    Vec3 p;
    for (std::size_t k = 0; k < 3; ++k) p[k] = origin_[k] + (cube[k] + 0.5 * middle) * cell_;
    return p;
  }

  Vec3 position(std::size_t number) const {
    if (moved_[number] != unmoved) return moved_position_[moved_[number]];
    const std::size_t cube = number / 2, nx = static_cast<std::size_t>(size_[0]),
                      ny = static_cast<std::size_t>(size_[1]);
    return regular_position(
        {static_cast<int>(cube % nx), static_cast<int>(cube / nx % ny), static_cast<int>(cube / nx / ny)},
        static_cast<int>(number % 2));
  }

  // Values at the points of a block of cubes: where the surface cannot reach, only their sign.
  void fill(const Index& low, int block) {
    Index high;
    for (std::size_t k = 0; k < 3; ++k) {
      high[k] = std::min(low[k] + block, size_[k]);
      if (low[k] >= high[k]) return;
    }
    const double half = 0.5 * block * cell_;
    const Vec3 corner = regular_position(low, 0);
    const double value = solid_({corner[0] + half, corner[1] + half, corner[2] + half});
    if (std::abs(value) > std::sqrt(3.0) * half + cell_) {
      for (int z = low[2]; z < high[2]; ++z)
        for (int y = low[1]; y < high[1]; ++y)
          for (int x = low[0]; x < high[0]; ++x)
            for (int middle = 0; middle < 2; ++middle) set({x, y, z}, middle, value);
    } else if (block == 1 && plain_) {
      set(low, 0, solid_(corner));
      set(low, 1, value);
    } else if (block == 1) {
      set(low, 0, mean_around(corner));
      set(low, 1, mean_around(regular_position(low, 1)));
      step_back(low, 0);
      step_back(low, 1);
    } else {
      for (int i = 0; i < 8; ++i)
        fill({low[0] + (i & 1) * block / 2, low[1] + (i & 2) / 2 * block / 2, low[2] + (i & 4) / 4 * block / 2},
             block / 2);
    }
  }

  // Nothing of the solid is in the outermost cubes, so that the surface closes inside.
  void set(const Index& cube, int middle, double value) {
    bool border = false;
    for (std::size_t k = 0; k < 3; ++k) border = border || cube[k] == 0 || cube[k] == size_[k] - 1;
    value_[point(cube, middle)] = border ? cell_ : value;
  }

  // A lattice point close to the surface is moved away from it: no edge is then cut near its end, and triangles are
  // well shaped. All movements are below a sixth of a cell, the tetrahedra's heights 0.7 cells: none turns inside out.
  void step_back(const Index& cube, int middle) {
    constexpr double gap = 0.15;  // [cells]
    const std::size_t number = point(cube, middle);
    const double value = value_[number];
    if (std::abs(value) >= gap * cell_) return;
    const Vec3 p = regular_position(cube, middle), slope = gradient(p);
    const double steepness = length(slope), distance = std::abs(value) / steepness;
    if (!(steepness > 0.01) || distance >= gap * cell_) return;
    const double step = (value < 0 ? -1 : 1) * (gap * cell_ - distance) / steepness;
    const Vec3 q = p + step * slope;
    const double there = mean_around(q);
    if ((there < 0) != (value < 0) || std::abs(there) < std::abs(value)) return;
    moved_[number] = static_cast<std::uint32_t>(moved_position_.size());
    moved_position_.push_back(q);
    value_[number] = there;
  }

  // The solid's values at the corners of a tetrahedron around p. Their mean is what is polygonised: edges that no
  // lattice can follow become bevels instead of saw teeth.
  static constexpr double corners[4][3] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
  std::array<double, 4> around(const Vec3& p) const {
    const double h = 0.4 * cell_;
    std::array<double, 4> values;
    for (std::size_t i = 0; i < 4; ++i)
      values[i] = solid_({p[0] + h * corners[i][0], p[1] + h * corners[i][1], p[2] + h * corners[i][2]});
    return values;
  }
  double mean_around(const Vec3& p) const {
    const auto v = around(p);
    return (v[0] + v[1] + v[2] + v[3]) / 4;
  }
  Vec3 gradient(const Vec3& p) const {
    const auto v = around(p);
    Vec3 sum{0, 0, 0};
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t k = 0; k < 3; ++k) sum[k] += v[i] * corners[i][k];
    return (1 / (1.6 * cell_)) * sum;
  }

  template <typename Visit>
  void for_each_tetrahedron(Visit visit) const {
    for (int z = 0; z < size_[2]; ++z)
      for (int y = 0; y < size_[1]; ++y)
        for (int x = 0; x < size_[0]; ++x)
          for (std::size_t axis = 0; axis < 3; ++axis) visit_between({x, y, z}, axis, visit);
  }

  // The four tetrahedra between the middles of this cube and of the next along the axis.
  template <typename Visit>
  void visit_between(const Index& cube, std::size_t axis, Visit& visit) const {
    const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    if (cube[0] + 1 == size_[0] || cube[1] + 1 == size_[1] || cube[2] + 1 == size_[2]) return;
    Index next = cube;
    ++next[axis];
    const std::size_t here = point(cube, 1), there = point(next, 1);
    std::size_t corner[4];
    for (int i = 0; i < 4; ++i) {
      Index c = next;
      c[u] += i == 1 || i == 2;
      c[v] += i >= 2;
      corner[i] = point(c, 0);
    }
    for (int i = 0; i < 4; ++i) visit(std::array<std::size_t, 4>{here, there, corner[i], corner[(i + 1) % 4]});
  }

  // The surface in a tetrahedron (a, b, c, d) with (b - a) . ((c - a) x (d - a)) > 0.
  void cut(const std::array<std::size_t, 4>& tetrahedron) {
    std::array<std::size_t, 4> corner{};
    std::size_t inside = 0, outside = 4;
    // Inner corners first; `odd`: the new order is an odd permutation of the old one.
    std::array<std::size_t, 4> order{};
    for (std::size_t i = 0; i < 4; ++i)
      if (value_[tetrahedron[i]] < 0) order[inside++] = i;
    if (inside == 0 || inside == 4) return;
    for (std::size_t i = 4; i-- > 0;)
      if (!(value_[tetrahedron[i]] < 0)) order[--outside] = i;
    bool odd = false;
    for (std::size_t i = 0; i < 4; ++i) {
      corner[i] = tetrahedron[order[i]];
      for (std::size_t j = 0; j < i; ++j) odd = odd != (order[j] > order[i]);
    }
    if (odd) std::swap(corner[inside == 1 ? 2 : 0], corner[inside == 1 ? 3 : 1]);
    const auto at = [&](std::size_t a, std::size_t b) { return vertex(corner[a], corner[b]); };
    if (inside == 1) {
      mesh_.triangle.push_back({at(0, 1), at(0, 2), at(0, 3)});
    } else if (inside == 3) {
      mesh_.triangle.push_back({at(0, 3), at(1, 3), at(2, 3)});
    } else {
      // A quadrilateral; its shorter diagonal.
      const std::array<std::uint32_t, 4> q{at(0, 2), at(0, 3), at(1, 3), at(1, 2)};
      const bool first = squared_distance(q[0], q[2]) <= squared_distance(q[1], q[3]);
      const std::size_t s = first ? 0 : 1;
      mesh_.triangle.push_back({q[s], q[s + 1], q[s + 2]});
      mesh_.triangle.push_back({q[s], q[s + 2], q[(s + 3) % 4]});
    }
  }

  double squared_distance(std::uint32_t a, std::uint32_t b) const {
    double sum = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double d = double{mesh_.position[a][k]} - mesh_.position[b][k];
      sum += d * d;
    }
    return sum;
  }

  // Index of the vertex where the surface cuts the edge between an inner and an outer point.
  std::uint32_t vertex(std::size_t inner, std::size_t outer) {
    const auto [low, high] = std::minmax(inner, outer);
    const auto [entry, is_new] =
        vertices_.try_emplace((std::uint64_t{low} << 32) | high, static_cast<std::uint32_t>(mesh_.position.size()));
    if (is_new) {
      const Vec3 a = position(inner), b = position(outer);
      const Vec3 p = a + crossing(a, b, value_[inner], value_[outer]) * (b - a);
      const Vec3 slope = gradient(p);
      const double steepness = length(slope);
      const Vec3 normal = steepness > 1e-6 ? (1 / steepness) * slope : normalize(b - a);
      mesh_.position.push_back({static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])});
      mesh_.normal.push_back(
          {static_cast<float>(normal[0]), static_cast<float>(normal[1]), static_cast<float>(normal[2])});
    }
    return entry->second;
  }

  // The share of the segment from a (value below 0) to b (0 or above) at which the function is 0: false position,
  // Illinois variant (Dowell and Jarratt 1971). Kept off the ends, so that no triangle is degenerate.
  double crossing(const Vec3& a, const Vec3& b, double a_value, double b_value) const {
    double low = 0, high = 1, share = 0.5;
    int last = 0;
    for (int i = 0; i < 12 && high - low > 1e-4; ++i) {
      share = low - a_value * (high - low) / (b_value - a_value);
      if (!(share > low && share < high)) share = 0.5 * (low + high);
      const double value = mean_around(a + share * (b - a));
      if (std::abs(value) < 1e-4 * cell_) break;
      if (value < 0) {
        low = share;
        a_value = value;
        if (last < 0) b_value /= 2;
        last = -1;
      } else {
        high = share;
        b_value = value;
        if (last > 0) a_value /= 2;
        last = 1;
      }
    }
    constexpr double margin = 0.02;
    return std::clamp(share, margin, 1 - margin);
  }

  const Solid& solid_;
  bool plain_;
  double cell_;
  Vec3 origin_;
  Index size_;
  std::vector<double> value_;
  std::vector<std::uint32_t> moved_;  // indices into moved_position_
  std::vector<Vec3> moved_position_;
  std::unordered_map<std::uint64_t, std::uint32_t> vertices_;  // lattice edge to vertex
  Mesh mesh_;
};

std::uint32_t root_of(std::vector<std::uint32_t>& parent, std::uint32_t i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

double sixfold_volume(const Mesh& mesh, const std::array<std::uint32_t, 3>& t) {
  const auto at = [&](std::size_t i) {
    const auto& p = mesh.position[t[i]];
    return Vec3{p[0], p[1], p[2]};
  };
  return dot(at(0), cross(at(1), at(2)));
}

// The connected piece with the largest volume.
Mesh largest_piece(const Mesh& mesh) {
  std::vector<std::uint32_t> parent(mesh.position.size());
  std::iota(parent.begin(), parent.end(), 0u);
  for (const auto& t : mesh.triangle)
    for (std::size_t i = 1; i < 3; ++i) parent[root_of(parent, t[i])] = root_of(parent, t[0]);
  std::vector<double> volume(mesh.position.size(), 0.0);
  for (const auto& t : mesh.triangle) volume[root_of(parent, t[0])] += sixfold_volume(mesh, t);
  const auto largest = static_cast<std::uint32_t>(std::max_element(volume.begin(), volume.end()) - volume.begin());
  Mesh piece;
  std::vector<std::uint32_t> number(mesh.position.size());
  for (std::uint32_t i = 0; i < mesh.position.size(); ++i) {
    if (root_of(parent, i) != largest) continue;
    number[i] = static_cast<std::uint32_t>(piece.position.size());
    piece.position.push_back(mesh.position[i]);
    piece.normal.push_back(mesh.normal[i]);
  }
  for (const auto& t : mesh.triangle)
    if (root_of(parent, t[0]) == largest) piece.triangle.push_back({number[t[0]], number[t[1]], number[t[2]]});
  return piece;
}

// Along sharp edges and in tight corners the gradient may belong to another side than the triangles do: the triangles'
// own mean direction is then the better normal.
void mend_normals(Mesh& mesh) {
  std::vector<std::array<float, 3>> gradient = std::move(mesh.normal);
  compute_normals(mesh);
  for (std::size_t i = 0; i < gradient.size(); ++i) {
    const auto &a = gradient[i], &b = mesh.normal[i];
    if (double{a[0]} * b[0] + double{a[1]} * b[1] + double{a[2]} * b[2] > 0.7) mesh.normal[i] = a;
  }
}

}  // namespace

Mesh polygonise(const Solid& solid, double cell) {
  const Mesh mesh = Lattice(solid, bounds_of(solid), cell).surface();
  if (mesh.triangle.empty()) throw std::invalid_argument("a solid without a part as thick as a cell");
  Mesh piece = largest_piece(mesh);
  mend_normals(piece);
  return piece;
}

Mesh shape_mesh(const Solid& solid, int triangles) {
  constexpr double counted = 64, coarsest = 16, finest = 160;  // cells along the longest side
  const Bounds bounds = bounds_of(solid);
  const double side = longest_side(bounds);
  const std::size_t count =
      std::max<std::size_t>(1, Lattice(solid, bounds, side / counted, Lattice::Values::plain).count());
  double cells = std::clamp(counted * std::sqrt(double(triangles) / static_cast<double>(count)), coarsest, finest);
  Mesh mesh = Lattice(solid, bounds, side / cells).surface();
  while (mesh.triangle.empty() && cells < finest) {
    cells = std::min(1.5 * cells, finest);
    mesh = Lattice(solid, bounds, side / cells).surface();
  }
  if (mesh.triangle.empty()) throw std::invalid_argument("a solid without a part as thick as a 160th of its length");
  mesh = largest_piece(mesh);
  mend_normals(mesh);
  set_on_floor(mesh);
  return mesh;
}

int genus(const Mesh& mesh) {
  // Every edge belongs to two triangles.
  const auto vertices = static_cast<std::int64_t>(mesh.position.size()),
             triangles = static_cast<std::int64_t>(mesh.triangle.size());
  return static_cast<int>((2 - (vertices - triangles / 2)) / 2);
}

}  // namespace itn
