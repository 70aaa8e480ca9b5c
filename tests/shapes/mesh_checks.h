// Checks that every mesh of runtime/scene/shapes must pass.
#pragma once
#include <cstddef>
#include <functional>

#include "runtime/scene/scene.h"

namespace itn::test {

// Every edge belongs to two triangles that run through it against each other, by vertex numbers and by positions; every
// vertex belongs to one fan of triangles; the volume is positive; corners of triangles are at least 1e-5 apart, numbers
// are finite, normals have length 1 and none points away from all of its triangles.
void check_closed(const Mesh& mesh);

// The longest side of the bounding box is 1, it rests on z = 0 with its middle over the origin.
void check_normalised(const Mesh& mesh);

// Pairs of triangles without a common vertex of which one's edge goes through the other.
std::size_t intersections(const Mesh& mesh);

// The largest of |f(a) - f(b)| / |a - b| over pairs of near points in the solids' space.
double steepest_slope(const std::function<double(const Vec3&)>& f, int pairs);

}  // namespace itn::test
