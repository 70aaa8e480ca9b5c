// Analysis by synthesis where the texels of bitmaps or the voxels of grids are unknown: Adam (adam_step.h) on the mean
// squared difference from the targets, as for a few numbers (inversion.h), with the gradient by path replay. Texels are
// the unknowns themselves, kept in their range; those that no path sees stay as they are, unless neighbours are asked
// to be alike.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "runtime/gradient_renderer.h"
#include "runtime/inversion/adam_step.h"
#include "runtime/inversion/image_loss.h"
#include "runtime/scene/parameters.h"

namespace itn {

struct TextureInversionOptions {
  int iterations = 200, spp = 16;  // spp: of every iteration
  double learning_rate = 0.05;     // how far a texel moves in an iteration at first, about
  double smoothness = 0;  // weight of the mean squared difference of neighbours, which is added to the image loss
  bool exposure = false;  // each target is known up to a factor only
};

struct TextureInversionState {
  int iteration = 0;      // the next one
  std::vector<double> x;  // the texels or voxels: parameter after parameter, as VoxelGrid::data
  AdamMoments moments;
};

struct TextureInversionStep {
  int iteration = 0;
  double loss = 0, loss_stderr = 0;  // of the images, before the step
  double roughness = 0;              // mean squared difference of neighbouring texels, added up over textures
};

class TextureInversion {
 public:
  // parameters: Parameter::has_values. sensors: one a target. device and targets must outlive this. Throws UsageError:
  // a parameter that is neither bitmap nor grid; and as GradientRenderer.
  TextureInversion(const Device& device, const Scene& scene, const std::vector<std::string>& parameters,
                   const std::vector<int>& sensors, const std::vector<TargetImage>& targets,
                   const RenderOptions& render_options, const TextureInversionOptions& options);

  // From the scene's own textures.
  TextureInversionState start() const;
  TextureInversionStep advance(TextureInversionState& state);

  const std::vector<Parameter>& parameters() const { return parameters_; }
  std::vector<VoxelGrid> textures(const TextureInversionState& state) const;  // one a parameter
  // What the sensors see of them, times the exposure, with samples that no iteration took; and the loss.
  std::vector<Rendering> render(const TextureInversionState& state, int spp, LossGradient* loss) const;

 private:
  Scene scene_with(const TextureInversionState& state) const;

  const Device& device_;
  Scene scene_;
  std::vector<Parameter> parameters_;
  std::vector<int> sensors_;
  const std::vector<TargetImage>& targets_;
  RenderOptions render_options_;
  TextureInversionOptions options_;
  std::vector<std::unique_ptr<GradientRenderer>> renderers_;  // one a target
};

// Mean squared difference of texels or voxels beside each other; adds `weight` times its gradient.
double roughness_of(const VoxelGrid& values, double weight, double* gradient);

}  // namespace itn
