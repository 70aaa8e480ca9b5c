#include "network/training/training_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "itn/error.h"
#include "itn/file.h"
#include "itn/network_file.h"
#include "itn/trained_network.h"
#include "itn/version.h"
#include "network/model/threads.h"
#include "network/training/prediction.h"
#include "runtime/base/json_text.h"

namespace itn {
namespace {

using Json = StoredRun::Json;

constexpr int batches_for_lambda = 8;

TrainingRequest completed(TrainingRequest request) {
  request.variation.seed = request.seed;
  if (request.unlabelled.empty()) {
    if (request.data.empty()) throw UsageError("training: needs a data set");
    return request;
  }
  if (!request.data.empty()) throw UsageError("unlabelled: takes the place of labelled data sets; give either");
  if (request.kind != "itn")
    throw UsageError("unlabelled: only the network itn learns from it: without labels there are only images; need itn");
  if (request.init.empty()) throw UsageError("unlabelled: needs a network to begin with; give the run of one (init)");
  request.data = {request.unlabelled};
  return request;
}

// Reads the sets to learn from: complete, of images of the same size and scale, each there once.
std::vector<Manifest> read_sets(const TrainingRequest& request) {
  if (request.distribution && request.kind != "rn") throw UsageError("distribution: only rn learns one; leave it out");
  if (!adds_image_loss(request.kind) && request.lambda)
    throw UsageError("weight of the image loss (lambda): " + request.kind +
                     " has no image loss to weigh; leave it out");
  const bool renders = adds_image_loss(request.kind);
  if (request.data.size() > 1 && renders)
    throw UsageError(request.kind + ": its image loss needs one data set; only rn learns from several");
  std::vector<Manifest> sets;
  for (const std::string& folder : request.data) {
    Manifest set = read_complete_manifest(folder);
    if (renders && !is_laboratory(set))
      throw UsageError(
          fmt::format("{}: its images are in colours, or each has a camera or a boundary of its own; {} renders "
                      "images again, and knows luminance from one place: rn learns from such a set",
                      folder, request.kind));
    for (std::size_t i = 0; i < sets.size(); ++i) {
      if (set.hash == sets[i].hash) throw UsageError(fmt::format("{}: the same images as {}", folder, request.data[i]));
      if (set.size != sets[i].size || set.mm_per_unit != sets[i].mm_per_unit)
        throw UsageError(fmt::format(
            "{}: {} pixels a side and {} mm a scene unit, {} has {} and {}; to be learnt from together they must agree",
            folder, set.size, set.mm_per_unit, request.data[i], sets[i].size, sets[i].mm_per_unit));
      if (set.in_colours != sets[i].in_colours || set.linear_sigma_t != sets[i].linear_sigma_t)
        throw UsageError(
            fmt::format("{}: one of this set and {} is in colours, or has another scale of sigma_t; to be "
                        "learnt from together they must agree",
                        folder, request.data[i]));
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

// To train and to validate with.
std::size_t learnable_images(const std::vector<Manifest>& sets) {
  std::size_t count = 0;
  for (const Manifest& set : sets)
    for (const Manifest::Image& image : set.images)
      count += image.split == Manifest::Split::train || image.split == Manifest::Split::validation;
  return count;
}

DatasetImages read_images(const std::vector<std::string>& folders, const std::vector<Manifest>& sets,
                          Manifest::Split split, const Wanted& wanted, const std::atomic<bool>& cancel,
                          const std::function<void()>& read) {
  DatasetImages images;
  for (std::size_t i = 0; i < sets.size(); ++i)
    append(images, itn::read_images(folders[i], sets[i], split, wanted, cancel, read));
  return images;
}

RunFolder open_folder(const std::string& folder) { return {folder, "run.json", "itn.run/1", "a training"}; }

// Number of threads of the training that the folder holds.
int stored_threads(const StoredRun& run) {
  constexpr int most = 1024;
  const Json threads = run.before("request").value("threads", Json(1));
  if (!threads.is_number_integer() || threads < 1 || threads > most) run.refuse();
  return threads;
}

// All that the numbers depend on: training goes on only with the same.
Json circumstances_of(const TrainingRequest& r, const std::vector<Manifest>& sets, int thread_count) {
  const auto or_null = [](const auto& value) { return value ? Json(*value) : Json(); };
  Json all{{"version", version()},
           {"network", r.kind},
           {"data", joined_hashes(sets)},
           {"init", r.init.empty() ? "" : network_fingerprint(r.init)},
           {"channels", or_null(r.channels)},
           {"width", or_null(r.width)},
           {"epochs", r.epochs},
           {"batch", r.batch},
           {"learning_rate", r.learning_rate},
           {"seed", r.seed},
           {"patience", r.patience},
           {"weight_decay", r.weight_decay},
           {"lambda", or_null(r.lambda)},
           {"mirror", r.variation.mirrored},
           {"noise", r.variation.noise},
           {"threads", thread_count}};
  if (!r.inputs.empty()) all["inputs"] = r.inputs;
  if (r.exposure) all["exposure"] = "unknown";
  if (r.cut_out) all["cut_out"] = true;
  if (!r.unlabelled.empty()) all["labels"] = false;
  if (r.shards > 1) all["shards"] = r.shards;
  if (r.distribution) all["distribution"] = "learnt";
  return all;
}

TrainingOptions training_options(const TrainingRequest& r, const std::vector<Manifest>& sets) {
  TrainingOptions options;
  options.epochs = r.epochs;
  options.batch = r.batch;
  options.first_learning_rate = r.learning_rate;
  options.last_learning_rate = r.learning_rate / 100;
  options.seed = r.seed;
  options.weight_decay = r.weight_decay;
  options.patience = r.patience;
  options.shards = r.shards;
  options.validated_by_images = !r.unlabelled.empty();
  options.data = joined_hashes(sets);
  return options;
}

// Replaces the images' materials by the predictions of a network for a data set's three parameters.
void label(DatasetImages& images, Network& network) {
  const Predictions said = predict(network, DatasetExamples(images, network.description()));
  for (std::size_t i = 0; i < images.images.size(); ++i) {
    images.images[i].sigma_t = said.predicted[3 * i];
    images.images[i].albedo = said.predicted[3 * i + 1];
    images.images[i].g = said.predicted[3 * i + 2];
  }
}

void set_distribution(NetworkDescription& description, bool wanted) {
  description.distribution = wanted;
  description.spread.assign(wanted ? description.outputs.size() : 0, 1);
}

// Sets the inputs of a new network.
void set_inputs(NetworkDescription& description, const TrainingRequest& request, const Manifest& set) {
  if (request.cut_out && std::find(request.inputs.begin(), request.inputs.end(), "mask") == request.inputs.end())
    throw UsageError("cut_out: needs a mask to cut the object out by; let the network see one (inputs image,mask)");
  if (request.channels && !request.inputs.empty()) throw UsageError("inputs, channels: give either");
  if (request.channels) description.channels = *request.channels;
  if (request.channels || (request.inputs.empty() && !set.in_colours)) return;
  description.inputs.clear();
  for (const std::string& input : request.inputs.empty() ? std::vector<std::string>{"image"} : request.inputs)
    description.inputs.push_back(input == "image"   ? (set.in_colours ? "rgb" : "luminance")
                                 : input == "flash" ? (set.in_colours ? "flash_rgb" : "flash_luminance")
                                                    : input);
  description.channels = channels_of(description.inputs);
}

double mean_share_of_objects(const DatasetImages& images) {
  double sum = 0;
  for (const std::size_t shape : images.shape_of) sum += share_of_object(images.shapes[shape].mask);
  return sum / static_cast<double>(images.shape_of.size());
}

// A new network, or `init`, that of request.init, with the data set's size of images.
Network first_network(const TrainingRequest& request, const std::optional<Network>& init, const Manifest& manifest,
                      const DatasetImages& training) {
  if (!init) {
    NetworkDescription description;
    description.kind = request.kind;
    set_inputs(description, request, manifest);
    description.exposure = request.exposure;
    if (request.cut_out) description.cut_out = mean_share_of_objects(training);
    description.width = request.width.value_or(description.width);
    description.size = manifest.size;
    description.outputs = request.kind == judge_kind ? outputs_of_judge(description) : output_ranges(training);
    description.luminance = mean_luminance(training);
    description.mm_per_unit = manifest.mm_per_unit;
    set_distribution(description, request.distribution);
    Network network(description);
    network.initialise(request.seed);
    return network;
  }
  const auto check = [&](const char* name, const std::optional<int>& wanted, int is) {
    if (wanted && *wanted != is) throw UsageError(fmt::format("{} {}: the network of init has {}", name, *wanted, is));
  };
  check("channels", request.channels, init->description().channels);
  if (is_judge(init->description()) != (request.kind == judge_kind))
    throw UsageError("init: judges and networks that tell materials begin with their own kind alone");
  if (!request.inputs.empty() || request.exposure || request.cut_out)
    throw UsageError("inputs, exposure, cut_out: what the network of init sees stays; leave them out");
  check("width", request.width, init->description().width);
  NetworkDescription description = init->description();
  description.kind = request.kind;
  description.size = manifest.size;
  description.mm_per_unit = manifest.mm_per_unit;
  set_distribution(description, request.distribution);
  Network network(description);
  // The means come first. What a distribution has beside them begins at 0, so with even shares (distribution.h).
  for (std::size_t k = 0; k < network.weights().size(); ++k) {
    const std::vector<float>& from = init->weights()[k].values;
    std::vector<float>& to = network.weights()[k].values;
    std::copy_n(from.begin(), std::min(from.size(), to.size()), to.begin());
  }
  return network;
}

Json to_json(const EpochLosses& losses, bool has_image_loss) {
  Json json{{"supervised", losses.supervised}};
  if (has_image_loss) json["image"] = losses.image;
  json["validation"] = losses.validation;
  return json;
}

}  // namespace

bool adds_image_loss(const std::string& kind) { return kind == "itn" || kind == "ssn"; }

TrainingRun::TrainingRun(const TrainingRequest& request, const std::atomic<bool>& cancel, const Read& read)
    : request_(completed(request)), sets_(read_sets(request_)), folder_(open_folder(request.folder)), cancel_(cancel) {
  const Json before = folder_.run().before("request");
  if (before.is_null() && is_there(file("network.safetensors")))
    throw UsageError(request_.folder + ": holds a network that itn train has not made; give another folder with -o");
  const int thread_count = request_.threads   ? *request_.threads
                           : before.is_null() ? (request_.shards > 1 ? 1 : threads())
                                              : stored_threads(folder_.run());
  set_threads(thread_count);
  circumstances_ = circumstances_of(request_, sets_, thread_count);
  folder_.run().require_same(circumstances_);
  std::optional<Network> init;
  if (!request_.init.empty()) init.emplace(network_of(request_.init));
  drops_distribution_ = init && init->description().distribution && !request_.distribution;
  NetworkDescription seeing;
  if (init)
    seeing = init->description();
  else
    set_inputs(seeing, request_, sets_.front());
  Wanted wanted = wanted_by(seeing);
  wanted.shapes = wanted.shapes || adds_image_loss(request_.kind);
  const std::size_t all = learnable_images(sets_);
  std::size_t done = 0;
  const auto read_one = [&] { read(++done, all); };
  training_images_ = read_images(request_.data, sets_, Manifest::Split::train, wanted, cancel, read_one);
  validation_images_ = read_images(request_.data, sets_, Manifest::Split::validation, wanted, cancel, read_one);
  network_.emplace(first_network(request_, init, sets_.front(), training_images_));
  if (!labelled()) label(training_images_, *network_);
  training_ = examples_of(training_images_, request_.variation, request_.epochs / 4);
  validation_ = examples_of(validation_images_, {.seed = request_.seed});
  TrainingOptions options = training_options(request_, sets_);
  if (adds_image_loss(request_.kind)) options.image_weight = prepare_image_loss(options, cancel);
  trainer_.emplace(*network_, *training_, *validation_, options, image_loss_.get());
  if (!labelled()) {
    const Json stored = folder_.run().before("validation_before");
    validation_before_ = stored.is_number() ? stored.get<double>() : trainer_->validation_loss();
  }
  if (is_there(file("checkpoint.safetensors"))) trainer_->read_checkpoint(file("checkpoint.safetensors"));
  store_record();
}

std::unique_ptr<Examples> TrainingRun::examples_of(const DatasetImages& images,
                                                   const DatasetExamples::Variation& variation, int hard_looks) const {
  if (judges()) {
    std::optional<std::uint64_t> beginning;
    if (request_.init.empty()) beginning = static_cast<std::uint64_t>(hard_looks);
    return std::make_unique<JudgedExamples>(images, network_->description(), variation, 1, beginning);
  }
  return std::make_unique<DatasetExamples>(images, network_->description(), variation);
}

// The image loss, and its weight: as given, as it was at the beginning, or such that both losses are of equal size.
double TrainingRun::prepare_image_loss(const TrainingOptions& options, const std::atomic<bool>& cancel) {
  const ImageLossOptions how{request_.kind, request_.device, request_.spp, request_.seed};
  RenderedImageLoss rendered =
      make_image_loss(how, request_.data.front(), sets_.front(), training_images_, validation_images_, &cancel);
  circumstances_["image_loss"] = rendered.circumstances;
  folder_.run().require_same(circumstances_);
  image_loss_ = std::move(rendered.loss);
  if (request_.lambda) return *request_.lambda;
  if (!labelled()) return 1;
  if (const Json before = folder_.run().before("lambda"); before.is_number()) return before.get<double>();
  return balanced_image_weight(*network_, *training_, options, *image_loss_, batches_for_lambda);
}

double TrainingRun::fraction() const {
  return static_cast<double>(trainer_->steps()) / (static_cast<double>(trainer_->steps_in_epoch()) * request_.epochs);
}

void TrainingRun::step() {
  if (cancel_) throw Interrupted();
  trainer_->step();
  ++steps_;
}

Network TrainingRun::best() {
  Network best(network_->description());
  best.weights() = trainer_->best_weights();
  if (best.description().distribution) best.set_spread(calibrated_spread(best, *validation_));
  if (judges()) best.set_limit(judge_limit(predict(best, *validation_)));
  return best;
}

double TrainingRun::seconds() const {
  const Trainer::Times& times = trainer_->times();
  return times.network + times.image_loss + times.rest;
}

double TrainingRun::images_per_second() const { return steps_ > 0 ? steps_ * request_.batch / seconds() : 0; }

Json TrainingRun::record() const {
  Json json{{"request", circumstances_},
            {"data_folders", request_.data},
            {"lambda", has_image_loss() ? Json(trainer_->options().image_weight) : Json()},
            {"complete", concluded_},
            {"steps", trainer_->steps()},
            {"epochs", trainer_->curve().size()}};
  if (!labelled()) json["validation_before"] = validation_before_;
  if (trainer_->curve().empty()) return json;
  json["best_epoch"] = trainer_->best_epoch() + 1;
  json["losses"] = to_json(trainer_->curve()[trainer_->best_epoch()], has_image_loss());
  for (std::size_t i = 0; i < errors_.size(); ++i)
    object_in(json, "validation_rmse")[network_->description().outputs[i].name] = errors_[i];
  if (judged()) {
    json["limit"] = judged_.limit;
    for (std::size_t i = 0; i < judged_.found.size(); ++i)
      object_in(json, "found")[network_->description().outputs[1 + i].name] = judged_.found[i];
  }
  for (std::size_t i = 0; i < spread_.size(); ++i)
    object_in(json, "spread")[network_->description().outputs[i].name] = spread_[i];
  return json;
}

void TrainingRun::store_record() const { folder_.run().write(circumstances_, record(), 2); }

void TrainingRun::save() {
  trainer_->write_checkpoint(file("checkpoint.safetensors"));
  if (!trainer_->best_weights().empty()) write_network(file("network.safetensors"), best(), Precision::single);
  std::string lines;
  for (const EpochLosses& losses : trainer_->curve()) {
    Json line{{"epoch", 1 + &losses - trainer_->curve().data()}};
    line.update(to_json(losses, has_image_loss()));
    lines += line.dump() + "\n";
  }
  write_file(file("curve.jsonl"), lines);
  store_record();
}

std::vector<double> TrainingRun::conclude() {
  Network network = best();
  concluded_ = true;
  if (judges())
    judged_ = judge_errors(predict(network, *validation_), network.description().limit);
  else if (labelled())
    errors_ = root_mean_square_errors(predict(network, *validation_));
  spread_ = network.description().spread;
  save();
  return errors_;
}

}  // namespace itn
