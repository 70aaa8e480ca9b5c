// itn train: trains a network on a data set.
#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <optional>

#include "network/dataset_examples.h"
#include "network/network_file.h"
#include "network/prediction.h"
#include "network/threads.h"
#include "network/trainer.h"
#include "runtime/error.h"
#include "runtime/image/file.h"
#include "runtime/image/folder_lock.h"
#include "runtime/seconds_since.h"
#include "tools/common.h"
#include "tools/image_loss.h"
#include "tools/interrupt.h"
#include "tools/progress.h"
#include "tools/run_folder.h"

namespace itn::tools {
namespace {

using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

constexpr const char* schema = "itn.run/1";
constexpr int batches_for_lambda = 8;

struct Options {
  CommonOptions common;
  std::vector<std::string> data;
  std::string kind, folder, init, exported;
  DatasetExamples::Variation variation;
  std::optional<int> channels, width, threads;
  std::optional<double> lambda;
  double learning_rate = 1e-4, checkpoint_every = 60;
  TrainingOptions training;
};

// The files of a training's folder.
class RunFolder {
 public:
  explicit RunFolder(const std::string& folder) : folder_(folder) {
    if (std::filesystem::exists(file("run.json"))) {
      try {
        stored_ = Json::parse(read_file(file("run.json")));
        if (stored_.at("schema") != schema) throw InputError("");
        stored_.at("request");
      } catch (const std::exception&) {
        throw InputError(file("run.json") + ": not a training of this version; remove the folder to begin anew");
      }
    } else if (std::filesystem::exists(file("network.safetensors"))) {
      throw UsageError(folder + ": holds a network that itn train has not made; give another folder with -o");
    }
  }

  std::string file(const std::string& name) const { return (std::filesystem::path(folder_) / name).string(); }
  bool has_checkpoint() const { return std::filesystem::exists(file("checkpoint.safetensors")); }

  // Of the training that was begun here; null: none was.
  Json stored(const std::string& key) const { return stored_.is_null() ? Json() : stored_.value(key, Json()); }

  void check_same(const Json& request) const {
    if (stored_.is_null()) return;
    const Json& before = stored_.at("request");
    for (const auto& [key, value] : request.items())
      if (!before.contains(key) || before.at(key) != value)
        throw UsageError(fmt::format(
            "{}: holds a training with another {} ({}, now {}); give another folder with -o, or remove this", folder_,
            key, before.value(key, Json()).dump(), value.dump()));
  }

