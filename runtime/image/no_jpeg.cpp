// A build without libjpeg (ITN_JPEG).
#include "itn/error.h"
#include "runtime/image/jpeg.h"

namespace itn {

Samples read_jpeg(const std::string&, const std::string& path) {
  throw InputError(path + ": this itn was built without libjpeg, which reads such files; build it with ITN_JPEG=ON");
}

}  // namespace itn
