// itn eval: the paper's tables 1, 2 and 3 for trained networks.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "network/threads.h"
#include "runtime/base/error.h"
#include "runtime/base/file.h"
#include "runtime/base/folder_lock.h"
#include "runtime/base/seconds_since.h"
#include "runtime/evaluation/claims.h"
#include "runtime/evaluation/report.h"
#include "runtime/evaluation/stored_synthesis.h"
#include "runtime/evaluation/tables.h"
#include "tools/common.h"
#include "tools/interrupt.h"
#include "tools/progress.h"

namespace itn::tools {
namespace {

struct Options {
  CommonOptions common;
  EvaluationOptions evaluation;
  std::optional<int> threads;
};

// Lines of up to 110 characters, set in by two.
std::string wrapped(const std::string& text) {
  constexpr std::size_t most = 110;
  std::istringstream words(text);
  std::string result, line = " ";
  for (std::string word; words >> word;) {
    if (line.size() + 1 + word.size() > most) {
      result += line + "\n";
      line = " ";
    }
    line += " " + word;
  }
  return result + line + "\n";
}

void print(const Evaluation& e, const std::string& folder) {
  std::string notes;
  for (const ReportTable& table : tables_of(e)) {
    fmt::print("{}\n", as_text(table));
    for (const std::string& note : table.notes) notes += wrapped(note);
  }
  fmt::print("{}\nWhat holds here\n", notes);
  for (const Claim& c : claims_of(e)) fmt::print("  {}: {}\n", c.text, verdict_words(c.verdict));
  fmt::print("\n{}/report.html\n", folder);
}

// Calls part(progress) with a line on the terminal for it.
template <class Part>
void with_progress(const Options& options, const std::string& label, std::size_t images, const Part& part) {
  Progress progress(label, static_cast<double>(images), "images", !options.common.quiet);
  part([&](double fraction) { progress.update(fraction); });
}

// Every start's inversions; what there is of one is stored when it is interrupted.
void synthesise(const Options& options, const Device& device, RenderedLoss& renderer, Evaluation& e) {
  const EvaluationOptions& how = options.evaluation;
  for (const std::string& start : choose_synthesis_targets(how, e)) {
    StoredSynthesis synthesis(how, device, renderer, e, start);
    Progress progress("inversions from " + start, static_cast<double>(e.synthesis_targets.size()) * how.iterations,
                      "renderings", !options.common.quiet, synthesis.fraction());
    const OrderlyEnd orderly_end;
    try {
      while (!synthesis.finished()) {
        synthesis.advance();
        progress.update(synthesis.fraction());
      }
    } catch (const Interrupted&) {
      progress.clear();
      synthesis.store();
      throw;
    }
    e.syntheses.push_back(synthesis.result());
  }
  with_progress(options, "information limit", e.synthesis_targets.size(),
                [&](const Fraction& progress) { bound_syntheses(how, renderer, e, progress); });
}

void evaluate(const Options& options, Evaluation& e) {
  const EvaluationOptions& how = options.evaluation;
  const std::atomic<bool>& cancel = interrupt_flag();
  const auto predicted = std::count_if(e.set.images.begin(), e.set.images.end(), [](const Manifest::Image& image) {
    return image.split != Manifest::Split::validation;
  });
  with_progress(options, "predictions", static_cast<std::size_t>(predicted) * e.runs.size(),
                [&](const Fraction& progress) { predict_splits(how, e, cancel, progress); });
  if (how.images == 0 && how.inversions == 0) return;
  const Device device(options.common.device);
  RenderedLoss renderer(device, e.set, how.data, Operator::full, &cancel);
  if (how.images > 0) {
    choose_rerendered(how, e, cancel);
    with_progress(options, "re-rendering", e.rerendered.size() * (e.runs.size() + 1),
                  [&](const Fraction& progress) { rerender_predictions(how, renderer, e, progress); });
    with_progress(options, "information limit", e.rerendered.size(),
                  [&](const Fraction& progress) { bound_rerendered(how, renderer, e, progress); });
  }
  if (how.inversions > 0) synthesise(options, device, renderer, e);
}

void run(Options options) {
  const auto start = std::chrono::steady_clock::now();
  const CommonOptions& common = options.common;
  options.evaluation.spp = common.spp;
  options.evaluation.seed = common.seed;
  if (common.spp != 0 && common.spp < 2) throw UsageError("--spp: the noise of an image needs 2 samples or more");
  refuse_inside(options.evaluation.data, {common.json});
  check_outputs(common, {});
  Evaluation e = begin_evaluation(options.evaluation);
  for (const EvaluatedRun& r : e.runs)
    for (const std::string& text : r.warnings) warn(common, text);
  const FolderLock lock(options.evaluation.report);
  if (options.threads) set_threads(*options.threads);
  evaluate(options, e);
  e.seconds = seconds_since(start);
  write_evaluation(options.evaluation.report, e);
  if (common.talkative()) print(e, options.evaluation.report);
  write_json(common, to_json(e));
}

}  // namespace

void add_eval(CLI::App& app) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "eval",
      "the paper's tables 1, 2 and 3 for trained networks: errors of the parameters, of images rendered with them, and "
      "analysis by synthesis that starts from them\n\n"
      "Stopped in the inversions of table 3, the same command goes on with them where it was.");
  command->add_option("data", options->evaluation.data, "folder of the data set (itn dataset)")->required();
  command
      ->add_option("runs", options->evaluation.runs,
                   "folders that itn train wrote, or .safetensors files; several of a kind give mean and spread")
      ->required();
  command->add_option("-o,--output", options->evaluation.report, "folder for report.html, result.json, pictures")
      ->required();
  command
      ->add_option("--images", options->evaluation.images,
                   "table 2 and the information limit: so many test images, and a quarter as many of the training's; "
                   "0: leave them out")
      ->check(CLI::Range(0, 1'000'000))
      ->capture_default_str();
  command
      ->add_option("--inversions", options->evaluation.inversions,
                   "table 3: so many images of every test shape, from the first RN, the first ITN, and the truth; 0: "
                   "leave it out")
      ->check(CLI::Range(0, 1'000'000))
      ->capture_default_str();
  command
      ->add_option("--iterations", options->evaluation.iterations,
                   "table 3: of every inversion, 16 samples a pixel each")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  command
      ->add_option("--learning-rate", options->evaluation.learning_rate,
                   "table 3: Adam's first; falls to 0 as a cosine")
      ->check(CLI::Range(1e-6, 10.0))
      ->capture_default_str();
  command->add_option("--threads", options->threads, "of the networks; default OMP_NUM_THREADS, else one a core")
      ->check(CLI::Range(1, 1024));
  add_common_options(*command, options->common, "the data set's");
  command->callback([options] { run(*options); });
}

}  // namespace itn::tools
