#include "runtime/scene/mesh/mesh_file.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>

#include "itn/error.h"

namespace itn {
namespace {

template <std::size_t size>
void check_finite(const std::vector<std::array<float, size>>& values, const std::string& file, const char* what) {
  for (std::size_t i = 0; i < values.size(); ++i)
    for (const float v : values[i])
      if (!std::isfinite(v))
        throw InputError(
            fmt::format("{}: {} of vertex {} is {}; need finite numbers: mend the mesh", file, what, i, v));
}

PlacedMesh read_by_extension(const std::string& file) {
  std::string extension = std::filesystem::path(file).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension == ".ply") return read_ply(file);
  if (extension == ".obj") return read_obj(file);
  if (extension == ".serialized") return read_serialized(file, 0);
  return read_with_assimp(file, extension);
}

}  // namespace

void check_mesh(const Mesh& mesh, const std::string& file) {
  const std::size_t vertices = mesh.position.size();
  const auto check_count = [&](std::size_t count, const char* what) {
    if (count != 0 && count != vertices)
      throw InputError(fmt::format("{}: {} {} for {} vertices; need one each or none: export the mesh again", file,
                                   count, what, vertices));
  };
  check_count(mesh.normal.size(), "normals");
  check_count(mesh.texcoord.size(), "texture coordinates");
  for (const MeshAttribute& a : mesh.attributes) {
    const std::size_t rows = a.name.rfind("face_", 0) == 0 ? mesh.triangle.size() : vertices;
    if (a.channels == 0 || a.values.size() != rows * a.channels)
      throw InputError(fmt::format("{}: the attribute {} has {} values; need {} of each of {}: export the mesh again",
                                   file, a.name, a.values.size(), a.channels, rows));
  }
  if (mesh.triangle.empty()) throw InputError(file + ": the mesh is empty; need at least one triangle");
  for (const auto& corners : mesh.triangle)
    for (const std::uint32_t corner : corners)
      if (corner >= mesh.position.size())
        throw InputError(fmt::format("{}: a triangle refers to vertex {}; the mesh has {}: mend the mesh", file, corner,
                                     mesh.position.size()));
  check_finite(mesh.position, file, "position");
  check_finite(mesh.normal, file, "normal");
  check_finite(mesh.texcoord, file, "texture coordinate");
  for (const MeshAttribute& a : mesh.attributes)
    for (std::size_t i = 0; i < a.values.size(); ++i)
      if (!std::isfinite(a.values[i]))
        throw InputError(fmt::format("{}: value {} of the attribute {} is {}; need finite numbers: mend the mesh", file,
                                     i / a.channels, a.name, a.values[i]));
}

PlacedMesh read_mesh(const std::string& file) {
  PlacedMesh mesh = read_by_extension(file);
  check_mesh(mesh, file);
  return mesh;
}

}  // namespace itn
