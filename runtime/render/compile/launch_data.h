// Scenes as the records of kernels/shared: what one launch of the wavefront can work on.
#pragma once
#include <array>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "itn/scene.h"
#include "kernels/shared/environment_layout.h"
#include "kernels/shared/light_layout.h"
#include "kernels/shared/scene_layout.h"
#include "runtime/render/compile/geometry.h"

namespace itn {

static_assert(sizeof(CameraRecord) == 228 && sizeof(MediumRecord) == 56 && sizeof(FieldRecord) == 168 &&
              sizeof(ShapeRecord) == 16 && sizeof(BsdfRecord) == 16 && sizeof(TextureRecord) == 56 &&
              sizeof(JobRecord) == 168 && sizeof(ChunkRecord) == 16);

// Indices at which the records of a scene begin; its job knows first_number.
struct SceneStart {
  int first_number = 0, first_medium = 0, first_bsdf = 0;
  std::vector<int> light_numbers;  // of each of its lights
};

struct LaunchData {
  std::vector<SceneStart> scenes;
  Geometry geometry;
  std::vector<CameraRecord> cameras;
  std::vector<ShapeRecord> shapes;
  std::vector<BsdfRecord> bsdfs;           // surface: as in compile/surfaces.h
  std::map<int, const Model*> structures;  // of these, by their numbers
  std::vector<MediumRecord> media;
  std::map<int, const Model*> phases;         // of these, by their numbers
  std::vector<FieldRecord> fields;            // of media
  std::vector<float> voxels;                  // and the coarse cells over them
  std::map<const VoxelGrid*, int> voxels_of;  // where those of a grid begin: fields may share it
  std::vector<float> numbers;                 // of all models: kernels/shared/declaration.h
  std::vector<int> number_textures;           // beside them
  std::set<std::pair<int, int>> textured;     // model and slot of those that are somewhere
  std::vector<EnvironmentRecord> environments;
  std::vector<LightRecord> lights;
  std::vector<float> light_tables;  // of both, and of surfaces on which sensors lie
  bool inner_lights = false;        // some may stand inside of a body that refracts, or behind a pane
  bool round_zone = false;          // some such surface is round
  bool hidden_lights = false;       // some shape that shines is not seen (hide_emitters)
  // Pictures are large, and scenes may share them: records by bitmap, values and to_world.
  std::map<std::tuple<const Bitmap*, std::vector<double>, std::array<double, 16>>, int> environment_of;
  std::vector<TextureRecord> textures;
  std::vector<float> texels;
  std::vector<std::pair<std::size_t, const Texture*>> attributes;  // of the scene that is being appended
  std::map<const Bitmap*, int> texels_of;                          // where those of a bitmap begin: scenes may share it
  std::vector<float> measured;                                     // tables of measured BSDFs
  std::map<const MeasuredBrdf*, int> measured_of;                  // and which is whose
  std::vector<int> pixels;                                         // of each camera's film
  int cells = 0;                                                   // of the tables of expected radiance
  bool coloured = false;        // some throughput or radiance differs between channels
  bool coloured_light = false;  // some radiance or derivative of it does
  bool spectral = false;        // some medium's sigma_t does
  bool coloured_field = false;  // some medium's sigma_t has a grid with three channels
};

// Appends a scene seen by one of its sensors; returns a job with everything but the pixels, samples and seed.
JobRecord append_scene(const Scene& scene, int sensor, LaunchData& data);

// The same where the scene's shapes are there already: those of data.geometry.records[geometry].
JobRecord append_scene(const Scene& scene, int sensor, int geometry, LaunchData& data);

// Forgets the scenes and keeps their geometries.
void clear_scenes(LaunchData& data);

// The definitions of a program that can work on the data: features that no scene uses are left out.
std::map<std::string, std::string> feature_definitions(const LaunchData& data);

}  // namespace itn