 private:
  std::string folder_;
  Json stored_;
};

// The sets to learn from: complete, of images of the same size and scale, each there once.
std::vector<Manifest> read_sets(const Options& options) {
  if (options.data.size() > 1 && options.kind != "rn")
    throw UsageError(options.kind + ": its image loss needs one data set; only rn learns from several");
  std::vector<Manifest> sets;
  for (const std::string& folder : options.data) {
    Manifest set = read_complete_manifest(folder);
    for (std::size_t i = 0; i < sets.size(); ++i) {
      if (set.hash == sets[i].hash) throw UsageError(fmt::format("{}: the same images as {}", folder, options.data[i]));
      if (set.size != sets[i].size || set.mm_per_unit != sets[i].mm_per_unit)
        throw UsageError(fmt::format(
            "{}: {} pixels a side and {} mm a scene unit, {} has {} and {}; to be learnt from together they must agree",
            folder, set.size, set.mm_per_unit, options.data[i], sets[i].size, sets[i].mm_per_unit));
    }
    sets.push_back(std::move(set));
  }
  return sets;
}

std::string joined_hashes(const std::vector<Manifest>& sets) {
  std::string hashes;
  for (const Manifest& set : sets) hashes += (hashes.empty() ? "" : " ") + set.hash;
  return hashes;
}

DatasetImages read_images(const Options& options, const std::vector<Manifest>& sets, Manifest::Split split,
                          bool with_shapes) {
  DatasetImages images;
  for (std::size_t i = 0; i < sets.size(); ++i)
    append(images, itn::read_images(options.data[i], sets[i], split, with_shapes, interrupt_flag()));
  return images;
}

// All that the numbers depend on: training goes on only with the same.
Json request(const Options& o, const std::vector<Manifest>& sets, int thread_count) {
  const auto or_null = [](const auto& value) { return value ? Json(*value) : Json(); };
  return {{"version", ITN_VERSION},           {"network", o.kind},
          {"data", joined_hashes(sets)},      {"init", o.init.empty() ? "" : network_fingerprint(o.init)},
          {"channels", or_null(o.channels)},  {"width", or_null(o.width)},
          {"epochs", o.training.epochs},      {"batch", o.training.batch},
          {"learning_rate", o.learning_rate}, {"seed", o.common.seed},
          {"patience", o.training.patience},  {"weight_decay", o.training.weight_decay},
          {"lambda", or_null(o.lambda)},      {"mirror", o.variation.mirrored},
          {"noise", o.variation.noise},       {"threads", thread_count}};
}

// A new network, or `init`, that of --init, with the data set's size of images.
Network first_network(const Options& options, const std::optional<Network>& init, const Manifest& manifest,
                      const DatasetImages& training) {
  if (!init) {
    NetworkDescription description;
    description.kind = options.kind;
    description.channels = options.channels.value_or(description.channels);
    description.width = options.width.value_or(description.width);
    description.size = manifest.size;
    description.outputs = output_ranges(training);
    description.luminance = mean_luminance(training);
    description.mm_per_unit = manifest.mm_per_unit;
    Network network(description);
    network.initialise(options.common.seed);
    return network;
  }
  const auto check = [&](const char* name, const std::optional<int>& wanted, int is) {
    if (wanted && *wanted != is)
      throw UsageError(fmt::format("--{} {}: the network of --init has {}", name, *wanted, is));
  };
  check("channels", options.channels, init->description().channels);
  check("width", options.width, init->description().width);
  NetworkDescription description = init->description();
  description.kind = options.kind;
  description.size = manifest.size;
  description.mm_per_unit = manifest.mm_per_unit;
  Network network(description);
  network.weights() = init->weights();
  return network;
}

Json to_json(const EpochLosses& losses, bool has_image_loss) {
  Json json{{"supervised", losses.supervised}};
  if (has_image_loss) json["image"] = losses.image;
  json["validation"] = losses.validation;
  return json;
}

class Training {
 public:
  explicit Training(const Options& options)
      : options_(options), sets_(read_sets(options)), lock_(options.folder), run_(options.folder) {
    const Json before = run_.stored("request");
    const int thread_count = options.threads    ? *options.threads
                             : before.is_null() ? threads()
                                                : before.value("threads", 1);
    set_threads(thread_count);
    request_ = request(options, sets_, thread_count);
    run_.check_same(request_);
    std::optional<Network> init;
    if (!options.init.empty()) init.emplace(network_of(options.init));
    const int channels = init ? init->description().channels : options.channels.value_or(NetworkDescription().channels);
    const bool with_shapes = channels > 1 || options.kind != "rn";
    training_images_ = read_images(options, sets_, Manifest::Split::train, with_shapes);
    validation_images_ = read_images(options, sets_, Manifest::Split::validation, with_shapes);
    network_.emplace(first_network(options, init, sets_.front(), training_images_));
    training_.emplace(training_images_, network_->description(), options.variation);
    validation_.emplace(validation_images_, network_->description());
    TrainingOptions chosen = options.training;
    chosen.data = joined_hashes(sets_);
    if (options.kind != "rn") chosen.image_weight = prepare_image_loss(chosen);
    trainer_.emplace(*network_, *training_, *validation_, chosen, image_loss_.loss.get());
    if (run_.has_checkpoint()) trainer_->read_checkpoint(run_.file("checkpoint.safetensors"));
  }

  void run() {
    introduce();
    const OrderlyEnd orderly_end;
    auto saved = Clock::now();
    const double all_steps = static_cast<double>(trainer_->steps_in_epoch()) * options_.training.epochs;
    const auto fraction = [&] { return static_cast<double>(trainer_->steps()) / all_steps; };
    Progress progress(options_.folder, all_steps * options_.training.batch, "images", !options_.common.quiet,
                      fraction());
    while (!trainer_->finished()) {
      const std::size_t epochs = trainer_->curve().size();
      try {
        if (interrupt_flag()) throw Interrupted();
        trainer_->step();
        ++steps_;
      } catch (const Interrupted&) {
        progress.clear();
        save({});
        throw;
      }
      if (trainer_->curve().size() > epochs) {
        progress.clear();
        print_epoch();
      }
      progress.update(fraction());
      if (seconds_since(saved) > options_.checkpoint_every) {
        save({});
        saved = Clock::now();
      }
    }
    progress.clear();
    finish();
  }

