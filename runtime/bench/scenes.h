// The scenes of the bench, made on the spot: two meshes of some 65,000 triangles, a texture, and Mitsuba XML around
// them.
#pragma once
#include <string>
#include <vector>

namespace itn {

struct BenchScene {
  std::string name;   // "knot constant 25 .6 .5": what the table calls it
  std::string group;  // rows of a group share a geometric mean
  std::string file;
};

// Writes the scenes and what they refer to into an existing folder. Throws ResultError.
std::vector<BenchScene> write_bench_scenes(const std::string& folder);

}  // namespace itn
