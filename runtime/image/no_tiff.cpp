// A build without libtiff (ITN_TIFF).
#include "itn/error.h"
#include "runtime/image/tiff.h"

namespace itn {

Samples read_tiff(const std::string&, const std::string& path) {
  throw InputError(path + ": this itn was built without libtiff, which reads such files; build it with ITN_TIFF=ON");
}

}  // namespace itn
