// Closed meshes made by formula, normals pointing out.
#pragma once
#include <memory>

#include "itn/scene.h"

namespace itn::test {

Mesh torus_knot(int segments, int sides);  // 2 * segments * sides triangles, inside [-1.3, 1.3]^3
Mesh cube(float half);
Mesh icosphere(int subdivisions);  // unit radius, 20 * 4^subdivisions triangles
// An icosphere whose vertices stand at random radii, with needles from `shortest` to 1.
Mesh spiky(int subdivisions, float shortest, unsigned seed);
// A star-shaped plate: thin, with edges as sharp as 0.1 degree.
Mesh star_plate(int points, float thickness);

Mesh moved(Mesh mesh, float scale, std::array<float, 3> translation);

Shape shape_of(Mesh mesh);
Shape sphere(Vec3 center, double radius);
Shape disk(Vec3 center, Vec3 edge_u, Vec3 edge_v);
Shape cylinder(Vec3 p0, Vec3 p1, double radius);  // open at its ends

}  // namespace itn::test
