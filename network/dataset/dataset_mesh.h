// The meshes of a data set's shapes.
#pragma once
#include <memory>
#include <string>

#include "itn/scene.h"
#include "network/dataset/manifest.h"

namespace itn {

// Made here or read from the set's folder; always the same. Throws InputError: a file that is damaged.
std::shared_ptr<const Mesh> dataset_mesh(const Manifest::Shape& shape, const std::string& folder);

// Anybody's mesh as a data set's shape: normals, resting on z = 0, longest side 1, its middle over the origin. Throws
// InputError: unreadable, not closed (says where), without volume.
Mesh as_dataset_mesh(const std::string& file);

}  // namespace itn
