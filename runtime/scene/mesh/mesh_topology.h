// Finds the triangles that meet at each edge, and whether a mesh is a closed surface with an inside.
#pragma once
#include <cstddef>
#include <vector>

#include "itn/scene.h"

namespace itn {

// For each vertex the number of its position: equal positions, equal numbers, from 0.
std::vector<std::uint32_t> number_positions(const Mesh& mesh);

// One side of a triangle.
struct HalfEdge {
  std::uint32_t low, high;  // position numbers, low < high
  std::uint32_t from, to;   // vertices, in the direction the triangle runs
  std::uint32_t triangle;
  bool forward;  // does it run from low to high?
};

// The sides of all triangles whose corners lie at three places. Those of one edge stand side by side.
std::vector<HalfEdge> half_edges(const Mesh& mesh, const std::vector<std::uint32_t>& position_number);

// f(first, last) for the half-edges of each edge: pointers into `edges`, `last` behind the end.
template <class Function>
void for_each_edge(const std::vector<HalfEdge>& edges, const Function& f) {
  const HalfEdge *first = edges.data(), *end = first + edges.size();
  while (first != end) {
    const HalfEdge* last = first;
    while (last != end && last->low == first->low && last->high == first->high) ++last;
    f(first, last);
    first = last;
  }
}

// Number of triangles that run along the edge from its low to its high end, less those that run back. A surface is
// closed where all edges have 0: then every point off the surface is a whole number of times inside.
int net_winding(const HalfEdge* first, const HalfEdge* last);

struct EdgePlace {
  Vec3 middle{};             // of the edge
  std::size_t triangle = 0;  // one of its triangles, from 0
};

// Reasons why a mesh is no closed surface that winds consistently. Vertices at the same position count as one.
struct Topology {
  std::size_t open_edges = 0;                     // of one triangle
  std::size_t turned_edges = 0;                   // of two triangles that wind against each other
  std::size_t non_manifold_edges = 0;             // of more, with unequally many triangles in the two directions
  EdgePlace open_at, turned_at, non_manifold_at;  // one of each
  std::size_t shared_edges = 0;                   // of more than two triangles, consistent or not
  double volume = 0;                              // signed: positive when triangles wind so that normals point out
  bool closed() const { return open_edges == 0 && turned_edges == 0 && non_manifold_edges == 0; }
};
Topology topology(const Mesh& mesh);

// Twice the area times the normal of a triangle of the mesh.
Vec3 area_normal(const Mesh& mesh, const std::array<std::uint32_t, 3>& triangle);
Vec3 position_of(const Mesh& mesh, std::uint32_t vertex);

}  // namespace itn
