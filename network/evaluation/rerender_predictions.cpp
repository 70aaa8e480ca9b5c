// Table 2: images rendered with the predictions.
#include <algorithm>

#include "itn/error.h"
#include "network/evaluation/evaluate.h"
#include "network/evaluation/rerender.h"
#include "network/evaluation/selection.h"

namespace itn {
namespace {

constexpr std::size_t picture_count = 6;

// An image of a split, and what the runs say about it.
struct Candidate {
  const SplitPredictions* split;
  std::size_t index;
};

// The images to render, those of the training last.
std::vector<RerenderedResult> chosen(const EvaluationOptions& options, const Evaluation& e,
                                     const std::atomic<bool>& cancel) {
  std::map<std::string, Candidate> candidates;  // by file
  std::vector<Manifest::Image> test;
  for (const SplitPredictions& split : e.splits)
    for (std::size_t i = 0; i < split.images.size(); ++i) {
      candidates[split.images[i].file] = {&split, i};
      if (split.split != Manifest::Split::train) test.push_back(split.images[i]);
    }
  const auto count = static_cast<std::size_t>(options.images);
  std::vector<Manifest::Image> images = choose(test, count, options.seed);
  for (const Manifest::Image& image :
       choose(e.splits.front().images, std::max<std::size_t>(1, count / 4), options.seed))
    images.push_back(image);
  std::vector<RerenderedResult> result;
  for (const Manifest::Image& image : images) {
    if (cancel) throw Interrupted();
    RerenderedResult r;
    r.target = {image, read_noisy_image(options.data, e.set, image)};
    r.training = image.split == Manifest::Split::train;
    const Candidate& candidate = candidates.at(image.file);
    for (const auto& run : candidate.split->predicted) r.predicted.push_back(run[candidate.index]);
    result.push_back(std::move(r));
  }
  return result;
}

// materials: of every image. The random numbers are the same for all who predict.
std::vector<RerenderedImage> images_with(const Evaluation& e, std::uint64_t seed,
                                         const std::function<DatasetMaterial(const RerenderedResult&)>& material) {
  std::vector<RerenderedImage> images;
  for (std::size_t i = 0; i < e.rerendered.size(); ++i)
    images.push_back({&e.rerendered[i].target.image, material(e.rerendered[i]),
                      image_seed(seed, EvaluationStream::rerendering, i), nullptr});
  return images;
}

DatasetMaterial truth_of(const RerenderedResult& r) {
  return {r.target.image.sigma_t, r.target.image.albedo, r.target.image.g};
}

}  // namespace

void choose_rerendered(const EvaluationOptions& options, Evaluation& e, const std::atomic<bool>& cancel) {
  e.rerendered = chosen(options, e, cancel);
}

void rerender_predictions(const EvaluationOptions& options, RenderedLoss& renderer, Evaluation& e,
                          const Fraction& progress) {
  const std::size_t count = e.rerendered.size(), all = count * (e.runs.size() + 1);
  for (std::size_t run = 0; run <= e.runs.size(); ++run) {
    const bool truth = run == e.runs.size();
    const std::vector<Rendering> renderings = rerender(
        renderer,
        images_with(e, options.seed, [&](const RerenderedResult& r) { return truth ? truth_of(r) : r.predicted[run]; }),
        e.set.size, e.spp, [&](std::size_t done) {
          if (progress) progress(static_cast<double>(run * count + done) / static_cast<double>(all));
        });
    for (std::size_t i = 0; i < count; ++i) {
      RerenderedResult& r = e.rerendered[i];
      const Difference d = difference(renderings[i], r.target.input);
      if (truth) {
        r.truth = d;
        continue;
      }
      r.difference.push_back(d);
      // Test images come first: some of them, evenly.
      const std::size_t step = std::max<std::size_t>(1, static_cast<std::size_t>(options.images) / picture_count);
      if (!r.training && i % step == 0 && i / step < picture_count) r.image.push_back(renderings[i].mean);
    }
  }
}

}  // namespace itn
