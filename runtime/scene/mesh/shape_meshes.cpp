#include "runtime/scene/mesh/shape_meshes.h"

namespace itn {

Mesh rectangle_mesh() {
  Mesh mesh;
  mesh.position = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  mesh.texcoord = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  mesh.triangle = {{0, 1, 2}, {2, 3, 0}};
  return mesh;
}

Mesh cube_mesh() {
  Mesh mesh;
  mesh.position = {{1, -1, -1}, {1, -1, 1},   {-1, -1, 1}, {-1, -1, -1}, {1, 1, -1},   {-1, 1, -1},
                   {-1, 1, 1},  {1, 1, 1},    {1, -1, -1}, {1, 1, -1},   {1, 1, 1},    {1, -1, 1},
                   {1, -1, 1},  {1, 1, 1},    {-1, 1, 1},  {-1, -1, 1},  {-1, -1, 1},  {-1, 1, 1},
                   {-1, 1, -1}, {-1, -1, -1}, {1, 1, -1},  {1, -1, -1},  {-1, -1, -1}, {-1, 1, -1}};
  for (std::uint32_t first = 0; first < 24; first += 4) {
    for (const auto& uv : {std::array<float, 2>{0, 1}, {1, 1}, {1, 0}, {0, 0}}) mesh.texcoord.push_back(uv);
    mesh.triangle.push_back({first, first + 1, first + 2});
    mesh.triangle.push_back({first + 3, first, first + 2});
  }
  return mesh;
}

}  // namespace itn
