// Analysis by synthesis where the texels of textures or the voxels of grids are unknown, and numbers beside them: Adam
// (adam_step.h) on the mean squared difference from the targets, as for a few numbers (inversion.h), with the gradient
// by path replay. Texels are the unknowns themselves, kept in their range; numbers have coordinates (coordinate.h).
// What no path sees stays as it is, unless neighbours are asked to be alike.
//
// How well they are known: as many iterations as the last quarter, with its step sizes, begin anew at what was found,
// with other samples, for targets to which noise of the same size was added once more (a parametric bootstrap). By what
// these repetitions differ from what was found, the latter differs from the truth, as far as the scene is right and the
// iterations were enough.
#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "itn/gradient_renderer.h"
#include "itn/parameters.h"
#include "runtime/inverse/adam_step.h"
#include "runtime/inverse/coordinate.h"
#include "runtime/inverse/image_loss.h"
#include "runtime/inverse/misfit.h"

namespace itn {

struct TextureInversionOptions {
  int iterations = 200, spp = 16;  // spp: of every iteration
  double learning_rate = 0.05;     // how far a texel, or a number's coordinate, moves in an iteration at first, about
  double smoothness = 0;      // weight of the mean squared difference of neighbours, which is added to the image loss
  bool exposure = false;      // each target is known up to a factor only
  int repeats = 0;            // repetitions that tell the uncertainty
  double relative_noise = 0;  // of the targets, over their radiance, beside their standard errors
  bool noise_known = true;    // TargetNoise::known
};

struct TextureInversionState {
  int iteration = 0;      // the next one
  std::vector<double> x;  // the unknowns, parameter after parameter; texels and voxels as VoxelGrid::data
  AdamMoments moments;
  int repeat = 0;                      // 0: the inversion itself
  std::vector<double> found, squares;  // what it found, and the sum over repetitions of the squared differences
  bool finished = false;               // x is what was found again
};

struct TextureInversionStep {
  int repeat = 0, iteration = 0;
  double loss = 0, loss_stderr = 0;  // of the images, before the step
  double roughness = 0;              // mean squared difference of neighbouring texels, added up over textures
};

// The images that the sensors see of what was found, times the exposure, with samples that no iteration took.
struct TextureImages {
  std::vector<Rendering> images;
  LossGradient loss;
  ImageComparison comparison;

  bool fit() const { return comparison.fit.fits(); }
};

class TextureInversion {
 public:
  // sensors: one a target. device and targets must outlive this. Throws UsageError: neighbours of what has none are to
  // be alike; and as GradientRenderer.
  TextureInversion(const Device& device, const Scene& scene, const std::vector<std::string>& parameters,
                   const std::vector<int>& sensors, const std::vector<TargetImage>& targets,
                   const RenderOptions& render_options, const TextureInversionOptions& options);

  // From the scene's own values.
  TextureInversionState start() const;
  // One iteration; not of a state that is finished.
  TextureInversionStep advance(TextureInversionState& state);
  int steps() const { return options_.iterations + options_.repeats * iterations_of_repeat(); }

  std::vector<Parameter> parameters() const;
  // Values of a parameter that is a texture or a grid, and their standard errors, infinite where no path has seen them.
  VoxelGrid values(const TextureInversionState& state, std::size_t parameter) const;
  VoxelGrid uncertainty(const TextureInversionState& state, std::size_t parameter) const;
  // Value of a parameter that is a number, moved by so many standard errors.
  double number(const TextureInversionState& state, std::size_t parameter, double standard_errors = 0) const;

  TextureImages render(const TextureInversionState& state) const;

 private:
  struct Unknown {
    Parameter parameter;
    std::optional<Coordinate> coordinate;  // of a number
    VoxelGrid start;                       // of a texture or a grid
    std::size_t first, count;              // in x
  };

  int iterations_of_repeat() const;
  int first_sample(int repeat, int iteration) const;
  Scene scene_with(const std::vector<double>& x) const;
  VoxelGrid values_of_unknown(const Unknown& unknown, const std::vector<double>& values) const;
  std::vector<double> gradient(const TextureInversionState& state, LossGradient* loss);
  double add_roughness(const std::vector<double>& x, std::vector<double>& gradient) const;
  const std::vector<TargetImage>& targets_of(int repeat);
  void end_repeat(TextureInversionState& state) const;

  const Device& device_;
  Scene scene_;
  std::vector<Unknown> unknowns_;
  std::vector<int> sensors_;
  const std::vector<TargetImage>& targets_;
  std::vector<TargetImage> noisy_;  // of the repetition below
  int noisy_repeat_ = 0;
  RenderOptions render_options_;
  TextureInversionOptions options_;
  std::vector<std::unique_ptr<GradientRenderer>> renderers_;  // one a target
};

// The sentence says for people whether the images fit.
std::string words(const TextureImages& seen);

// Mean squared difference of texels or voxels beside each other, where it goes all around of the last and the first
// column, too; adds `weight` times its gradient.
double roughness_of(const VoxelGrid& values, bool all_around, double weight, double* gradient);

}  // namespace itn
