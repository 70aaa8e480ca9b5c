// Makes meshes fit for rays, and for shapes of a data set.
#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "itn/scene.h"

namespace itn {

// Vertex normals weighted by the angles of the triangles at the vertex (Thürmer and Wüthrich 1998), over the vertices
// as they are indexed: what Mitsuba shades a mesh without normals with.
void compute_normals(Mesh& mesh);

// Reverses every triangle and normal.
void flip(Mesh& mesh);

// Removes the triangles that are marked, with their values of attributes.
void erase_triangles(Mesh& mesh, const std::vector<bool>& marked);

// A triangle with the values of another one.
void add_triangle(Mesh& mesh, const std::array<std::uint32_t, 3>& triangle, std::size_t like);

// Removes triangles without area; returns how many.
std::size_t drop_degenerate(Mesh& mesh);

// Removes vertices that no triangle has: far away, they would make the scene's rounding errors seem large.
void drop_unused_vertices(Mesh& mesh);

// Scales and moves a mesh such that its longest side is 1, its lowest point has z = 0, and the middle of its box stands
// over the origin.
void set_on_floor(Mesh& mesh);

}  // namespace itn
