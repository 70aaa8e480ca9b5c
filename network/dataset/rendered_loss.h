// A data set's images rendered again with other materials, many at once: images, image losses and their gradients.
#pragma once
#include <atomic>
#include <string>
#include <vector>

#include "network/dataset/dataset_scene.h"
#include "network/dataset/dataset_shapes.h"
#include "network/dataset/object_window.h"
#include "runtime/inverse/image_loss.h"

namespace itn {

// One of the set's images, and the material to render it with instead of its own.
struct RerenderedImage {
  const Manifest::Image* image = nullptr;
  DatasetMaterial material;
  std::uint64_t seed = 0;
  const std::vector<float>* target = nullptr;  // of losses: luminance of the whole image, row-major
  const ObjectWindow* window = nullptr;        // render this much only, count where the object is seen; null: all
};

class RenderedLoss {
 public:
  // set: a complete data set in `folder`; it, the device and cancel must outlive this. operator single: only what
  // scattered once.
  RenderedLoss(const Device& device, const Manifest& set, std::string folder, Operator op,
               const std::atomic<bool>* cancel);

  // The mean squared difference from each target (over the window's object), and its gradient by sigma_t [1/mm], albedo
  // and g, both unbiased, from the same paths; their standard errors are left out (infinite). spp: 2 to 16, or a
  // multiple of 16 (image_loss.h, split_samples). Throws UsageError: another spp; InputError: a mesh of the set;
  // Interrupted.
  std::vector<LossGradient> evaluate(const std::vector<RerenderedImage>& images, int spp);

  // The images, without derivatives.
  std::vector<Rendering> render(const std::vector<RerenderedImage>& images, int spp);

  // Image after image, of each `groups` renderings of other samples, spp in all, with derivatives by sigma_t [1/mm],
  // albedo and g. spp: a multiple of groups.
  std::vector<Rendering> render_derivatives(const std::vector<RerenderedImage>& images, int groups, int spp);

 private:
  std::vector<Rendering> render(ShapeRenderer& with, const std::vector<RerenderedImage>& images, int groups, int spp);

  const Manifest& set_;
  DatasetLights lights_;
  DatasetShapes shapes_;
  ShapeRenderer values_, derivatives_;
};

}  // namespace itn
