// What a mesh must fulfil before rays meet it, and a data set's shape besides.
#pragma once
#include <cstddef>
#include <string>

#include "runtime/scene/scene.h"

namespace itn {

// Vertex normals weighted by the angles of the triangles at the vertex (Thürmer and Wüthrich 1998), over the vertices
// as they are indexed: what Mitsuba shades a mesh without normals with.
void compute_normals(Mesh& mesh);

// Turns every triangle and normal around.
void flip(Mesh& mesh);

// Removes triangles without area; returns how many.
std::size_t drop_degenerate(Mesh& mesh);

// Scales and moves a mesh such that its longest side is 1, its lowest point has z = 0, and the middle of its box stands
// over the origin.
void set_on_floor(Mesh& mesh);

// How a mesh fails to be a closed surface that winds consistently. Vertices at the same position count as one.
struct Topology {
  std::size_t open_edges = 0;                      // edges of one triangle only
  std::size_t non_manifold_edges = 0;              // of more than two
  std::size_t turned_edges = 0;                    // two triangles wind against each other there
  Vec3 open_at{}, non_manifold_at{}, turned_at{};  // the middle of one such edge
  double volume = 0;                               // signed: positive when triangles wind so that normals point out
  bool closed() const { return open_edges == 0 && non_manifold_edges == 0 && turned_edges == 0; }
};
Topology topology(const Mesh& mesh);

}  // namespace itn
