// The shape as a camera sees it: inputs of a network beside the image.
#pragma once
#include <vector>

#include "itn/scene.h"

namespace itn {

// Row-major, row 0 on top, along the ray through each pixel's centre.
struct ShapeBuffers {
  std::vector<Vec3> normal;   // of the first surface, world space, unit, towards the camera; 0 where there is none
  std::vector<double> depth;  // distance to it [unit]; 0 where there is none
  std::vector<double> mask;   // 1 where it is the body's (the shape with the given index), else 0
};

// The sensor: perspective, without crop. All shapes: meshes.
ShapeBuffers shape_buffers(const Scene& scene, int sensor, int body);

}  // namespace itn
