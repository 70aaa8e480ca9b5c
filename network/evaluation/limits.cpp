// Bounds on what images can tell.
#include <numeric>
#include <span>

#include "network/evaluation/evaluate.h"
#include "network/evaluation/rerender.h"

namespace itn {
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

std::vector<Bound> find_bounds(const EvaluationOptions& options, RenderedLoss& renderer, const Evaluation& e,
                               const std::vector<const Manifest::Image*>& records, const Fraction& progress) {
  const Eigen::Vector3d prior(e.prior[0], e.prior[1], e.prior[2]);
  const auto bound = [&](const FisherInformation& information) {
    return cramer_rao(information.of_image(e.set.spp), prior);
  };
  std::vector<Halves> halves(records.size());
  std::vector<Bound> bounds(records.size());
  std::vector<std::size_t> open(records.size());
  std::iota(open.begin(), open.end(), std::size_t{0});
  for (std::size_t round = 0; round < most_rounds && !open.empty(); ++round) {
    std::vector<RerenderedImage> images;
    for (const std::size_t i : open) {
      const Manifest::Image& image = *records[i];
      images.push_back({&image,
                        {image.sigma_t, image.albedo, image.g},
                        image_seed(options.seed, EvaluationStream::information, round * records.size() + i),
                        nullptr});
    }
    std::vector<std::size_t> still_open;
    in_batches(images.size(), images_per_batch(e.set.size, spp), [&](std::size_t first, std::size_t end) {
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
      if (progress) progress(static_cast<double>(settled) / static_cast<double>(records.size()));
    });
    open = still_open;
  }
  return bounds;
}

}  // namespace

void bound_rerendered(const EvaluationOptions& options, RenderedLoss& renderer, Evaluation& e,
                      const Fraction& progress) {
  std::vector<const Manifest::Image*> records;
  for (const RerenderedResult& r : e.rerendered) records.push_back(&r.target.image);
  const std::vector<Bound> bounds = find_bounds(options, renderer, e, records, progress);
  for (std::size_t i = 0; i < bounds.size(); ++i) e.rerendered[i].bound = bounds[i];
}

void bound_syntheses(const EvaluationOptions& options, RenderedLoss& renderer, Evaluation& e,
                     const Fraction& progress) {
  std::vector<const Manifest::Image*> records;
  for (const SynthesisTarget& t : e.synthesis_targets) records.push_back(&t.image);
  e.synthesis_bounds = find_bounds(options, renderer, e, records, progress);
}

}  // namespace itn
