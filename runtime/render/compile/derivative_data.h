// Parameters by which an image is differentiated, as the records and the code that the device needs for it.
#pragma once
#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "itn/scene.h"
#include "kernels/shared/scene_layout.h"
#include "runtime/render/compile/launch_data.h"
#include "runtime/render/derivative/score_functions.h"

namespace itn {

static_assert(sizeof(ScoreRecord) == 20 && sizeof(SumRecord) == 24 && sizeof(DerivativeRecord) == 32);

// The number by which a part differentiates: n[slot] of the model whose numbers begin at `first` of the scene's.
struct NumberOfPart {
  const Model* model = nullptr;
  int first = 0, slot = 0;
  bool colour = false;   // n[slot + c] in channel c
  int origin = 0;        // as of ScoreRecord
  int texels = -1;       // as of SumRecord
  int field = -1;        // without a model: all voxels of a field alike (FieldRecord::sum)
  bool heights = false;  // by which texels are, and of which the same everywhere changes nothing
  int components = 1;    // n[slot + k] in all channels: of a direction three, of the slopes of heights two
  // Index of n[slot + c], counted from n.
  int place(int c) const { return model->place_of_colour(slot + c, origin); }
};

// Is it by a light or the environment, rather than by what a path's throughput depends on?
inline bool is_of_light(const DerivativeRecord& derivative) {
  return derivative.environment >= 0 || derivative.light >= 0;
}

// A texture by whose texels the derivative is, or a grid by whose voxels it is.
struct DifferentiatedTexture {
  int image = 0;                    // which derivative it is
  int first_texel = 0;              // of the sums by texels (TextureRecord::gradient, FieldRecord::gradient)
  VoxelGrid shape;                  // of the result, without values; of a texture with depth 1
  const Bitmap* bitmap = nullptr;   // one of the two,
  const VoxelGrid* grid = nullptr;  // or an attribute of meshes:
  bool has_probes = false;          // a grid whose voxels scatterings do not tell all of (kernels/scattering/probe.h)
  std::vector<int> corners{};       // of each corner of a triangle which value it is, -1: none; the sums are by corners
  void set_shape(const VoxelGrid& values) {
    shape.width = values.width;
    shape.height = values.height;
    shape.depth = values.depth;
    shape.channels = values.channels;
    shape.low = values.low;
    shape.high = values.high;
  }
  std::size_t values() const {
    return static_cast<std::size_t>(shape.width) * static_cast<std::size_t>(shape.height) *
           static_cast<std::size_t>(shape.depth);
  }
  std::size_t texels() const { return bitmap || grid ? values() : corners.size(); }
};

struct DerivativeData {
  std::vector<ScoreRecord> scores;            // what a path carries
  std::vector<PartRecord> parts;              // of the derivatives, which are in the order of the names
  std::vector<DerivativeRecord> derivatives;  // one a part
  std::vector<NumberOfPart> numbers;          // one a part; by the light: without a model
  std::vector<DifferentiatedTexture> textures;
  // By texels that are normals or heights; by those that tint lights; by those of the light around the scene.
  bool by_directions = false, by_pictures = false, by_environment = false;
  std::size_t texels() const {  // of all of them
    return textures.empty() ? 0 : static_cast<std::size_t>(textures.back().first_texel) + textures.back().texels();
  }
  int grids() const {
    return static_cast<int>(
        std::count_if(textures.begin(), textures.end(), [](const DifferentiatedTexture& t) { return t.grid; }));
  }
  bool has_probes() const {
    return std::any_of(textures.begin(), textures.end(), [](const DifferentiatedTexture& t) { return t.has_probes; });
  }
  int images() const { return parts.empty() ? 0 : parts.back().image + 1; }
  ScoreRequest functions;  // the derivatives of the models that it takes
  // Number of other albedos of the medium (kernels/derivative/score.h), and each channel's score for them.
  int albedos = 0;
  std::array<int, 3> albedo_score{};
};

// names: as list_parameters gives them; job: of the scene, which `launch` has; the derivatives of its light
// are appended there. with_textures: by_texels (scene/parameters.h) parameters are taken; their parts are by all texels
// alike, and the launch's textures know where their sums begin. albedos: how many other ones of the first medium.
// Throws UsageError: a name that is unknown, not differentiable (says why), or there twice; InputError: more texels
// than there can be.
DerivativeData derivative_data(const Scene& scene, const std::vector<std::string>& names, const JobRecord& job,
                               LaunchData& launch, bool with_textures = false, int albedos = 0);

// The exponents, three an albedo, that make of the scene's albedo each of `others` (kernels/derivative/score.h). Throws
// UsageError: not one medium, or one whose albedo is 0 or differs from place to place.
std::vector<float> albedo_exponents(const Scene& scene, const std::vector<Rgb>& others);

}  // namespace itn
