// Triangle meshes from files.
#pragma once
#include <string>

#include "runtime/scene/scene.h"

namespace itn {

// As the file says, in its own coordinates: vertices keep their order and are not merged for PLY; polygons become
// triangles; all groups become one mesh. Normals and texture coordinates where every vertex has them. Throws InputError
// naming the file for files that cannot be read, hold no triangle, an index out of range or a value that is not finite.
Mesh read_mesh(const std::string& file);

}  // namespace itn
