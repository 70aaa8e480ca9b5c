// Curves with a thickness, as triangle meshes: Mitsuba's linearcurve and bsplinecurve.
#pragma once
#include <string>
#include <vector>

#include "itn/scene.h"

namespace itn {

struct ControlPoint {
  Vec3 position;
  double radius = 0;
};
using Curve = std::vector<ControlPoint>;

// Mitsuba's text files: a control point a line, its position and radius, and an empty line between curves. Throws
// InputError naming the line: what is no number or not finite, negative radii, curves of fewer than `least`
// points.
std::vector<Curve> read_curves(const std::string& file, std::size_t least);

// Balls at the points and the cones that touch two neighbours.
Mesh linear_curve_mesh(const std::vector<Curve>& curves);

// A circle at right angles to a uniform cubic B-spline, moved along it; open at both ends, and begins and ends, like
// the spline, near the second point from either.
Mesh bspline_curve_mesh(const std::vector<Curve>& curves);

}  // namespace itn
