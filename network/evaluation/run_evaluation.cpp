#include "network/evaluation/run_evaluation.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "itn/error.h"
#include "network/evaluation/stored_synthesis.h"

namespace itn {
namespace {

// Tables 2 and 3 differentiate by the true materials.
void require_derivatives(const EvaluationOptions& options, const Manifest& set) {
  for (const Manifest::Image& image : set.images)
    for (const auto& [name, value] : {std::pair{"sigma_t", image.sigma_t}, {"albedo", image.albedo}})
      if (!(value > 0))
        throw InputError(
            fmt::format("{}: image {}: {} is {}, where images have no derivative by it that the information limit and "
                        "the inversions need; render the set with values above 0, or leave tables 2 and 3 out with "
                        "images 0 and inversions 0",
                        manifest_file(options.data), image.file, name, value));
}

// Calls run(progress) between its begin and its end.
template <class Run>
void part(const EvaluationProgress& progress, const std::string& label, std::size_t images, const Run& run) {
  progress.begin(label, static_cast<double>(images), "images", 0, false);
  run(progress.update);
  progress.end();
}

// Every start's inversions; what there is of one is stored when it is interrupted.
void synthesise(const EvaluationOptions& how, const Device& device, RenderedLoss& renderer,
                const std::vector<std::string>& starts, const EvaluationProgress& progress, Evaluation& e) {
  for (const std::string& start : starts) {
    StoredSynthesis synthesis(how, device, renderer, e, start);
    progress.begin("inversions from " + start, static_cast<double>(e.synthesis_targets.size()) * how.iterations,
                   "renderings", synthesis.fraction(), true);
    try {
      while (!synthesis.finished()) {
        synthesis.advance();
        progress.update(synthesis.fraction());
      }
    } catch (const Interrupted&) {
      synthesis.store();
      progress.end();
      throw;
    }
    progress.end();
    e.syntheses.push_back(synthesis.result());
  }
  part(progress, "information limit", e.synthesis_targets.size(),
       [&](const Fraction& update) { bound_syntheses(how, renderer, e, update); });
}

}  // namespace

void run_evaluation(const EvaluationOptions& options, const std::string& device, const std::atomic<bool>& cancel,
                    const EvaluationProgress& progress, Evaluation& e) {
  if (options.images > 0 || options.inversions > 0) require_derivatives(options, e.set);
  const auto predicted = std::count_if(e.set.images.begin(), e.set.images.end(), [](const Manifest::Image& image) {
    return image.split != Manifest::Split::validation;
  });
  part(progress, "predictions", static_cast<std::size_t>(predicted) * e.runs.size(),
       [&](const Fraction& update) { predict_splits(options, e, cancel, update); });
  if (options.images == 0 && options.inversions == 0) return;
  const Device chosen(device);
  std::vector<std::string> starts;
  if (options.inversions > 0) {  // before the work of table 2
    starts = choose_synthesis_targets(options, e);
    require_same_syntheses(options, chosen, e, starts);
  }
  RenderedLoss renderer(chosen, e.set, options.data, Operator::full, &cancel);
  if (options.images > 0) {
    choose_rerendered(options, e, cancel);
    part(progress, "re-rendering", e.rerendered.size() * (e.runs.size() + 1),
         [&](const Fraction& update) { rerender_predictions(options, renderer, e, update); });
    part(progress, "information limit", e.rerendered.size(),
         [&](const Fraction& update) { bound_rerendered(options, renderer, e, update); });
  }
  if (options.inversions > 0) synthesise(options, chosen, renderer, starts, progress, e);
}

}  // namespace itn
