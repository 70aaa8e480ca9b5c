// Spheres and cylinders as meshes, for transforms under which they are none any more.
#pragma once
#include "runtime/scene/mesh/placed_mesh.h"

namespace itn {

// The mesh of a sphere or a cylinder, of `turn` flat strips around its axis, with normals and with texture coordinates
// as Mitsuba has them, about the shape's center. It is as large as the shape: as much volume, or as much within the
// circle.
PlacedMesh round_mesh(const Shape& shape, int turn);

}  // namespace itn
