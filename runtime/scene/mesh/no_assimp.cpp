// A build without Assimp (ITN_ASSIMP).
#include "itn/error.h"
#include "runtime/scene/mesh/mesh_file.h"

namespace itn {

PlacedMesh read_with_assimp(const std::string& file, const std::string&) {
  throw InputError(file + ": this itn was built without Assimp, which reads such files; build it with ITN_ASSIMP=ON");
}

}  // namespace itn
