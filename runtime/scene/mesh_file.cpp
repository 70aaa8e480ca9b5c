#include "runtime/scene/mesh_file.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/Importer.hpp>
#include <cmath>

#include "runtime/scene/xml/message.h"

namespace itn {
namespace {

std::array<float, 3> to_array(const aiVector3D& v) { return {v.x, v.y, v.z}; }

void append(const aiMesh& part, Mesh& mesh, bool with_normals, bool with_texcoords) {
  const auto first = static_cast<std::uint32_t>(mesh.position.size());
  for (unsigned i = 0; i < part.mNumVertices; ++i) {
    mesh.position.push_back(to_array(part.mVertices[i]));
    if (with_normals) mesh.normal.push_back(to_array(part.mNormals[i]));
    if (with_texcoords) mesh.texcoord.push_back({part.mTextureCoords[0][i].x, part.mTextureCoords[0][i].y});
  }
  for (unsigned i = 0; i < part.mNumFaces; ++i) {
    const aiFace& face = part.mFaces[i];
    if (face.mNumIndices == 3)  // points and lines are no surface
      mesh.triangle.push_back({first + face.mIndices[0], first + face.mIndices[1], first + face.mIndices[2]});
  }
}

template <std::size_t size>
void check_finite(const std::vector<std::array<float, size>>& values, const std::string& file,
                  const std::string& what) {
  for (std::size_t i = 0; i < values.size(); ++i)
    for (float v : values[i])
      if (!std::isfinite(v))
        throw InputError(file + ": " + what + " of vertex " + std::to_string(i) + " is " + to_text(v) +
                         "; need finite numbers: mend the mesh");
}

}  // namespace

Mesh read_mesh(const std::string& file) {
  Assimp::Importer importer;
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  const aiScene* scene = importer.ReadFile(file, aiProcess_Triangulate | aiProcess_PreTransformVertices);
  if (!scene) throw InputError(file + ": not a readable mesh: " + importer.GetErrorString() + "; export it again");
  bool with_normals = true, with_texcoords = true;
  for (unsigned i = 0; i < scene->mNumMeshes; ++i) {
    with_normals = with_normals && scene->mMeshes[i]->HasNormals();
    with_texcoords = with_texcoords && scene->mMeshes[i]->HasTextureCoords(0);
  }
  Mesh mesh;
  for (unsigned i = 0; i < scene->mNumMeshes; ++i) append(*scene->mMeshes[i], mesh, with_normals, with_texcoords);
  if (mesh.triangle.empty()) throw InputError(file + ": the mesh has no triangles; need at least one");
  for (const auto& corners : mesh.triangle)
    for (std::uint32_t corner : corners)
      if (corner >= mesh.position.size())
        throw InputError(file + ": a triangle refers to vertex " + std::to_string(corner) + "; the mesh has " +
                         std::to_string(mesh.position.size()) + ": mend the mesh");
  check_finite(mesh.position, file, "position");
  check_finite(mesh.normal, file, "normal");
  check_finite(mesh.texcoord, file, "texture coordinate");
  return mesh;
}

}  // namespace itn
