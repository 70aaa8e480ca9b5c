#include "runtime/scene/shape_meshes.h"

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
  // Each face: its outward normal is axis a with the sign s; u and v run along the two axes after it.
  for (std::size_t a = 0; a < 3; ++a) {
    for (const float s : {-1.0f, 1.0f}) {
      const auto first = static_cast<std::uint32_t>(mesh.position.size());
      const std::size_t u = (a + 1) % 3, v = (a + 2) % 3;
      for (const auto& [x, y] : {std::array<float, 2>{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
        std::array<float, 3> p{};
        p[a] = s;
        p[u] = x * s;  // mirrored with the side, so that the winding stays outward
        p[v] = y;
        mesh.position.push_back(p);
        mesh.texcoord.push_back({(x + 1) / 2, (y + 1) / 2});
      }
      mesh.triangle.push_back({first, first + 1, first + 2});
      mesh.triangle.push_back({first + 2, first + 3, first});
    }
  }
  return mesh;
}

}  // namespace itn
