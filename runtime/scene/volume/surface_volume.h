// A picture on a surface as a volume: each place has the colour of the surface's nearest point.
#pragma once
#include "itn/scene.h"

namespace itn {

// Voxels of equal edges that fill the mesh's box, so many along its longest side, each with the bitmap's value at the
// point of the mesh that is nearest to its middle. The mesh has texture coordinates and a triangle or more. Takes
// O(voxels log triangles) on all cores.
Volume surface_volume(const Mesh& mesh, const Texture& picture, int resolution);

}  // namespace itn
