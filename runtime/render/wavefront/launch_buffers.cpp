#include "runtime/render/wavefront/launch_buffers.h"

#include <algorithm>

#include "kernels/model/models.h"
#include "runtime/render/compile/surfaces.h"

namespace itn {

void LaunchBuffers::upload_geometry(const Device& device, const Geometry& geometry) {
  nodes = leaves = primitives = grid = geometries = {};
  nodes = device.upload(geometry.nodes, "hierarchy nodes");
  leaves = device.upload(geometry.leaves, "hierarchy leaves");
  primitives = device.upload(geometry.primitives, "primitives");
  grid = device.upload(geometry.grid, "flight grid");
  geometries = device.upload(geometry.records, "geometry records");
  texture_axes = device.upload(geometry.texture_axes, "texture axes");
}

void LaunchBuffers::upload_scenes(const Device& device, const LaunchData& data) {
  // Stages may read a whole model's numbers wherever one begins, and which textures stand for them.
  std::vector<float> padded = data.numbers;
  std::vector<int> padded_textures = data.number_textures;
  std::size_t most = MOST_SLOTS;
  for (const Model* model : made_models(data)) most = std::max(most, static_cast<std::size_t>(model->number_slots));
  padded.resize(padded.size() + most);
  padded_textures.resize(padded.size(), -1);
  cameras = device.upload(data.cameras, "cameras");
  shapes = device.upload(data.shapes, "shapes");
  bsdfs = device.upload(numbered_bsdfs(data), "BSDFs");
  media = device.upload(data.media, "media");
  fields = device.upload(data.fields, "fields");
  voxels = device.upload(data.voxels, "voxels");
  numbers = device.upload(padded, "numbers");
  number_textures = device.upload(padded_textures, "textures of numbers");
  environments = device.upload(data.environments, "environments");
  lights = device.upload(data.lights, "lights");
  light_tables = device.upload(data.light_tables, "light tables");
  textures = device.upload(data.textures, "textures");
  texels = device.upload(data.texels, "texels");
  measured = device.upload(data.measured, "measured tables");
}

}  // namespace itn
