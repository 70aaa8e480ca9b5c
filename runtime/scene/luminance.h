// The luminance of linear sRGB.
#pragma once
#include "runtime/scene/scene.h"

namespace itn {

// The weights of ITU-R BT.709, as Mitsuba 3 has them.
inline double luminance(const Rgb& rgb) { return 0.212671 * rgb[0] + 0.715160 * rgb[1] + 0.072169 * rgb[2]; }

}  // namespace itn
