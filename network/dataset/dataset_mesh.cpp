#include "network/dataset/dataset_mesh.h"

#include <fmt/format.h>

#include "itn/error.h"
#include "runtime/scene/mesh/mesh_close.h"
#include "runtime/scene/mesh/mesh_file.h"
#include "runtime/scene/mesh/mesh_repair.h"
#include "runtime/scene/shapes/named_shapes.h"
#include "runtime/scene/shapes/random_shape.h"

namespace itn {
namespace {

Mesh named_mesh(const std::string& name) {
  for (const NamedShape& shape : named_shapes())
    if (shape.name == name) return shape.mesh();
  throw InputError("shape " + name + ": is none of those that this version knows; make the data set anew");
}

}  // namespace

std::shared_ptr<const Mesh> dataset_mesh(const Manifest::Shape& shape, const std::string& folder) {
  if (const auto* named = std::get_if<Manifest::NamedMesh>(&shape.mesh))
    return std::make_shared<const Mesh>(named_mesh(named->name));
  if (const auto* random = std::get_if<Manifest::RandomMesh>(&shape.mesh))
    return std::make_shared<const Mesh>(random_shape(random->seed).mesh(random->triangles));
  return std::make_shared<const Mesh>(read_mesh(folder + "/" + std::get<Manifest::FileMesh>(shape.mesh).file));
}

Mesh as_dataset_mesh(const std::string& file) {
  Mesh mesh = read_mesh(file);
  const Topology shape = close_mesh(mesh).left;
  if (!shape.closed()) {
    const EdgePlace& at = shape.open_edges           ? shape.open_at
                          : shape.non_manifold_edges ? shape.non_manifold_at
                                                     : shape.turned_at;
    throw InputError(fmt::format(
        "{}: {} open edges, {} of more than two triangles, {} between triangles that wind against each other, "
        "one near ({}, {}, {}); a body that light enters must be closed",
        file, shape.open_edges, shape.non_manifold_edges, shape.turned_edges, at.middle[0], at.middle[1],
        at.middle[2]));
  }
  if (shape.volume == 0) throw InputError(file + ": has no volume");
  drop_degenerate(mesh);
  if (mesh.normal.empty()) compute_normals(mesh);
  if (shape.volume < 0) flip(mesh);
  set_on_floor(mesh);
  mesh.texcoord.clear();
  return mesh;
}

}  // namespace itn
