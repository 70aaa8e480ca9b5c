#include "network/training/trainer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <span>
#include <utility>

#include "itn/error.h"
#include "network/model/random.h"
#include "network/training/shard_sum.h"
#include "runtime/base/ranks.h"
#include "runtime/base/seconds_since.h"

namespace itn {
namespace {

void check(const Examples& training, const Examples& validation, const TrainingOptions& options, bool has_image_loss) {
  const auto require = [](bool condition, const char* what) {
    if (!condition) throw UsageError(std::string("training: ") + what);
  };
  require(options.epochs >= 1, "needs at least one epoch");
  require(options.batch >= 1, "needs at least one example a batch");
  require(options.first_learning_rate > 0 && options.last_learning_rate >= 0 &&
              std::isfinite(options.first_learning_rate) && std::isfinite(options.last_learning_rate),
          "the learning rate must be above 0");
  require(options.weight_decay >= 0 && std::isfinite(options.weight_decay), "the weight decay must be 0 or above");
  require(options.image_weight >= 0 && std::isfinite(options.image_weight),
          "the weight of the image loss must be 0 or above");
  require(has_image_loss || options.image_weight == 0, "a weight for the image loss, and none to weigh");
  require(has_image_loss || !options.validated_by_images, "a validation by images, and no image loss");
  require(options.patience >= 0, "the patience must be 0 or above");
  require(options.shards >= 1 && options.batch % options.shards == 0, "the shards must divide the batch evenly");
  require(world().count() <= options.shards,
          "in several processes it needs a shard for each (shards): the numbers depend on how many shards there are, "
          "and not on the processes");
  require(training.count() >= static_cast<std::size_t>(options.batch), "fewer examples than a batch has");
  require(validation.count() >= 1, "no examples for the validation");
}

// The parts of a batch, and those of this rank.
struct Shards {
  std::size_t count, size, first, end;

  Shards(const TrainingOptions& options, const Ranks& ranks)
      : count(static_cast<std::size_t>(options.shards)),
        size(static_cast<std::size_t>(options.batch) / count),
        first(share_begin(count, static_cast<std::size_t>(ranks.rank()), static_cast<std::size_t>(ranks.count()))),
        end(share_begin(count, static_cast<std::size_t>(ranks.rank()) + 1, static_cast<std::size_t>(ranks.count()))) {}

  std::span<const std::size_t> part(const std::vector<std::size_t>& examples, std::size_t shard) const {
    return std::span(examples).subspan(shard * size, size);
  }
};

bool all_finite(const std::vector<float>& numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](float number) { return std::isfinite(number); });
}

}  // namespace

Trainer::Trainer(Network& network, const Examples& training, const Examples& validation, TrainingOptions options,
                 ImageLoss* image_loss)
    : network_(network),
      training_(training),
      validation_(validation),
      options_(std::move(options)),
      image_loss_(image_loss),
      adam_(network.weights(), {.weight_decay = options_.weight_decay}) {
  check(training_, validation_, options_, image_loss_ != nullptr);
  if (image_loss && network.description().distribution)
    throw UsageError("training: an image loss needs a network that says parameters alone, no distribution of them");
}

std::uint64_t Trainer::steps_in_epoch() const { return training_.count() / static_cast<std::size_t>(options_.batch); }

bool Trainer::finished() const {
  if (curve_.size() >= static_cast<std::size_t>(options_.epochs)) return true;
  return options_.patience > 0 && curve_.size() > best_epoch_ + static_cast<std::size_t>(options_.patience);
}

std::vector<std::size_t> Trainer::next_examples() {
  const std::uint64_t epoch = steps() / steps_in_epoch(), step = steps() % steps_in_epoch();
  if (step == 0 || order_.empty()) order_ = random_order(options_.seed, RANDOM_ORDER + epoch, training_.count());
  const auto first = order_.begin() + static_cast<std::ptrdiff_t>(step) * options_.batch;
  return {first, first + options_.batch};
}

void Trainer::lap(double& seconds) {
  seconds += seconds_since(lap_start_);
  lap_start_ = std::chrono::steady_clock::now();
}

void Trainer::require_finite(const OutputLoss& loss) const {
  if (!std::isfinite(loss.loss) || !all_finite(loss.gradient))
    throw ResultError("training: the loss of step " + std::to_string(steps() + 1) +
                      " or its gradient is not finite; lower the learning rate, or look at the examples");
}

