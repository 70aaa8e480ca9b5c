// Round shapes under transforms.
#pragma once
#include "itn/scene.h"

namespace itn {

// A sphere, a disk or a cylinder; reflections leave the outside outside. False when it would be none any more (an
// ellipsoid, say); it has then changed all the same.
bool transform_round(const Transform& transform, Shape& shape);

}  // namespace itn
