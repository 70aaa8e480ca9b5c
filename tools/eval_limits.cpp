// What images can tell at most, for `itn eval`.
#include <numeric>
#include <span>

#include "tools/eval.h"
#include "tools/evaluation/rerender.h"
#include "tools/progress.h"

namespace itn::tools {
namespace {

// Noise of the derivatives can hide whole directions: an image is rendered until two halves of its samples agree, at
// most this often.
constexpr int spp = 512, groups = 16, most_rounds = 8;

struct Halves {
  FisherInformation even, odd;

  void add(std::span<const Rendering> group) {
    for (std::size_t g = 0; g < group.size(); g += 2) {
      even.add(group[g]);
      odd.add(group[g + 1]);
    }
  }
  FisherInformation both() const {
    FisherInformation all = even;
    all.add(odd);
    return all;
  }
};

}  // namespace

std::vector<Bound> find_bounds(const EvalOptions& options, RenderedLoss& renderer, const Evaluation& e,
                               const std::vector<const Manifest::Image*>& records) {
  const Eigen::Vector3d prior(e.prior[0], e.prior[1], e.prior[2]);
  const auto bound = [&](const FisherInformation& information) {
    return cramer_rao(information.of_image(e.set.spp), prior);
  };
  std::vector<Halves> halves(records.size());
  std::vector<Bound> bounds(records.size());
  std::vector<std::size_t> open(records.size());
  std::iota(open.begin(), open.end(), std::size_t{0});
  Progress progress("information limit", static_cast<double>(records.size()), "images", !options.common.quiet);
  for (std::size_t round = 0; round < most_rounds && !open.empty(); ++round) {
    std::vector<RerenderedImage> images;
    for (const std::size_t i : open) {
      const Manifest::Image& image = *records[i];
      images.push_back({&image,
                        {image.sigma_t, image.albedo, image.g},
                        image_seed(options.common.seed, EvaluationStream::information, round * records.size() + i),
                        nullptr});
    }
    std::vector<std::size_t> still_open;
    in_batches(images.size(), images_a_batch(e.set.size, spp), [&](std::size_t first, std::size_t end) {
      const auto begin = images.begin();
      const std::vector<Rendering> renderings = renderer.render_derivatives(
          {begin + static_cast<std::ptrdiff_t>(first), begin + static_cast<std::ptrdiff_t>(end)}, groups, spp);
      for (std::size_t k = first; k < end; ++k) {
        Halves& half = halves[open[k]];
        half.add(std::span(renderings).subspan((k - first) * groups, groups));
        bounds[open[k]] = bound(half.both());
        if (agree(bound(half.even), bound(half.odd)))
          half = {};  // megabytes
        else
          still_open.push_back(open[k]);
      }
      const std::size_t settled = records.size() - open.size() + end - still_open.size();
      progress.update(static_cast<double>(settled) / static_cast<double>(records.size()));
    });
    open = still_open;
  }
  return bounds;
}

}  // namespace itn::tools
