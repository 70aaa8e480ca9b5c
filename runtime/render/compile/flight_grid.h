// A grid over the media that knows flights which surely meet no surface, so that they need no ray test. Each cell keeps
// a part of space, around its centre, without any surface:
//   far from surfaces: a ball;
//   near surfaces: the part of a ball on the inner side of a plane that bounds all surfaces in the ball; and a cone
//   around the plane's normal that holds the normals of these surfaces: a flight inside a medium, against all normals
//   of the cone, meets none of them, since it could only leave through them.
// A word a cell: octahedral normal of the plane (2 x 8 bits), the plane's offset (8 bits; FLIGHT_NO_PLANE: the normal
// is then a guess of the nearest surface's), 8 bits for the radius of the ball, or for one of four radii and the cone.
// kernels/geometry/flight_grid.h reads it.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "itn/scene.h"

namespace itn {

struct FlightGrid {
  std::array<int, 3> cells{0, 0, 0};  // 0: no medium, no grid
  std::array<float, 3> low{0, 0, 0};
  float cell_size = 0, ball_step = 0, plane_range = 0, safety = 0;
  std::vector<std::uint32_t> words;  // bricks of 4 x 4 x 4 cells, x fastest in both
};

// Covers the shapes that have a medium on a side; all surfaces count.
FlightGrid build_flight_grid(const Scene& scene);

}  // namespace itn
