// The program's version, a part of what results depend on.
#pragma once

namespace itn {

// For instance "0.2.0".
const char* version();

}  // namespace itn
