// Every other format, through Assimp.
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <assimp/Importer.hpp>

#include "runtime/base/error.h"
#include "runtime/scene/mesh/mesh_file.h"

namespace itn {
namespace {

void append(const aiMesh& part, Mesh& mesh, bool with_normals, bool with_texcoords) {
  const auto first = static_cast<std::uint32_t>(mesh.position.size());
  for (unsigned i = 0; i < part.mNumVertices; ++i) {
    const aiVector3D& p = part.mVertices[i];
    mesh.position.push_back({p.x, p.y, p.z});
    if (with_normals) mesh.normal.push_back({part.mNormals[i].x, part.mNormals[i].y, part.mNormals[i].z});
    if (with_texcoords) mesh.texcoord.push_back({part.mTextureCoords[0][i].x, part.mTextureCoords[0][i].y});
  }
  for (unsigned i = 0; i < part.mNumFaces; ++i) {
    const aiFace& face = part.mFaces[i];
    if (face.mNumIndices == 3)  // points and lines are no surface
      mesh.triangle.push_back({first + face.mIndices[0], first + face.mIndices[1], first + face.mIndices[2]});
  }
}

}  // namespace

Mesh read_with_assimp(const std::string& file) {
  Assimp::Importer importer;
  // Identical corners become one vertex again, so that normals computed later are smooth across faces.
  const aiScene* scene =
      importer.ReadFile(file, aiProcess_Triangulate | aiProcess_PreTransformVertices | aiProcess_JoinIdenticalVertices);
  if (!scene) throw InputError(file + ": not a readable mesh: " + importer.GetErrorString() + "; export it again");
  bool with_normals = true, with_texcoords = true;
  for (unsigned i = 0; i < scene->mNumMeshes; ++i) {
    with_normals = with_normals && scene->mMeshes[i]->HasNormals();
    with_texcoords = with_texcoords && scene->mMeshes[i]->HasTextureCoords(0);
  }
  Mesh mesh;
  for (unsigned i = 0; i < scene->mNumMeshes; ++i) append(*scene->mMeshes[i], mesh, with_normals, with_texcoords);
  return mesh;
}

}  // namespace itn
