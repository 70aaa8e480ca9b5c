#include "itn/version.h"

namespace itn {

const char* version() { return ITN_VERSION; }

}  // namespace itn
