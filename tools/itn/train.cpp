// itn train: trains a network on a data set.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <nlohmann/json.hpp>
#include <optional>

#include "itn/error.h"
#include "itn/file.h"
#include "itn/network_file.h"
#include "network/training/training_run.h"
#include "runtime/base/ranks.h"
#include "runtime/base/seconds_since.h"
#include "tools/itn/common.h"
#include "tools/itn/interrupt.h"
#include "tools/itn/progress.h"

namespace itn::tools {
namespace {

struct TrainArguments {
  CommonOptions common;
  TrainingRequest request;
  std::string exported;
  double checkpoint_every = 60;
};

void print_beginning(const TrainArguments& options, const TrainingRun& run) {
  const NetworkDescription& description = run.description();
  fmt::print("{}: {} images to learn from, {} to validate with, {} x {} pixels, {} channel{}\n",
             run.labelled() ? fmt::format("{}", fmt::join(options.request.data, ", ")) : options.request.unlabelled,
             run.training_count(), run.validation_count(), description.size, description.size, description.channels,
             description.channels == 1 ? "" : "s");
  const Trainer& trainer = run.trainer();
  if (run.drops_distribution())
    fmt::print("{} says how sure it is, and this network will not: --distribution teaches it\n", options.request.init);
  if (!run.labelled())
    fmt::print("no labels: validation is by images, {:.5f} of the network of --init\n", run.validation_before());
  if (run.has_image_loss()) fmt::print("lambda {:.6g}\n", trainer.options().image_weight);
  if (trainer.steps() > 0) fmt::print("goes on after {} epochs, {} steps\n", trainer.curve().size(), trainer.steps());
  std::fflush(stdout);
}

void print_epoch(const TrainingRun& run) {
  const Trainer& trainer = run.trainer();
  const EpochLosses& losses = trainer.curve().back();
  fmt::print("epoch {:3}/{}  supervised {:.5f}{}  validation {:.5f}{}  {:.0f} images/s\n", trainer.curve().size(),
             trainer.options().epochs, losses.supervised,
             run.has_image_loss() ? fmt::format("  image {:.5g}", losses.image) : "", losses.validation,
             trainer.best_epoch() + 1 == trainer.curve().size() ? "  best" : "", run.images_per_second());
  std::fflush(stdout);
}

void print_end(const TrainingRun& run, const std::vector<double>& errors) {
  const Trainer& trainer = run.trainer();
  fmt::print("{}: of epoch {}, validation loss {:.5f}", run.file("network.safetensors"), trainer.best_epoch() + 1,
             trainer.curve()[trainer.best_epoch()].validation);
  if (!run.labelled()) fmt::print(", before {:.5f}", run.validation_before());
  if (const JudgeErrors* judged = run.judged()) {
    fmt::print("; of the validation images 5 % have a doubt above {:.3g}, and of those with a fault:", judged->limit);
    for (std::size_t i = 0; i < judged->found.size(); ++i)
      fmt::print(" {} {:.0f} %", run.description().outputs[1 + i].name, 100 * judged->found[i]);
  }
  if (!errors.empty()) fmt::print("; root mean square errors:");
  for (std::size_t i = 0; i < errors.size(); ++i)
    fmt::print(" {} {:.4g}", run.description().outputs[i].name, errors[i]);
  fmt::print("\n");
  if (run.has_image_loss() && run.seconds() > 0)
    fmt::print("rendering took {:.0f} % of the {:.0f} s, the network {:.0f} %\n",
               100 * trainer.times().image_loss / run.seconds(), run.seconds(),
               100 * trainer.times().network / run.seconds());
}

// Steps until the training is complete; stores what there is now and then, and when it is interrupted.
void learn(const TrainArguments& options, TrainingRun& run) {
  const OrderlyEnd orderly_end;
  auto saved = std::chrono::steady_clock::now();
  const double images =
      static_cast<double>(run.trainer().steps_in_epoch()) * options.request.epochs * options.request.batch;
  Progress progress(options.request.folder, images, "images", !options.common.quiet, run.fraction());
  while (!run.finished()) {
    const std::size_t epochs = run.trainer().curve().size();
    try {
      run.step();
    } catch (const Interrupted&) {
      progress.clear();
      // Another rank may have been stopped in the middle of this step: the last checkpoint holds.
      if (world().alone()) run.save();
      throw;
    }
    if (run.trainer().curve().size() > epochs) {
      progress.clear();
      if (options.common.talkative()) print_epoch(run);
    }
    progress.update(run.fraction());
    if (seconds_since(saved) > options.checkpoint_every) {
      run.save();
      saved = std::chrono::steady_clock::now();
    }
  }
}

void run(TrainArguments options) {
  options.request.seed = options.common.seed;
  options.request.device = options.common.device;
  options.request.spp = options.common.spp;
  check_folder(options.request.folder);
  for (const std::string& data : options.request.data) refuse_inside(data, {options.common.json, options.exported});
  if (!options.request.unlabelled.empty())
    refuse_inside(options.request.unlabelled, {options.common.json, options.exported});
  std::vector<std::string> files, own;
  for (const char* name : {"network.safetensors", "checkpoint.safetensors", "run.json", "curve.jsonl"})
    own.push_back(options.request.folder + "/" + name);
  if (!options.exported.empty()) files.push_back(options.exported);
  check_outputs(options.common, files, own);
  std::optional<Progress> reading;
  TrainingRun run(options.request, interrupt_flag(), [&](std::size_t done, std::size_t all) {
    if (!reading) reading.emplace(options.request.folder + ": reading", double(all), "images", !options.common.quiet);
    reading->update(double(done) / double(all));
  });
  reading.reset();
  if (options.common.talkative()) print_beginning(options, run);
  learn(options, run);
  const std::vector<double> errors = run.conclude();
  if (!options.exported.empty()) write_network(options.exported, run.best(), Precision::byte);
  if (options.common.talkative()) print_end(run, errors);
  nlohmann::ordered_json result{{"schema", "itn.train/1"}};
  result.update(run.record());
  result["folder"] = options.request.folder;
  result["time"] = {{"train_s", run.seconds()},
                    {"network_s", run.trainer().times().network},
                    {"image_loss_s", run.trainer().times().image_loss},
                    {"images_per_s", run.images_per_second()}};
  write_json(options.common, result);
}

}  // namespace

void add_train(CLI::App& app) {
  auto options = std::make_shared<TrainArguments>();
  CLI::App* command = app.add_subcommand("train", "Train a network on a data set");
  command->add_option("data", options->request.data, "Folders of data sets (itn dataset)");
  command
      ->add_option("-o,--output", options->request.folder,
                   "Folder for network.safetensors, checkpoint, curve and run.json")
      ->required();
  command->add_option("--export", options->exported,
                      "Also write the final network to this file, small, for shipping: with a byte per weight");
  command
      ->add_option("--network", options->request.kind,
                   "Kind: learn parameters (rn), and that renderings look like the input by all light (itn) or single "
                   "scattering (ssn), or to tell which images are wrong (judge)")
      ->required()
      ->check(CLI::IsMember({"rn", "itn", "ssn", judge_kind}));
  command->add_option("--init", options->request.init,
                      "Start from the network of this RUN or .safetensors file, with its ranges and its scale of "
                      "luminance; default: random weights");
  command->add_flag("--distribution", options->request.distribution,
                    "Learn a normal distribution of the parameters with calibrated 95 % intervals (rn); the losses are "
                    "then minus the log of the density");
  command
      ->add_option("--channels", options->request.channels,
                   "Input channels: 1 (luminance), or 6 (also normal, depth and light, where shape and light are "
                   "known); default: 1")
      ->check(CLI::IsMember({1, 6}));
  command
      ->add_option("--inputs", options->request.inputs,
                   "Inputs of the network, between commas, in place of --channels; predictions need what it sees, too")
      ->delimiter(',')
      ->check(CLI::IsMember({"image", "flash", "mask", "normal", "nearness", "light"}));
  command->add_flag("--exposure", options->request.exposure,
                    "Divide each image by its own mean, as for photos whose exposure nobody knows");
  command->add_flag("--cut-out", options->request.cut_out,
                    "Show the network the object alone, by its mask, on black, as for photos with other things in "
                    "them");
  command
      ->add_option("--width", options->request.width,
                   "Channels of the first stage; default: 16, as in the paper (less is slow, without oneDNN's fast "
                   "convolution)")
      ->check(CLI::Range(1, 64));
  group_options(
      *command, "Network",
      {"--network", "--init", "--distribution", "--channels", "--inputs", "--exposure", "--cut-out", "--width"});
  command->add_option("--epochs", options->request.epochs, "Most epochs")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  command->add_option("--batch", options->request.batch, "Images per step")
      ->check(CLI::Range(1, 4096))
      ->capture_default_str();
  command
      ->add_option("--learning-rate", options->request.learning_rate,
                   "Highest learning rate of Adam, reached after a tenth of the steps; it falls to a hundredth as half "
                   "a cosine wave")
      ->check(CLI::Range(1e-12, 1.0))
      ->capture_default_str();
  command
      ->add_option("--weight-decay", options->request.weight_decay,
                   "Weight decay of AdamW: a step takes learning rate times this off each weight")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  command
      ->add_option("--patience", options->request.patience,
                   "End after this many epochs without a better validation; 0: never")
      ->check(CLI::Range(0, 1'000'000))
      ->capture_default_str();
  command
      ->add_option("--noise", options->request.variation.noise,
                   "Add new noise to an image at every use, of up to this many of its standard errors")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  command->add_flag("--mirror", options->request.variation.mirrored,
                    "Also learn from every image's mirror image, left for right");
  group_options(*command, "Optimisation",
                {"--epochs", "--batch", "--learning-rate", "--weight-decay", "--patience", "--noise", "--mirror"});
  command
      ->add_option("--lambda", options->request.lambda,
                   "Weight of the image loss; default: makes both losses equal over the first batches, or 1 "
                   "with --unlabelled")
      ->check(CLI::Range(0.0, 1e12));
  command->add_option("--unlabelled", options->request.unlabelled,
                      "Data set whose materials are unknown, in place of labelled data: the network of --init learns "
                      "by rendering its images (itn)");
  group_options(*command, "Image loss (itn, ssn)", {"--lambda", "--unlabelled"});
  command
      ->add_option("--threads", options->request.threads,
                   "Threads of the network, at most one per core unless ITN_FORCE_THREADS=1 is in the environment; "
                   "default: OMP_NUM_THREADS, else one per core, or 1 with --shards")
      ->check(CLI::Range(1, 1024));
  command
      ->add_option("--shards", options->request.shards,
                   "Parts of a batch whose gradients are added up; processes (mpirun) share them, at most one process "
                   "per shard")
      ->check(CLI::Range(1, 4096))
      ->capture_default_str();
  command
      ->add_option("--checkpoint-every", options->checkpoint_every,
                   "Seconds between checkpoints, which have no influence on the numbers")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  group_options(*command, "Running", {"--threads", "--shards", "--checkpoint-every"});
  add_common_options(*command, options->common, "16 (itn, ssn: of each image of a batch)");
  add_example(*command, "itn train data --network rn --distribution --epochs 30 -o rn",
              "It learns from the split `train` and validates with `validation`; several data sets are learnt from "
              "together where nothing is rendered.\nStopped at any moment, the same command resumes, with the same "
              "numbers as if never stopped. The last digits depend on --threads and --shards.");
  command->callback([options] { run(*options); });
}

}  // namespace itn::tools
