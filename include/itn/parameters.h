// The numbers of a scene that an image depends on smoothly, by name.
#pragma once
#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "itn/scene.h"

namespace itn {

// Kind of object that a parameter belongs to.
enum class Owner { medium, phase, bsdf, texture, light, environment };

struct Parameter {
  std::string name;  // <id>.<parameter>, with .R .G .B where the components differ or were given as <rgb>
  double value = 0;
  double low = 0, high = 0;  // the valid range; may be infinite
  bool low_included = true, high_included = true;
  std::string unit;  // empty: a pure number
  // Empty: the renderer can differentiate by it; else why not and, where there is one, the remedy.
  std::string not_differentiable;
  Owner owner = Owner::medium;
  std::string member;  // its name without the owner's id and without .R .G .B: "sigma_t"
  std::string id;      // of what it belongs to; Owner::texture: of the texture, and member is one of its colours
  // Indices of the media (phase functions: theirs), BSDFs (textures: those that have them) or lights in the scene,
  // several where they share it. Meaningless for the environment.
  std::vector<int> indices{0};
  int component = -1;  // of a colour; -1: all
  // Its value is a texture of texels (texels_of), and the renderer can differentiate by them (GradientRenderer);
  // not_differentiable says why not as by a number.
  bool by_texels = false;
  bool by_voxels = false;  // the same of a grid and its voxels
  bool has_values() const { return by_texels || by_voxels; }

  bool belongs_to(int index) const { return std::find(indices.begin(), indices.end(), index) != indices.end(); }
  bool is(Owner of, const std::string& its_member) const { return owner == of && member == its_member; }
  bool contains(double v) const {
    return (low_included ? v >= low : v > low) && (high_included ? v <= high : v < high);
  }
  std::string range() const;  // "[0, 1]", "(-1, 1)", "[0, inf)"
};

// True for a parameter of a light or the environment, which media and surfaces do not depend on.
bool is_of_light(const Parameter& parameter);

// The listed parameter of that name. Throws UsageError: not there (names those that are).
Parameter find_parameter(const std::vector<Parameter>& parameters, const std::string& name);

// Texts that begin with a name, up to their end or a "=": that of a colour whose components are parameters of their own
// ("skin.albedo=0.9") becomes one for each ("skin.albedo.R=0.9", ...); all others stay as they are.
std::vector<std::string> by_component(const std::vector<Parameter>& parameters, const std::vector<std::string>& texts);

// Gives the parameter another value: a colour without a component gets it in all three. The scene is the one that was
// listed, or a copy. Throws UsageError: outside of the range (names it), or a texture.
void set_parameter(Scene& scene, const Parameter& parameter, double value);

// The texels of a parameter that is by_texels, of one channel or three: those of its bitmap, or in one row the values
// that its attribute has on the scene's meshes (attribute_meshes), times the texture's factor.
Bitmap texels_of(const Scene& scene, const Parameter& parameter);

// Puts others in their place, as many and of the same channels. Other textures of the same bitmap or attribute stay as
// they are.
void set_texels(Scene& scene, const Parameter& parameter, const Bitmap& texels);

// Are its texels places of a picture, with neighbours?
bool is_picture(const Scene& scene, const Parameter& parameter);

// The meshes whose attribute these BSDFs use, each once, in the order of the shapes.
std::vector<const Mesh*> attribute_meshes(const Scene& scene, const std::vector<int>& bsdfs,
                                          const std::string& attribute);

// As of textures: the grid of a parameter that is by_voxels.
const std::shared_ptr<const VoxelGrid>& grid_of(const Scene& scene, const Parameter& parameter);
void set_grid(Scene& scene, const Parameter& parameter, const std::shared_ptr<const VoxelGrid>& grid);

// The same for either kind: a texture is a grid of depth 1.
VoxelGrid values_of(const Scene& scene, const Parameter& parameter);
void set_values(Scene& scene, const Parameter& parameter, VoxelGrid values);

// Media, phase functions, BSDFs with their textures, lights, then the environment, in the order of the scene.
std::vector<Parameter> list_parameters(const Scene& scene);

}  // namespace itn