 private:
  // The image loss, and its weight: as given, as it was at the beginning, or such that both losses are of equal size.
  double prepare_image_loss(const TrainingOptions& chosen) {
    image_loss_ =
        make_image_loss(options_.kind, options_.common, options_.data.front(), sets_.front(), training_images_);
    request_["image_loss"] = image_loss_.circumstances;
    run_.check_same(request_);
    if (options_.lambda) return *options_.lambda;
    if (const Json before = run_.stored("lambda"); before.is_number()) return before.get<double>();
    return balanced_image_weight(*network_, *training_, chosen, *image_loss_.loss, batches_for_lambda);
  }

  bool has_image_loss() const { return image_loss_.loss != nullptr; }
  // Of this process, in steps.
  double seconds() const {
    const Trainer::Times& times = trainer_->times();
    return times.network + times.image_loss + times.rest;
  }
  double images_per_second() const { return steps_ > 0 ? steps_ * options_.training.batch / seconds() : 0; }

  void introduce() {
    write_file(run_.file("run.json"), record({}).dump(2) + "\n");
    if (!options_.common.talkative()) return;
    const NetworkDescription& description = network_->description();
    fmt::print("{}: {} images to learn from, {} to validate with, {} x {} pixels, {} channel{}\n",
               fmt::join(options_.data, ", "), training_->count(), validation_->count(), description.size,
               description.size, description.channels, description.channels == 1 ? "" : "s");
    if (has_image_loss()) fmt::print("lambda {:.6g}\n", trainer_->options().image_weight);
    if (trainer_->steps() > 0)
      fmt::print("goes on after {} epochs, {} steps\n", trainer_->curve().size(), trainer_->steps());
    std::fflush(stdout);
  }

  void print_epoch() const {
    if (!options_.common.talkative()) return;
    const EpochLosses& losses = trainer_->curve().back();
    fmt::print("epoch {:3}/{}  supervised {:.5f}{}  validation {:.5f}{}  {:.0f} images/s\n", trainer_->curve().size(),
               options_.training.epochs, losses.supervised,
               has_image_loss() ? fmt::format("  image {:.5g}", losses.image) : "", losses.validation,
               trainer_->best_epoch() + 1 == trainer_->curve().size() ? "  best" : "", images_per_second());
    std::fflush(stdout);
  }

  // What run.json holds; errors: of the validation, at the end. It has no duration and no date: the same training gives
  // the same bytes, however often it was stopped.
  Json record(const std::vector<double>& errors) const {
    Json json{{"schema", schema},
              {"request", request_},
              {"data_folders", options_.data},
              {"lambda", has_image_loss() ? Json(trainer_->options().image_weight) : Json()},
              {"complete", !errors.empty()},
              {"steps", trainer_->steps()},
              {"epochs", trainer_->curve().size()}};
    if (trainer_->curve().empty()) return json;
    json["best_epoch"] = trainer_->best_epoch() + 1;
    json["losses"] = to_json(trainer_->curve()[trainer_->best_epoch()], has_image_loss());
    for (std::size_t i = 0; i < errors.size(); ++i)
      json["validation_rmse"][network_->description().outputs[i].name] = errors[i];
    return json;
  }

  void save(const std::vector<double>& errors) {
    trainer_->write_checkpoint(run_.file("checkpoint.safetensors"));
    if (!trainer_->best_weights().empty()) {
      Network best(network_->description());
      best.weights() = trainer_->best_weights();
      write_network(run_.file("network.safetensors"), best, Precision::single);
    }
    std::string lines;
    for (const EpochLosses& losses : trainer_->curve()) {
      Json line{{"epoch", 1 + &losses - trainer_->curve().data()}};
      line.update(to_json(losses, has_image_loss()));
      lines += line.dump() + "\n";
    }
    write_file(run_.file("curve.jsonl"), lines);
    write_file(run_.file("run.json"), record(errors).dump(2) + "\n");
  }

  void finish() {
    Network best(network_->description());
    best.weights() = trainer_->best_weights();
    const std::vector<double> errors = root_mean_square_errors(predict(best, *validation_));
    save(errors);
    if (!options_.exported.empty()) write_network(options_.exported, best, Precision::half);
    const Trainer::Times& times = trainer_->times();
    if (options_.common.talkative()) {
      fmt::print("{}: of epoch {}, validation loss {:.5f}; root mean square errors:", run_.file("network.safetensors"),
                 trainer_->best_epoch() + 1, trainer_->curve()[trainer_->best_epoch()].validation);
      for (std::size_t i = 0; i < errors.size(); ++i)
        fmt::print(" {} {:.4g}", network_->description().outputs[i].name, errors[i]);
      fmt::print("\n");
      if (has_image_loss() && steps_ > 0)
        fmt::print("rendering took {:.0f} % of the {:.0f} s, the network {:.0f} %\n",
                   100 * times.image_loss / seconds(), seconds(), 100 * times.network / seconds());
    }
    Json result = record(errors);
    result["schema"] = "itn.train/1";
    result["folder"] = options_.folder;
    result["time"] = {{"train_s", seconds()},
                      {"network_s", times.network},
                      {"image_loss_s", times.image_loss},
                      {"images_per_s", images_per_second()}};
    write_json(options_.common, result);
  }