void Trainer::step() {
  if (finished()) throw UsageError("training: has ended");
  lap_start_ = std::chrono::steady_clock::now();
  const std::vector<std::size_t> examples = next_examples();
  const EpochLosses losses = options_.shards > 1 ? differentiate_in_shards(examples) : differentiate(examples);
  const std::uint64_t all_steps = steps_in_epoch() * static_cast<std::uint64_t>(options_.epochs);
  adam_.step(network_.weights(), network_.gradients(),
             scheduled_learning_rate(options_.first_learning_rate, options_.last_learning_rate, steps(), all_steps));
  lap(times_.network);
  sums_.supervised += losses.supervised;
  sums_.image += losses.image;
  if (steps() % steps_in_epoch() == 0) end_epoch();
  lap(times_.rest);
}

EpochLosses Trainer::differentiate(const std::vector<std::size_t>& examples) {
  const Batch batch = read_batch(training_, examples, network_, steps() / steps_in_epoch());
  const std::vector<OutputRange>& ranges = network_.description().outputs;
  lap(times_.rest);
  const std::vector<float>& outputs = network_.forward(batch.images, options_.batch);
  OutputLoss loss = training_loss(outputs, batch.truth, network_.description());
  EpochLosses losses{loss.loss, 0, 0};
  lap(times_.network);
  if (options_.image_weight > 0) {
    const ImageLoss::Result result =
        image_loss_->evaluate(examples, parameters_of(outputs, network_.description()), steps());
    losses.image = result.loss;
    add_image_loss(loss, result, options_.image_weight, outputs, ranges);
  }
  lap(times_.image_loss);
  require_finite(loss);
  network_.backward(loss.gradient);
  return losses;
}

// The ranks render the images of a batch together: they need the outputs for all of them.
ImageLoss::Result Trainer::image_loss_of_all(const std::vector<std::size_t>& examples) {
  Ranks& ranks = world();
  const Shards shards(options_, ranks);
  std::vector<float> mine;
  for (std::size_t s = shards.first; s < shards.end; ++s) {
    const Batch batch = read_batch(training_, shards.part(examples, s), network_, steps() / steps_in_epoch());
    const std::vector<float>& outputs = network_.forward(batch.images, static_cast<int>(shards.size));
    mine.insert(mine.end(), outputs.begin(), outputs.end());
  }
  std::vector<float> all;
  for (const std::string& part : ranks.gather(bytes_of(mine))) {
    const auto outputs = numbers_of<float>(part);
    all.insert(all.end(), outputs.begin(), outputs.end());
  }
  lap(times_.network);
  ImageLoss::Result result = image_loss_->evaluate(examples, parameters_of(all, network_.description()), steps());
  lap(times_.image_loss);
  return result;
}

EpochLosses Trainer::differentiate_in_shards(const std::vector<std::size_t>& examples) {
  Ranks& ranks = world();
  const Shards shards(options_, ranks);
  const std::vector<OutputRange>& ranges = network_.description().outputs;
  const std::size_t outputs_of_shard = shards.size * ranges.size();
  ImageLoss::Result image;
  if (options_.image_weight > 0) image = image_loss_of_all(examples);
  ShardSum sum(shards.count);
  std::vector<double> losses;
  for (std::size_t s = shards.first; s < shards.end; ++s) {
    lap(times_.network);
    const Batch batch = read_batch(training_, shards.part(examples, s), network_, steps() / steps_in_epoch());
    lap(times_.rest);
    const std::vector<float>& outputs = network_.forward(batch.images, static_cast<int>(shards.size));
    OutputLoss loss = training_loss(outputs, batch.truth, network_.description());
    losses.push_back(loss.loss);
    if (options_.image_weight > 0) {
      // of the mean over this shard's images, as the supervised loss is
      ImageLoss::Result own;
      for (std::size_t i = 0; i < outputs_of_shard; ++i)
        own.gradient.push_back(image.gradient[s * outputs_of_shard + i] * static_cast<double>(shards.count));
      add_image_loss(loss, own, options_.image_weight, outputs, ranges);
    }
    for (float& g : loss.gradient) g /= static_cast<float>(shards.count);
    require_finite(loss);
    network_.backward(loss.gradient);
    std::vector<float> gradient;
    for (const Tensor& tensor : network_.gradients())
      gradient.insert(gradient.end(), tensor.values.begin(), tensor.values.end());
    sum.add(s, std::move(gradient));
  }
  std::size_t values = 0;
  for (const Tensor& tensor : network_.gradients()) values += tensor.values.size();
  const std::vector<float> total = sum.over(ranks, values);
  auto from = total.begin();
  for (Tensor& tensor : network_.gradients()) {
    std::copy_n(from, tensor.values.size(), tensor.values.begin());
    from += static_cast<std::ptrdiff_t>(tensor.values.size());
  }
  EpochLosses mean{0, image.loss, 0};
  for (const std::string& part : ranks.gather(bytes_of(losses)))
    for (const double loss : numbers_of<double>(part)) mean.supervised += loss / static_cast<double>(shards.count);
  return mean;
}

