#include "network/dataset/rendered_loss.h"

#include <fmt/format.h>

#include "itn/error.h"
#include "runtime/base/ranks.h"

namespace itn {
namespace {

constexpr std::size_t most_kept_bytes = std::size_t{8} << 30;  // of geometries in memory: training comes back to them

RenderOptions options_of(Operator op, const std::atomic<bool>* cancel, bool derivatives) {
  RenderOptions options;
  options.op = op;
  options.cancel = cancel;
  options.ranks = &world();
  if (derivatives) options.derivatives = {dataset_sigma_t, dataset_albedo, dataset_g};
  return options;
}

}  // namespace

RenderedLoss::RenderedLoss(const Device& device, const Manifest& set, std::string folder, Operator op,
                           const std::atomic<bool>* cancel)
    : set_(set),
      lights_(set, folder),
      shapes_(set, std::move(folder), most_kept_bytes),
      values_(device, options_of(op, cancel, false), shapes_),
      derivatives_(device, options_of(op, cancel, true), shapes_) {}

// Image after image, of each the groups of samples.
std::vector<Rendering> RenderedLoss::render(ShapeRenderer& with, const std::vector<RerenderedImage>& images, int groups,
                                            int spp) {
  std::vector<int> shapes;
  shapes.reserve(images.size());
  for (const RerenderedImage& i : images) shapes.push_back(i.image->shape);
  shapes_.make(shapes, with.renderer());
  std::vector<ShapeRenderer::Image> placed;
  placed.reserve(images.size());
  for (const RerenderedImage& i : images) {
    Scene scene =
        dataset_scene(set_, *i.image, shapes_.made(i.image->shape).mesh, lights_.of(i.image->light), i.material);
    if (i.window) {
      Sensor& sensor = scene.sensors.front();
      sensor.crop_x = i.window->left;
      sensor.crop_y = i.window->top;
      sensor.crop_width = i.window->width;
      sensor.crop_height = i.window->height;
    }
    placed.push_back({std::move(scene), i.image->shape, i.seed});
  }
  return with.render(placed, spp, groups);
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
    if (const ObjectWindow* window = images[i].window)
      target = {window->width, window->height, 1, cut(target.value, set_.size, *window), window->weight, {}};
    const auto from = std::make_move_iterator(renderings.begin() + static_cast<std::ptrdiff_t>(i) * groups);
    losses.push_back(loss_gradient(std::vector<Rendering>(from, from + groups), target, 1, false));
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
