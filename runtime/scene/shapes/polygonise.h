// Closed triangle meshes from solids.
#pragma once
#include "runtime/scene/shapes/solid.h"

namespace itn {

constexpr double solid_space = 2;  // solids lie in [-solid_space, solid_space]^3; what reaches out is cut off there

// The surface of the solid as a closed mesh that winds outwards, by marching tetrahedra on a body-centred cubic lattice
// with cubes of size `cell` (README.md says why). Every edge belongs to two triangles that run through it against each
// other, no triangle is degenerate, none meets another but in a common edge or corner: by construction, whatever the
// function. The function is first averaged over about a cell: the edges of a solid become bevels of about a cell's
// width, and balls of radius R shrink by some 0.2 cell^2 / R. Vertices lie on that surface to some 1e-4 cells and carry
// its gradient as their normal. Parts thinner than a cell are lost. Pieces other than the largest are left out, and so
// are cavities: what remains is connected. Throws std::invalid_argument where nothing is left.
Mesh polygonise(const Solid& solid, double cell);

// polygonise() with cells such that the mesh has about `triangles`, within a third or so; 16 to 160 cells along the
// longest side, finer than asked for where nothing would be left. Then moved and scaled: the longest side of the
// bounding box is 1, the lowest point has z = 0, the middle of the bounding box stands over the origin.
Mesh shape_mesh(const Solid& solid, int triangles);

// The genus (number of handles) of a connected closed mesh: from vertices - edges + triangles = 2 - 2 genus.
int genus(const Mesh& mesh);

}  // namespace itn
