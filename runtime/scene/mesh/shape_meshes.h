// Mitsuba's flat shapes as meshes, in their own coordinates.
#pragma once
#include "itn/scene.h"

namespace itn {

Mesh rectangle_mesh();  // [-1, 1]^2 in the plane z = 0, normal +z, texture coordinates (x + 1)/2, (y + 1)/2
Mesh cube_mesh();       // [-1, 1]^3, four vertices a face, each with all of the texture

}  // namespace itn
