// Mends meshes that are nearly closed surfaces, so that media can fill them.
#pragma once
#include <string>

#include "runtime/scene/mesh/mesh_topology.h"

namespace itn {

struct Closing {
  Topology left;               // what is wrong after all steps, if anything; triangles as numbered in the given mesh
  std::size_t welded = 0;      // vertices moved onto others
  std::size_t duplicates = 0;  // triangles dropped since others cover them, or cancel them
  std::size_t wall_triangles = 0;             // dropped: of walls inside
  std::size_t holes = 0, hole_triangles = 0;  // closed, and added for it
  bool changes_mesh() const { return welded + duplicates + wall_triangles + holes > 0; }
  // "closed 2 holes with 13 triangles, welded 5 vertices"
  std::string summary() const;
};

// Vertices on open edges are welded when they lie nearer than this part of the mesh's longest side.
constexpr double weld_distance = 1e-4;
// A hole is closed, and a wall taken out, up to this part of the mesh's area.
constexpr double small_area = 0.05;

// Repairs meshes whose edges are not in order (Topology), in these steps:
// - triangles that occur twice are dropped once; twice with opposite windings, both;
// - seams: vertices on open edges that nearly coincide become one place;
// - walls inside: connected parts whose edges are only superfluous where they meet others are taken out;
// - small holes get triangles between the vertices around them.
// The mesh changes only when the result is closed. The volume's sign does not count.
Closing close_mesh(Mesh& mesh);

}  // namespace itn
