// Many derivatives at once, each summed over an image with weights: the adjoint of derivative images. Neither its time
// nor its memory grows with their number (kernels/derivative/adjoint.h), but for those by the light: each evaluates it
// once more.
#pragma once
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "itn/renderer.h"

namespace itn {

struct WeighedDerivatives {
  // One for each of RenderOptions::derivatives. Standard errors are of as many degrees of freedom as there are pixels
  // that count, up to 256 (fewer in scenes of hundreds of numbers). Infinite without contrasts.
  std::vector<double> value, stderr_;
  // For parameters that are textures or grids (Parameter::has_values) value and stderr_ are the derivative by a common
  // addition to all texels and channels. Here is the derivative by every texel or voxel, of the same size and channels
  // and in the same order: by the linear value that shaders see. Empty for numbers. A texel of 0 has none by what is a
  // factor (kernels/model); a voxel of 0 has one.
  std::vector<VoxelGrid> values;
  double render_s = 0;
};

// Other weights of the same values, with which every pixel's sum has mean 0 and a known share of the gradient's noise:
// pixels being independent, the spread of such sums over sets of pixels tells the gradient's variance, and nothing is
// held for single pixels, however many parameters there are.
struct GradientContrast {
  std::vector<std::vector<double>> weights;  // [group][pixel and channel]; of a group, empty: all are 0
  double factor = 0;  // the variance is the sum over contrasts of factor times the sum's square, summed over sets
};

struct GradientWeights {
  GradientWeights(std::vector<std::vector<double>> of_values) : values(std::move(of_values)) {}

  std::vector<std::vector<double>> values;  // [group][pixel and channel, as Image::mean]
  std::vector<GradientContrast> contrasts;  // for the standard error; none: it is not asked for
};

// From groups of samples (their renderings, without derivatives) what each value of each group's image is weighed with.
using GroupWeights = std::function<GradientWeights(const std::vector<Rendering>& groups)>;

class GradientRenderer {
 public:
  // Options as for Renderer. The device and the scene's textures must outlive it.
  // Throws as Renderer.
  GradientRenderer(const Device& device, const Scene& scene, const RenderOptions& options);
  ~GradientRenderer();

  // The same scene with other texels or numbers. Where these need another program, it is built.
  void replace(const Scene& scene);
  // As Renderer's.
  void reseed(std::uint64_t seed);

  // Sum over groups, pixels and channels of weight times derivative image, the same up to rounding as with the
  // derivative images of the same samples. Group g: the samples of every pixel after those of group g - 1, from
  // first_sample on, as many as samples_of_groups[g]. The same bits however the paths are scheduled. Throws
  // Interrupted; ResultError: numbers that are not finite or beyond what the sums can hold, derivatives by the light of
  // an image that is black or has no weight.
  WeighedDerivatives render(int first_sample, const std::vector<int>& samples_of_groups, const GroupWeights& weights);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace itn
