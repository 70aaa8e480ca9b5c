#include "runtime/dataset/rendered_loss.h"

#include <fmt/format.h>

#include "runtime/dataset/dataset_mesh.h"
#include "runtime/error.h"

namespace itn {
namespace {

constexpr std::size_t most_kept_geometries = 64;  // sets of a few shapes keep them all on the device

RenderOptions options_of(Operator op, const std::atomic<bool>* cancel, bool derivatives) {
  RenderOptions options;
  options.op = op;
  options.cancel = cancel;
  if (derivatives) options.derivatives = {dataset_sigma_t, dataset_albedo, dataset_g};
  return options;
}

}  // namespace

RenderedLoss::RenderedLoss(const Device& device, const Manifest& set, std::string folder, Operator op,
                           const std::atomic<bool>* cancel)
    : set_(set),
      folder_(std::move(folder)),
      lights_(set, folder_),
      values_(device, options_of(op, cancel, false)),
      derivatives_(device, options_of(op, cancel, true)) {}

// Image after image, of each the groups of samples.
std::vector<Rendering> RenderedLoss::render(Placed& placed, const std::vector<RerenderedImage>& images, int groups,
                                            int spp) {
  if (set_.shapes.size() > most_kept_geometries) {
    placed.renderer.forget_geometries();
    placed.geometries.clear();
  }
  std::vector<Scene> scenes;
  for (const RerenderedImage& i : images) {
    const int shape = i.image->shape;
    if (!meshes_.count(shape)) meshes_[shape] = dataset_mesh(set_.shapes[static_cast<std::size_t>(shape)], folder_);
    scenes.push_back(dataset_scene(set_, meshes_[shape], lights_.of(i.image->light), i.material));
    if (!placed.geometries.count(shape)) placed.geometries[shape] = placed.renderer.add_geometry(scenes.back());
  }
  std::vector<BatchImage> batch;
  for (std::size_t i = 0; i < images.size(); ++i)
    batch.push_back({&scenes[i], placed.geometries[images[i].image->shape], images[i].seed, 0});
  return placed.renderer.render(batch, spp, groups);
}

std::vector<LossGradient> RenderedLoss::evaluate(const std::vector<RerenderedImage>& images, int spp) {
  const std::vector<int> samples = split_samples(spp);
  const int groups = static_cast<int>(samples.size());
  if (spp < 2 || samples.front() != samples.back())
    throw UsageError(
        fmt::format("{} samples a pixel: an unbiased loss compares groups of them; need 2 to {}, or a "
                    "multiple of {}",
                    spp, groups, groups));
  std::vector<Rendering> renderings = render_derivatives(images, groups, spp);
  std::vector<LossGradient> losses;
  for (std::size_t i = 0; i < images.size(); ++i) {
    TargetImage target{set_.size, set_.size, 1, *images[i].target, {}, {}};
    target.weight.assign(target.value.size(), 1.0F);
    const auto from = std::make_move_iterator(renderings.begin() + static_cast<std::ptrdiff_t>(i) * groups);
    losses.push_back(loss_gradient(std::vector<Rendering>(from, from + groups), target));
  }
  return losses;
}

std::vector<Rendering> RenderedLoss::render(const std::vector<RerenderedImage>& images, int spp) {
  return render(values_, images, 1, spp);
}

std::vector<Rendering> RenderedLoss::render_derivatives(const std::vector<RerenderedImage>& images, int groups,
                                                        int spp) {
  std::vector<Rendering> renderings = render(derivatives_, images, groups, spp);
  const auto per_mm = static_cast<float>(set_.mm_per_unit);
  for (Rendering& rendering : renderings) {
    for (float& value : rendering.derivatives[0].mean) value *= per_mm;
    for (float& error : rendering.derivatives[0].stderr_) error *= per_mm;
  }
  return renderings;
}

}  // namespace itn