void Trainer::end_epoch() {
  const auto steps_done = static_cast<double>(steps_in_epoch());
  curve_.push_back({sums_.supervised / steps_done, sums_.image / steps_done, validation_loss()});
  sums_ = {};
  if (best_weights_.empty() || curve_.back().validation < curve_[best_epoch_].validation) {
    best_epoch_ = curve_.size() - 1;
    best_weights_ = network_.weights();
  }
}

// The ranks take batches in turn; the sum is in the order of the batches.
double Trainer::validation_loss() {
  if (options_.validated_by_images) return validation_image_loss();
  Ranks& ranks = world();
  const auto rank = static_cast<std::size_t>(ranks.rank()), rank_count = static_cast<std::size_t>(ranks.count());
  const std::size_t count = validation_.count(), step = static_cast<std::size_t>(options_.batch);
  std::vector<double> mine;
  for (std::size_t first = rank * step; first < count; first += rank_count * step) {
    std::vector<std::size_t> examples;
    for (std::size_t i = first; i < std::min(count, first + step); ++i) examples.push_back(i);
    const Batch batch = read_batch(validation_, examples, network_);
    const std::vector<float>& outputs = network_.forward(batch.images, static_cast<int>(examples.size()));
    mine.push_back(training_loss(outputs, batch.truth, network_.description()).loss *
                   static_cast<double>(examples.size()));
  }
  std::vector<std::vector<double>> losses;
  for (const std::string& part : ranks.gather(bytes_of(mine))) losses.push_back(numbers_of<double>(part));
  double sum = 0;
  for (std::size_t b = 0; b * step < count; ++b) sum += losses[b % rank_count][b / rank_count];
  return sum / static_cast<double>(count);
}

// The ranks render each batch together, so each of them asks the network for all.
double Trainer::validation_image_loss() {
  const std::size_t count = validation_.count(), step = static_cast<std::size_t>(options_.batch);
  double sum = 0;
  for (std::size_t first = 0; first < count; first += step) {
    std::vector<std::size_t> examples;
    for (std::size_t i = first; i < std::min(count, first + step); ++i) examples.push_back(i);
    const Batch batch = read_batch(validation_, examples, network_);
    const std::vector<float>& outputs = network_.forward(batch.images, static_cast<int>(examples.size()));
    sum += image_loss_->validate(examples, parameters_of(outputs, network_.description())) *
           static_cast<double>(examples.size());
  }
  return sum / static_cast<double>(count);
}

void Trainer::restore_best() {
  if (!best_weights_.empty()) network_.weights() = best_weights_;
}

double balanced_image_weight(Network& network, const Examples& training, const TrainingOptions& options,
                             ImageLoss& image_loss, int batches) {
  const std::vector<std::size_t> order = random_order(options.seed, RANDOM_ORDER, training.count());
  const auto size = static_cast<std::size_t>(options.batch);
  double supervised = 0, image = 0;
  for (std::size_t step = 0; step < static_cast<std::size_t>(batches) && (step + 1) * size <= order.size(); ++step) {
    const std::span<const std::size_t> examples = std::span(order).subspan(step * size, size);
    const Batch batch = read_batch(training, examples, network);
    const std::vector<float>& outputs = network.forward(batch.images, options.batch);
    supervised += training_loss(outputs, batch.truth, network.description()).loss;
    image += image_loss.evaluate(examples, parameters_of(outputs, network.description()), step).loss;
  }
  const double weight = supervised / image;
  if (!(weight > 0 && std::isfinite(weight)))
    throw ResultError("training: the supervised loss is " + std::to_string(supervised) + " and the image loss " +
                      std::to_string(image) + ": no weight makes them equal; give one");
  return weight;
}

}  // namespace itn
