// A build without OpenVDB (ITN_OPENVDB).
#include "itn/error.h"
#include "runtime/scene/volume/openvdb_file.h"

namespace itn {

PlacedGrid read_openvdb_file(const std::string& file, const std::string&, VoxelValues, int) {
  throw InputError(file + ": this itn was built without OpenVDB, which reads such files; build it with ITN_OPENVDB=ON");
}

}  // namespace itn
