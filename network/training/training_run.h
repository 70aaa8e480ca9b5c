// A network's training on data sets, with its files in a folder: stopped at any moment and begun again with the same
// request, it ends with the same bytes.
//
//   TrainingRun run(request, cancel);
//   while (!run.finished()) {
//     run.step();
//     if (now and then) run.save();
//   }
//   run.conclude();
//
// The folder then holds network.safetensors (the best weights so far), curve.jsonl (a line an epoch), run.json (the
// record) and checkpoint.safetensors.
#pragma once
#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "itn/network.h"
#include "network/training/dataset_examples.h"
#include "network/training/judge.h"
#include "network/training/rendered_image_loss.h"
#include "network/training/trainer.h"
#include "runtime/base/stored_run.h"

namespace itn {

struct TrainingRequest {
  std::vector<std::string> data;  // folders of complete data sets; several only where nothing is rendered
  // Instead of `data`: the folder of a data set whose materials nobody knows; no truth in the manifest has any
  // influence. In its place stands what the network of `init` says of the images. itn
  std::string unlabelled;
  std::string kind = "rn";  // rn; itn, ssn: also with the image loss; judge (network/training/judge.h)
  std::string folder;
  std::string init;                    // RUN to start from (trained_network.h); empty: random weights
  bool distribution = false;           // learn how sure it is, too (NetworkDescription); rn
  bool exposure = false;               // a new network does not know exposures
  bool cut_out = false;                // a new network sees the object alone, by its mask
  std::vector<std::string> inputs;     // of a new network: "image", "flash", and "mask", "normal", "nearness", "light"
  std::optional<int> channels, width;  // of a new network; default: NetworkDescription's
  std::optional<int> threads;          // of the network; default: as in the folder, else threads()
  // Weight of the image loss; default: both losses of equal size, without labels 1.
  std::optional<double> lambda;
  DatasetExamples::Variation variation;       // its seed is `seed`
  int epochs = 50, batch = 32, patience = 0;  // as TrainingOptions
  int shards = 1;                             // as TrainingOptions; above 1 `threads` is 1 by default
  double learning_rate = 1e-4;                // the first; the last is a hundredth of it
  double weight_decay = 0;
  std::uint64_t seed = 0;
  std::string device;  // of the image loss, as for Device
  int spp = 0;         // of the image loss; 0: 16
};

// Do networks of this kind?
bool adds_image_loss(const std::string& kind);

class TrainingRun {
 public:
  // Called after each image that is read: how many there are now, and will be.
  using Read = std::function<void(std::size_t done, std::size_t all)>;

  // Reads the data sets, and the checkpoint where the folder has one. cancel: polled, must outlive this. Throws
  // UsageError: options that do not go together, a folder that holds another training; InputError: data sets, networks,
  // a damaged folder; ResultError: a folder that is not writable or another process's; DeviceError; Interrupted.
  TrainingRun(
      const TrainingRequest& request, const std::atomic<bool>& cancel,
      const Read& read = [](std::size_t, std::size_t) {});

  bool finished() const { return trainer_->finished(); }
  double fraction() const;
  // One mini-batch. Throws Interrupted when *cancel is set, and what Trainer::step() throws; save() then stores what
  // there is.
  void step();
  void save();
  // Stores the end. Returns the root mean square error of each output over the validation images; without labels, and
  // of judges, none.
  std::vector<double> conclude();

  const Trainer& trainer() const { return *trainer_; }
  const NetworkDescription& description() const { return network_->description(); }
  // After the first epoch: the weights that validate best. A distribution's spread is calibrated.
  Network best();
  bool has_image_loss() const { return image_loss_ != nullptr; }
  // Errors of a judge on the validation images, once concluded.
  const JudgeErrors* judged() const { return judges() && concluded_ ? &judged_ : nullptr; }
  bool labelled() const { return request_.unlabelled.empty(); }
  // Without labels: the validation loss, which is by images then, of the network of `init`.
  double validation_before() const { return validation_before_; }
  // Does the network of `init` say a distribution, and this one none?
  bool drops_distribution() const { return drops_distribution_; }
  std::size_t training_count() const { return training_->count(); }
  std::size_t validation_count() const { return validation_->count(); }
  std::string file(const std::string& name) const { return folder_.file(name); }

  // The steps of this object took [s], and how many images they saw in one.
  double seconds() const;
  double images_per_second() const;

  // run.json's content: request, lambda, steps, losses and, once concluded, the validation's errors where there are
  // labels. It has no duration and no date.
  StoredRun::Json record() const;

 private:
  bool judges() const { return request_.kind == judge_kind; }
  // hard_looks: of a judge that begins from nothing (network/training/judge.h).
  std::unique_ptr<Examples> examples_of(const DatasetImages& images, const DatasetExamples::Variation& variation,
                                        int hard_looks = 0) const;
  double prepare_image_loss(const TrainingOptions& options, const std::atomic<bool>& cancel);
  void store_record() const;

  TrainingRequest request_;
  std::vector<Manifest> sets_;
  RunFolder folder_;
  const std::atomic<bool>& cancel_;
  StoredRun::Json circumstances_;  // all that the numbers depend on
  DatasetImages training_images_, validation_images_;
  std::optional<Network> network_;
  std::unique_ptr<Examples> training_, validation_;
  std::unique_ptr<ImageLoss> image_loss_;
  std::optional<Trainer> trainer_;
  double validation_before_ = 0;
  bool drops_distribution_ = false, concluded_ = false;
  int steps_ = 0;               // of this object
  std::vector<double> errors_;  // of the validation, once concluded
  std::vector<double> spread_;  // likewise, of a distribution (NetworkDescription)
  JudgeErrors judged_;          // likewise, of a judge
};

}  // namespace itn
