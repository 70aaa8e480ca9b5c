// Triangle meshes from files, and to PLY files.
#pragma once
#include <string>

#include "runtime/scene/mesh/placed_mesh.h"

namespace itn {

// Reads the file's mesh in its own coordinates, from an origin there: polygons become fans of triangles, all groups one
// mesh. PLY vertices are the file's, in its order; OBJ corners that share all their indices become one vertex. Normals
// only where every vertex has one. The ending of the name tells the format: .ply, .obj and .serialized (its first mesh)
// are read here, some others by Assimp. Throws InputError naming the file and the place in it when it cannot be read,
// is truncated, holds no triangle, an index out of range or a number that is not finite.
PlacedMesh read_mesh(const std::string& file);

// Mesh number `index` of a file in Mitsuba's .serialized format; checked as by read_mesh().
PlacedMesh read_serialized(const std::string& file, long index);

// Checks of any mesh what read_mesh() promises. Throws InputError.
void check_mesh(const Mesh& mesh, const std::string& file);

// Readers of one format each; they do not check for numbers that are not finite, nor for empty meshes.
PlacedMesh read_ply(const std::string& file);
PlacedMesh read_obj(const std::string& file);
// extension: in small letters, with its dot; InputError for one that is not in the list of those that are read.
PlacedMesh read_with_assimp(const std::string& file, const std::string& extension);

// Binary little-endian PLY with the mesh's normals and texture coordinates where it has them; read_ply() gives the same
// numbers back. Written whole or not at all: ResultError otherwise.
void write_ply(const std::string& file, const Mesh& mesh);

}  // namespace itn
