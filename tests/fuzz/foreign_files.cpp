// In the place of the readers that call foreign libraries in a child process (runtime/base/child_process.h): those may
// crash, and starting a process for each input would take all the time.
#include "itn/error.h"
#include "runtime/scene/mesh/mesh_file.h"
#include "runtime/scene/volume/openvdb_file.h"

namespace itn {

PlacedMesh read_with_assimp(const std::string& file, const std::string& /*extension*/) {
  throw InputError(file + ": left to the child process");
}

PlacedGrid read_openvdb_file(const std::string& file, const std::string& /*name*/, VoxelValues /*allowed*/,
                             int /*bits*/) {
  throw InputError(file + ": left to the child process");
}

}  // namespace itn
