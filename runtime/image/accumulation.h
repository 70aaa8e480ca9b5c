// Renderings of different samples of one image become one.
#pragma once
#include "runtime/image/rendering.h"

namespace itn {

// Mean and standard error of all samples of both, up to rounding as if they had been rendered at once. Both are of the
// same film and derivatives; a `sum` without samples becomes the part.
void accumulate(Rendering& sum, const Rendering& part);

}  // namespace itn
