// What images can tell at most, for `itn eval`.
#include "tools/eval.h"
#include "tools/evaluation/rerender.h"
#include "tools/progress.h"

namespace itn::tools {
namespace {

// Of the derivatives: few leave so much noise in the information that whole directions are lost in it.
constexpr int spp = 512, groups = 16;

}  // namespace

std::vector<Bound> find_bounds(const EvalOptions& options, RenderedLoss& renderer, const Evaluation& e,
                               const std::vector<const Manifest::Image*>& records) {
  std::vector<RerenderedImage> images;
  for (std::size_t i = 0; i < records.size(); ++i) {
    const Manifest::Image& image = *records[i];
    images.push_back({&image,
                      {image.sigma_t, image.albedo, image.g},
                      image_seed(options.common.seed, EvaluationStream::information, i),
                      nullptr});
  }
  const Eigen::Vector3d prior(e.prior[0], e.prior[1], e.prior[2]);
  std::vector<Bound> bounds;
  Progress progress("information limit", static_cast<double>(images.size()), "images", !options.common.quiet);
  in_batches(images.size(), images_a_batch(e.set.size, spp), [&](std::size_t first, std::size_t end) {
    const auto begin = images.begin();
    std::vector<Rendering> renderings = renderer.render_derivatives(
        {begin + static_cast<std::ptrdiff_t>(first), begin + static_cast<std::ptrdiff_t>(end)}, groups, spp);
    for (std::size_t i = first; i < end; ++i) {
      const auto from = std::make_move_iterator(renderings.begin() + static_cast<std::ptrdiff_t>(i - first) * groups);
      bounds.push_back(cramer_rao(fisher_information({from, from + groups}, e.set.spp), prior));
    }
    progress.update(static_cast<double>(end) / static_cast<double>(images.size()));
  });
  return bounds;
}

}  // namespace itn::tools
