// itn eval: the paper's tables 1, 2 and 3 for trained networks.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "itn/error.h"
#include "itn/file.h"
#include "network/evaluation/claims.h"
#include "network/evaluation/report.h"
#include "network/evaluation/run_evaluation.h"
#include "network/evaluation/tables.h"
#include "network/model/threads.h"
#include "runtime/base/folder_lock.h"
#include "runtime/base/seconds_since.h"
#include "tools/itn/common.h"
#include "tools/itn/interrupt.h"
#include "tools/itn/progress.h"

namespace itn::tools {
namespace {

struct EvalArguments {
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

// A line on the terminal for each part of the evaluation. Parts that are stored end in order.
class PartLine {
 public:
  explicit PartLine(const EvalArguments& options) : wanted_(!options.common.quiet) {}

  EvaluationProgress progress() {
    return {[this](const std::string& label, double amount, const std::string& unit, double done, bool stored) {
              line_.emplace(label, amount, unit, wanted_, done);
              if (stored) orderly_end_.emplace();
            },
            [this](double fraction) { line_->update(fraction); },
            [this] {
              line_.reset();
              orderly_end_.reset();
            }};
  }

 private:
  bool wanted_;
  std::optional<Progress> line_;
  std::optional<OrderlyEnd> orderly_end_;
};

void run(EvalArguments options) {
  const auto start = std::chrono::steady_clock::now();
  const CommonOptions& common = options.common;
  options.evaluation.spp = common.spp;
  options.evaluation.seed = common.seed;
  if (common.spp != 0 && common.spp < 2) throw UsageError("--spp: the noise of an image needs 2 samples or more");
  refuse_inside(options.evaluation.data, {common.json});
  for (const std::string& run : options.evaluation.runs) refuse_inside(run, {common.json});
  check_folder(options.evaluation.report);
  check_outputs(common, {});
  Evaluation e = begin_evaluation(options.evaluation);
  for (const EvaluatedRun& r : e.runs)
    for (const std::string& text : r.warnings) warn(common, text);
  const FolderLock lock(options.evaluation.report);
  if (options.threads) set_threads(*options.threads);
  PartLine line(options);
  run_evaluation(options.evaluation, common.device, interrupt_flag(), line.progress(), e);
  e.seconds = seconds_since(start);
  write_evaluation(options.evaluation.report, e);
  if (common.talkative()) print(e, options.evaluation.report);
  write_json(common, to_json(e));
}

}  // namespace

void add_eval(CLI::App& app) {
  auto options = std::make_shared<EvalArguments>();
  CLI::App* command = app.add_subcommand("eval", "Compare trained networks as the paper's tables 1, 2 and 3 do");
  command->add_option("data", options->evaluation.data, "Folder of the data set (itn dataset)")->required();
  command
      ->add_option("runs", options->evaluation.runs,
                   "Folders that itn train wrote, or .safetensors files; several of a kind give mean and spread")
      ->required();
  command->add_option("-o,--output", options->evaluation.report, "Folder for report.html, result.json and pictures")
      ->required();
  command
      ->add_option("--images", options->evaluation.images,
                   "Test images of table 2 and the information limit, which takes a quarter as many training images, "
                   "too; 0: leave both out")
      ->check(CLI::Range(0, 1'000'000))
      ->capture_default_str();
  command
      ->add_option("--inversions", options->evaluation.inversions,
                   "Images of every test shape to invert from the first RN, the first ITN, and the truth; 0: leave "
                   "table 3 out")
      ->check(CLI::Range(0, 1'000'000))
      ->capture_default_str();
  command
      ->add_option("--iterations", options->evaluation.iterations,
                   "Iterations of every inversion, of 16 samples per pixel each")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  command
      ->add_option("--learning-rate", options->evaluation.learning_rate,
                   "First learning rate of Adam, which falls to 0 as a cosine")
      ->check(CLI::Range(1e-6, 10.0))
      ->capture_default_str();
  group_options(*command, "Table 2", {"--images"});
  group_options(*command, "Table 3", {"--inversions", "--iterations", "--learning-rate"});
  command
      ->add_option("--threads", options->threads,
                   "Threads of the networks, at most one per core unless ITN_FORCE_THREADS=1 is in the environment; "
                   "default: OMP_NUM_THREADS, else one per core")
      ->check(CLI::Range(1, 1024));
  add_common_options(*command, options->common, "the data set's");
  add_example(*command, "itn eval data rn itn -o report --images 40 --inversions 2",
              "The tables have the errors of the parameters, those of images rendered with them, and those of analysis "
              "by synthesis that starts from them.\nStopped in the inversions of table 3, the same command resumes "
              "them; with other networks or options they need another folder.");
  command->callback([options] { run(*options); });
}

}  // namespace itn::tools
