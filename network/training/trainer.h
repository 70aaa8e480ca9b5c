// Training: mini-batches in random order, Adam, validation after every epoch, early stop, checkpoints.
//
//   Trainer trainer(network, training, validation, options);
//   if (file exists) trainer.read_checkpoint(file);
//   while (!trainer.finished()) {
//     trainer.step();
//     if (now and then) trainer.write_checkpoint(file);
//   }
//   trainer.restore_best();
//
// Stopped at any step and gone on from a checkpoint, the numbers are the same to the bit (on the same processor, with
// the same number of threads; README.md).
#pragma once
#include <chrono>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "itn/loss.h"
#include "itn/network.h"
#include "network/training/adam.h"
#include "network/training/examples.h"

namespace itn {

struct TrainingOptions {
  int epochs = 50;
  int batch = 32;  // examples that fill no whole batch are left to other epochs
  double first_learning_rate = 1e-4, last_learning_rate = 1e-6;
  std::uint64_t seed = 0;            // of the order of the examples
  double weight_decay = 0;           // adam.h
  double image_weight = 0;           // lambda of the paper's eq. 3
  bool validated_by_images = false;  // the validation loss is the image loss; the examples' truth is not looked at
  // Each step's gradient is the sum of those of so many parts of the batch (shard_sum.h), which the ranks of world()
  // share: the numbers depend on how many shards there are, and not on the ranks. A divisor of batch, and at least one
  // for each rank.
  int shards = 1;
  int patience = 0;  // ends after so many epochs without a better validation loss; 0: never
  std::string data;  // what tells data sets apart: a checkpoint goes on only with the same
};

// A point of the loss curves.
struct EpochLosses {
  double supervised = 0, image = 0;  // means over the epoch's batches, while the weights change
  double validation = 0;             // supervised or image loss, after the epoch

  friend bool operator==(const EpochLosses&, const EpochLosses&) = default;
};

class Trainer {
 public:
  // All must outlive the trainer; image_loss may be null. The network starts from the weights it has.
  // Throws UsageError: no examples, fewer than a batch, options that cannot be, a weight without an image loss.
  Trainer(Network& network, const Examples& training, const Examples& validation, TrainingOptions options,
          ImageLoss* image_loss = nullptr);

  // One mini-batch, and at an epoch's end the validation. Throws ResultError when the loss is not finite, InputError
  // when an example is not; the weights are then as they were.
  void step();
  bool finished() const;

  const TrainingOptions& options() const { return options_; }
  std::uint64_t steps() const { return adam_.state().steps; }
  std::uint64_t steps_in_epoch() const;
  // Time that this object's steps have taken [s].
  struct Times {
    double network = 0;  // forward, backward, optimizer
    double image_loss = 0;
    double rest = 0;  // reading the examples, validation
  };
  const Times& times() const { return times_; }

  const std::vector<EpochLosses>& curve() const { return curve_; }  // of the epochs that are complete

  // The epoch of least validation loss, and its weights. Before the first epoch ends there is none.
  std::size_t best_epoch() const { return best_epoch_; }
  const std::vector<Tensor>& best_weights() const { return best_weights_; }  // none: empty
  void restore_best();
  // The validation loss with the weights as they are.
  double validation_loss();

  // Written whole or not at all. Throws ResultError.
  void write_checkpoint(const std::string& file) const;
  // Throws InputError: damaged, of another version, of another network, of other options or data.
  void read_checkpoint(const std::string& file);

 private:
  std::vector<std::size_t> next_examples();
  // The batch's loss; the gradient by the weights is then in the network.
  EpochLosses differentiate(const std::vector<std::size_t>& examples);
  EpochLosses differentiate_in_shards(const std::vector<std::size_t>& examples);
  ImageLoss::Result image_loss_of_all(const std::vector<std::size_t>& examples);
  // The gradient by the network's weights, from the loss's.
  void require_finite(const OutputLoss& loss) const;
  void end_epoch();
  double validation_image_loss();
  std::map<std::string, std::string> circumstances() const;

  Network& network_;
  const Examples &training_, &validation_;
  TrainingOptions options_;
  ImageLoss* image_loss_;
  Adam adam_;
  std::vector<EpochLosses> curve_;
  EpochLosses sums_;  // over the steps of the epoch so far
  std::size_t best_epoch_ = 0;
  std::vector<Tensor> best_weights_;
  std::vector<std::size_t> order_;
  std::chrono::steady_clock::time_point lap_start_;
  void lap(double& seconds);  // adds the time since the last call
  Times times_;
};

// The weight that makes the image loss as large as the supervised one, with the network as it is: over the first
// batches (`batches` of them, or as many as an epoch has) that a trainer with these options takes. Throws as
// Trainer::step(), and ResultError where one of the losses is not above 0.
double balanced_image_weight(Network& network, const Examples& training, const TrainingOptions& options,
                             ImageLoss& image_loss, int batches);

}  // namespace itn
