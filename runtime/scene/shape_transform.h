// Shapes under transforms.
#pragma once
#include "runtime/scene/scene.h"

namespace itn {

// With keeps_outside a reflection leaves the outside outside: triangles are turned as well. Without, the winding
// decides, as Mitsuba does for meshes that have no normals of their own.
void transform_mesh(const Transform& transform, Mesh& mesh, bool keeps_outside);

// A sphere, a disk or a cylinder; reflections leave the outside outside. False when it would be none any more (an
// ellipsoid, say); it has then changed all the same.
bool transform_round(const Transform& transform, Shape& shape);

}  // namespace itn
