// Scenes far from the origin: single precision, in which the device computes, knows places there only coarsely. So
// scenes are taken to where it tells their shapes best, and what is lost all the same is said.
#pragma once
#include <map>
#include <string>
#include <vector>

#include "itn/scene.h"

namespace itn {

// From which share of its size on places of a shape that are not known are said, and refused.
constexpr double loss_said_from = 1e-3, loss_refused_from = 0.25;

// Origins of meshes whose positions are relative to one of their own (mesh/placed_mesh.h).
using MeshOrigins = std::map<const Mesh*, Vec3>;

// Takes everything of the scene that has a place, meshes from their origins, to where the farthest shape is the least
// of its sizes away, if that is much nearer than it is; scenes about the origin stay as they are. Warns of what single
// precision does not tell; throws InputError where that is too much.
void move_to_middle(Scene& scene, const MeshOrigins& origins, std::vector<std::string>& warnings);

}  // namespace itn
