// The scenes of the bench, made on the spot: meshes of some 65,000 triangles, textures, and Mitsuba XML around them.
#pragma once
#include <string>
#include <vector>

namespace itn {

struct BenchScene {
  std::string name;   // "knot constant 25 .6 .5": what the table calls it
  std::string group;  // rows of a group share a geometric mean
  std::string file;
  std::string texture{};  // the parameter whose texels or voxels the derivatives are by; empty: by a medium
};

// Each writes scenes and what they refer to into an existing folder. Throws ResultError.
std::vector<BenchScene> write_media_scenes(const std::string& folder);
std::vector<BenchScene> write_surface_scenes(const std::string& folder);
std::vector<BenchScene> write_volume_scenes(const std::string& folder);

}  // namespace itn