  Options options_;
  std::vector<Manifest> sets_;
  FolderLock lock_;
  RunFolder run_;
  Json request_;
  DatasetImages training_images_, validation_images_;
  std::optional<Network> network_;
  std::optional<DatasetExamples> training_, validation_;
  RenderedImageLoss image_loss_;
  std::optional<Trainer> trainer_;
  int steps_ = 0;  // of this process
};

void run(Options options) {
  if (options.kind == "rn" && options.lambda) throw UsageError("--lambda: rn has no image loss to weigh");
  options.training.first_learning_rate = options.learning_rate;
  options.training.last_learning_rate = options.learning_rate / 100;
  options.training.seed = options.variation.seed = options.common.seed;
  if (!options.common.json.empty() && options.common.json != "-") check_writable(options.common.json);
  if (!options.exported.empty()) check_writable(options.exported);
  Training(options).run();
}

}  // namespace

void add_train(CLI::App& app) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "train",
      "trains a network on the splits `train` and `validation` of a data set, or (rn) of several\n\n"
      "Stopped at any moment, the same command goes on where it was, with the same numbers as if never stopped.");
  command->add_option("data", options->data, "folders of data sets (itn dataset)")->required();
  command
      ->add_option("--network", options->kind,
                   "rn: learns parameters; itn, ssn: also that the image rendered with them looks like the input, by "
                   "all light or by single scattering")
      ->required()
      ->check(CLI::IsMember({"rn", "itn", "ssn"}));
  command->add_option("-o,--output", options->folder, "folder for network.safetensors, checkpoint, curve, run.json")
      ->required();
  command->add_option(
      "--init", options->init,
      "start from the network of this RUN (or .safetensors file), its ranges and its view of luminance; "
      "else from random weights");
  command->add_option("--epochs", options->training.epochs, "at most")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  command->add_option("--batch", options->training.batch, "images a step")
      ->check(CLI::Range(1, 4096))
      ->capture_default_str();
  command
      ->add_option("--noise", options->variation.noise,
                   "every look at an image has noise of its own, of up to so many of its standard errors")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  command->add_option("--export", options->exported,
                      "at the end also write the network to this file, at half precision, for shipping");
  command->add_flag("--mirror", options->variation.mirrored,
                    "also learn from every image's mirror image, left for right");
  command
      ->add_option(
          "--learning-rate", options->learning_rate,
          "Adam's; rises to this over the first tenth of the steps, falls to a hundredth as half a cosine wave")
      ->check(CLI::Range(1e-12, 1.0))
      ->capture_default_str();
  command
      ->add_option("--weight-decay", options->training.weight_decay,
                   "AdamW's: a step takes learning rate times this off each weight")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  command
      ->add_option("--channels", options->channels,
                   "1: luminance; 6: also normal, depth and light, where shape and light are known; default 1")
      ->check(CLI::IsMember({1, 6}));
  command
      ->add_option(
          "--width", options->width,
          "channels of the first stage; default 16, as in the paper; below 16 slow: oneDNN has no fast convolution")
      ->check(CLI::Range(1, 64));
  command
      ->add_option("--patience", options->training.patience,
                   "end after so many epochs without a better validation; 0: never")
      ->check(CLI::Range(0, 1'000'000))
      ->capture_default_str();
  command
      ->add_option(
          "--lambda", options->lambda,
          "itn, ssn: weight of the image loss; default: such that both losses are of equal size over the first "
          "batches")
      ->check(CLI::Range(0.0, 1e12));
  command
      ->add_option("--threads", options->threads,
                   "of the network; the last digits depend on it; default OMP_NUM_THREADS, else one a core")
      ->check(CLI::Range(1, 1024));
  command->add_option("--checkpoint-every", options->checkpoint_every, "seconds; has no influence on the numbers")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  add_common_options(*command, options->common, "16 (itn, ssn: of each image of a batch)");
  command->callback([options] { run(*options); });
}

}  // namespace itn::tools
