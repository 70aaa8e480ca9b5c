// A rendering from two halves of its samples, which know nothing of each other's noise.
#pragma once
#include "runtime/image/rendering.h"

namespace itn {

// a, b: of the same image, two samples a pixel or more each, as many as the other. Everything but the image itself,
// its standard errors and its samples a pixel is a's.
Rendering whole_of(const Rendering& a, const Rendering& b);

}  // namespace itn
