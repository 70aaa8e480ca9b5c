// Table 1: predictions for all images, and their errors.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "itn/error.h"
#include "itn/loss.h"
#include "network/evaluation/evaluate.h"
#include "network/training/dataset_examples.h"
#include "runtime/base/folder_owner.h"
#include "runtime/base/statistics.h"

namespace itn {
namespace {

constexpr std::size_t at_once = 32;

using Split = Manifest::Split;
constexpr std::array<Split, 4> evaluated_splits{Split::train, Split::unseen_light, Split::unseen_shape,
                                                Split::unseen_both};

std::size_t count(const Manifest& set, Split split) {
  return static_cast<std::size_t>(
      std::count_if(set.images.begin(), set.images.end(), [&](const auto& image) { return image.split == split; }));
}

// Adds what the run says about the images. done: called with every image.
void predict(EvaluatedRun& run, const DatasetImages& images, SplitPredictions& result,
             const std::function<void()>& done) {
  const NetworkDescription& description = run.network.description();
  const DatasetExamples examples(images, description);
  const std::size_t values = run.network.image_values(), outputs = description.outputs.size();
  std::vector<DatasetMaterial>& predicted = result.predicted.emplace_back();
  std::vector<Calibration>& calibration = result.calibration.emplace_back();
  for (std::size_t first = 0; first < examples.count(); first += at_once) {
    const std::size_t batch = std::min(at_once, examples.count() - first);
    std::vector<float> input(batch * values);
    std::vector<double> truth(batch * outputs);
    for (std::size_t i = 0; i < batch; ++i)
      examples.read(first + i, 0, std::span(input).subspan(i * values, values),
                    std::span(truth).subspan(i * outputs, outputs));
    const std::vector<float>& raw = run.network.forward(input, static_cast<int>(batch));
    const std::vector<double> parameters = parameters_of(raw, description);
    for (std::size_t i = 0; i < batch; ++i) {
      const auto at = [&](std::size_t p) { return parameters[i * outputs + run.output[p]]; };
      predicted.push_back({at(0), at(1), at(2)});
      if (description.distribution) {
        const std::size_t count = description.raw_outputs();
        calibration.push_back(calibration_of(std::span(raw).subspan(i * count, count),
                                             std::span(truth).subspan(i * outputs, outputs), description));
      }
      done();
    }
  }
}

// Mean and variance of the training's parameters.
void describe_training(Evaluation& e) {
  const std::vector<Manifest::Image>& images = e.splits.front().images;
  const auto n = static_cast<double>(images.size());
  for (std::size_t p = 0; p < 3; ++p) {
    for (const Manifest::Image& image : images) e.constant[p] += parameter_of(image, parameter_names[p]) / n;
    for (const Manifest::Image& image : images) {
      const double difference = parameter_of(image, parameter_names[p]) - e.constant[p];
      e.prior[p] += difference * difference / n;
    }
  }
}

// parts: what the images are in; cells: one an image.
Coverage coverage_of(const Evaluation& e, const Kind& kind, const std::vector<const SplitPredictions*>& parts,
                     const std::vector<std::size_t>& cells) {
  const double most = normal_quantile(0.975), region = joint_region(3);
  Coverage result;
  for (const std::size_t run : kind.runs) {
    std::array<std::vector<double>, 4> held;
    for (const SplitPredictions* part : parts)
      for (const Calibration& c : part->calibration[run]) {
        for (std::size_t p = 0; p < 3; ++p) {
          const double score = c.score[e.runs[run].output[p]];
          held[p].push_back(std::fabs(score) <= most);
          const double tenth = std::floor(normal_cdf(score) * double(Coverage::bins));
          ++result.ranks[p][std::min(Coverage::bins - 1, static_cast<std::size_t>(tenth))];
        }
        held[3].push_back(c.distance <= region);
      }
    for (std::size_t i = 0; i < held.size(); ++i) result.held[i].push_back(clustered(held[i], cells));
  }
  return result;
}

ParameterErrors errors_of(const Evaluation& e, const std::string& name, const std::vector<Split>& splits) {
  ParameterErrors result;
  result.name = name;
  std::vector<std::size_t> cells;
  std::vector<const SplitPredictions*> parts;
  for (const SplitPredictions& s : e.splits)
    if (std::count(splits.begin(), splits.end(), s.split)) parts.push_back(&s);
  for (const SplitPredictions* part : parts)
    for (const Manifest::Image& image : part->images) cells.push_back(cell_of(e.set, image));
  result.images = cells.size();
  result.cells = std::set<std::size_t>(cells.begin(), cells.end()).size();
  // predicted(part, image): the parameter that is said.
  const auto squares = [&](std::size_t p, auto&& predicted) {
    std::vector<double> values;
    for (const SplitPredictions* part : parts)
      for (std::size_t i = 0; i < part->images.size(); ++i) {
        const double error = predicted(*part, i) - parameter_of(part->images[i], parameter_names[p]);
        values.push_back(error * error);
      }
    return clustered(values, cells);
  };
  for (std::size_t p = 0; p < 3; ++p) {
    for (const Kind& kind : e.kinds)
      for (const std::size_t run : kind.runs)
        result.squares[kind.name][p].push_back(squares(
            p, [run, p](const SplitPredictions& part, std::size_t i) { return as_array(part.predicted[run][i])[p]; }));
    result.squares["constant"][p] = {squares(p, [&](const SplitPredictions&, std::size_t) { return e.constant[p]; })};
  }
  for (const Kind& kind : e.kinds)
    if (std::all_of(kind.runs.begin(), kind.runs.end(),
                    [&](std::size_t run) { return e.runs[run].network.description().distribution; }))
      result.coverage[kind.name] = coverage_of(e, kind, parts, cells);
  return result;
}

}  // namespace

Evaluation begin_evaluation(const EvaluationOptions& options) {
  refuse_folder_of_other(options.report, "result.json");
  Evaluation e;
  e.folder = options.data;
  e.set = read_complete_manifest(options.data);
  if (!is_laboratory(e.set))
    throw UsageError(
        options.data +
        ": its images are in colours, or each has a camera or a boundary of its own; itn eval compares "
        "networks of luminance from one place: itn predict with this set as dataset tells the errors on it");
  e.resampling.seed = options.seed;
  e.spp = options.spp ? options.spp : std::max(2, e.set.spp);
  for (const std::string& path : options.runs) e.runs.push_back(read_run(path, e.set));
  e.kinds = kinds_of(e.runs);
  return e;
}

void predict_splits(const EvaluationOptions& options, Evaluation& e, const std::atomic<bool>& cancel,
                    const Fraction& progress) {
  std::size_t images = 0, test_images = 0;
  for (const Split split : evaluated_splits) {
    images += count(e.set, split);
    if (split != Split::train) test_images += count(e.set, split);
  }
  if (test_images == 0)
    throw InputError(manifest_file(options.data) +
                     ": has no images to test with (unseen_light, unseen_shape, unseen_both)");
  Wanted wanted;
  wanted.shapes = std::any_of(e.runs.begin(), e.runs.end(),
                              [](const EvaluatedRun& r) { return wanted_by(r.network.description()).shapes; });
  std::size_t done = 0;
  for (const Split split : evaluated_splits) {
    if (split != Split::train && count(e.set, split) == 0) continue;
    DatasetImages read = read_images(options.data, e.set, split, wanted, cancel);
    SplitPredictions result{split, read.images, {}, {}};
    for (EvaluatedRun& run : e.runs)
      predict(run, read, result, [&] {
        if (cancel) throw Interrupted();
        ++done;
        if (progress) progress(static_cast<double>(done) / static_cast<double>(images * e.runs.size()));
      });
    e.splits.push_back(std::move(result));
  }
  describe_training(e);
  e.errors.push_back(errors_of(e, "training", {Split::train}));
  e.errors.push_back(errors_of(e, "testing", {Split::unseen_light, Split::unseen_shape, Split::unseen_both}));
  for (const SplitPredictions& s : e.splits)
    if (s.split != Split::train) e.errors.push_back(errors_of(e, split_name(s.split), {s.split}));
}

}  // namespace itn
