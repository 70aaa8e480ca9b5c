// Meshes while a scene is read, as exact far from the origin as about it: positions in single precision from an origin
// in double.
#pragma once
#include <array>
#include <vector>

#include "itn/scene.h"

namespace itn {

// A box along the axes, in double precision.
struct Extent {
  Vec3 low, high;

  static Extent empty();
  void add(const Vec3& point);
  double longest_side() const;                // below 0 when empty
  double farthest_from(const Vec3& p) const;  // greatest difference of a coordinate
};

struct PlacedMesh : Mesh {
  Vec3 origin{0, 0, 0};  // of positions
  double rounding = 0;   // of positions that a file has in single precision, over the longest side
};

// Ratio of distance to size above which things are placed about an origin of their own. White glass then loses less
// than 1e-5 of its light in a white furnace, and a medium in a rough boundary 1e-4.
constexpr double far_away = 64;

std::array<float, 3> to_float(const Vec3& v);

// The middle of a box, to some digits, where it is far away; else (0, 0, 0).
Vec3 own_origin(const Extent& box);

// The middle as a multiple of a power of two about `size`: sums with it are exact for a long time.
Vec3 rounded_middle(const Vec3& middle, double size);

enum class FilePrecision { single, full };
void set_positions(PlacedMesh& mesh, const std::vector<Vec3>& positions, FilePrecision precision);

// With keeps_outside a reflection leaves the outside outside: triangles are reversed as well. Without, the winding
// decides, as Mitsuba does for meshes that have no normals of their own.
void transform_mesh(const Transform& transform, PlacedMesh& mesh, bool keeps_outside);

}  // namespace itn
