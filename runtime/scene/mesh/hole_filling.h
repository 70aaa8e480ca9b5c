// Triangles over a hole.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "itn/scene.h"

namespace itn {

constexpr std::size_t largest_loop = 1000;  // corners: the time grows with the cube, about a second there

// Triangulates the polygon with these corners (3 to largest_loop, in space, not necessarily in a plane) so that the
// area is least (Barequet and Sharir 1995, Filling gaps in the boundary of a polyhedron). Indices into `loop`; the
// triangles run along the loop's sides in its own direction.
std::vector<std::array<std::uint32_t, 3>> triangulate_loop(const std::vector<Vec3>& loop);

}  // namespace itn
