// itn eval: the paper's tables 1, 2 and 3 for trained networks.
#include "tools/eval.h"

#include <fmt/format.h>

#include <chrono>
#include <filesystem>

#include "network/threads.h"
#include "runtime/error.h"
#include "runtime/image/file.h"
#include "runtime/image/folder_lock.h"
#include "runtime/seconds_since.h"
#include "tools/eval_report.h"
#include "tools/interrupt.h"

namespace itn::tools {
namespace {

using Clock = std::chrono::steady_clock;

void run(const EvalOptions& options) {
  const auto start = Clock::now();
  const CommonOptions& common = options.common;
  if (common.spp != 0 && common.spp < 2) throw UsageError("--spp: the noise of an image needs 2 samples or more");
  if (!common.json.empty() && common.json != "-") check_writable(common.json);

  Evaluation e;
  e.folder = options.data;
  e.set = read_complete_manifest(options.data);
  e.resampling.seed = common.seed;
  e.spp = common.spp ? common.spp : std::max(2, e.set.spp);
  for (const std::string& path : options.runs) e.runs.push_back(read_run(path, e.set));
  e.kinds = kinds_of(e.runs);
  for (const EvaluatedRun& r : e.runs)
    for (const std::string& text : r.warnings) warn(common, text);

  const FolderLock lock(options.report);
  if (options.threads) set_threads(*options.threads);
  predict_splits(options, e);
  if (options.images > 0 || options.inversions > 0) {
    const Device device(common.device);
    RenderedLoss renderer(device, e.set, options.data, Operator::full, &interrupt_flag());
    if (options.images > 0) rerender_predictions(options, renderer, e);
    if (options.inversions > 0) run_syntheses(options, device, renderer, e);
  }
  e.seconds = seconds_since(start);
  write_evaluation(options.report, e);
  if (common.talkative()) print_evaluation(e, options.report);
  write_json(common, to_json(e));
}

}  // namespace

void add_eval(CLI::App& app) {
  auto options = std::make_shared<EvalOptions>();
  CLI::App* command = app.add_subcommand(
      "eval",
      "the paper's tables 1, 2 and 3 for trained networks: errors of the parameters, of images rendered with them, and "
      "analysis by synthesis that starts from them\n\n"
      "Stopped in the inversions of table 3, the same command goes on with them where it was.");
  command->add_option("data", options->data, "folder of the data set (itn dataset)")->required();
  command
      ->add_option("runs", options->runs,
                   "folders that itn train wrote, or .safetensors files; several of a kind give mean and spread")
      ->required();
  command->add_option("-o,--output", options->report, "folder for report.html, result.json, pictures")->required();
  command
      ->add_option("--images", options->images,
                   "table 2 and the information limit: so many test images, and a quarter as many of the training's; "
                   "0: leave them out")
      ->check(CLI::Range(0, 1'000'000))
      ->capture_default_str();
  command
      ->add_option("--inversions", options->inversions,
                   "table 3: so many images of every test shape, from the first RN, the first ITN, and the truth; 0: "
                   "leave it out")
      ->check(CLI::Range(0, 1'000'000))
      ->capture_default_str();
  command->add_option("--iterations", options->iterations, "table 3: of every inversion, 16 samples a pixel each")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  command->add_option("--learning-rate", options->learning_rate, "table 3: Adam's first; falls to 0 as a cosine")
      ->check(CLI::Range(1e-6, 10.0))
      ->capture_default_str();
  command->add_option("--threads", options->threads, "of the networks; default OMP_NUM_THREADS, else one a core")
      ->check(CLI::Range(1, 1024));
  add_common_options(*command, options->common, "the data set's");
  command->callback([options] { run(*options); });
}

}  // namespace itn::tools
