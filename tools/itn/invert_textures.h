// itn invert where what is asked for are textures or grids, texel by texel and voxel by voxel.
#pragma once
#include <string>
#include <vector>

#include "runtime/base/stored_run.h"
#include "runtime/inverse/textures/texture_inversion.h"
#include "tools/itn/target_options.h"

namespace itn::tools {

struct TextureQuestion {
  const CommonOptions& common;
  std::string scene, folder;
  std::vector<std::string> parameters;
  const TargetOptions& images;
  TextureInversionOptions inversion;
};

// Is one of the names that of a bitmap or a grid?
bool names_texture(const std::vector<Parameter>& all, const std::vector<std::string>& names);

// Runs the inversion to its end and leaves in the folder: of each texture PARAMETER.exr and .png, of a grid .vol, and
// with repetitions PARAMETER.uncertainty.exr and .png, or .vol, rerender.exr and .png, target.png, residual.png,
// result.json, and what it goes on from. request: everything that its numbers depend on.
void invert_textures(const TextureQuestion& question, const Scene& scene, const std::vector<TargetImage>& targets,
                     const Device& device, const RenderOptions& render_options, const StoredRun::Json& request);

}  // namespace itn::tools
