#include "network/trainer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <span>
#include <utility>

#include "network/random.h"
#include "runtime/base/error.h"
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
  require(options.patience >= 0, "the patience must be 0 or above");
  require(training.count() >= static_cast<std::size_t>(options.batch), "fewer examples than a batch has");
  require(validation.count() >= 1, "no examples for the validation");
}

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

void Trainer::step() {
  if (finished()) throw UsageError("training: has ended");
  auto since = std::chrono::steady_clock::now();
  const auto lap = [&since](double& seconds) {
    seconds += seconds_since(since);
    since = std::chrono::steady_clock::now();
  };
  const std::vector<std::size_t> examples = next_examples();
  const Batch batch = read_batch(training_, examples, network_, steps() / steps_in_epoch());
  const std::vector<OutputRange>& ranges = network_.description().outputs;
  lap(times_.rest);
  const std::vector<float>& outputs = network_.forward(batch.images, options_.batch);
  OutputLoss loss = supervised_loss(outputs, batch.truth, ranges);
  const double supervised = loss.loss;
  double image = 0;
  lap(times_.network);
  if (options_.image_weight > 0) {
    const ImageLoss::Result result = image_loss_->evaluate(examples, parameters_of(outputs, ranges), steps());
    image = result.loss;
    add_image_loss(loss, result, options_.image_weight, outputs, ranges);
  }
  lap(times_.image_loss);
  if (!std::isfinite(loss.loss) || !all_finite(loss.gradient))
    throw ResultError("training: the loss of step " + std::to_string(steps() + 1) +
                      " or its gradient is not finite; lower the learning rate, or look at the examples");

  network_.backward(loss.gradient);
  const std::uint64_t all_steps = steps_in_epoch() * static_cast<std::uint64_t>(options_.epochs);
  adam_.step(network_.weights(), network_.gradients(),
             scheduled_learning_rate(options_.first_learning_rate, options_.last_learning_rate, steps(), all_steps));
  lap(times_.network);
  sums_.supervised += supervised;
  sums_.image += image;
  if (steps() % steps_in_epoch() == 0) end_epoch();
  lap(times_.rest);
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

double Trainer::validation_loss() {
  double sum = 0;
  const std::size_t count = validation_.count(), step = static_cast<std::size_t>(options_.batch);
  for (std::size_t first = 0; first < count; first += step) {
    std::vector<std::size_t> examples;
    for (std::size_t i = first; i < std::min(count, first + step); ++i) examples.push_back(i);
    const Batch batch = read_batch(validation_, examples, network_);
    const std::vector<float>& outputs = network_.forward(batch.images, static_cast<int>(examples.size()));
    sum += supervised_loss(outputs, batch.truth, network_.description().outputs).loss *
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
  const std::vector<OutputRange>& ranges = network.description().outputs;
  const auto size = static_cast<std::size_t>(options.batch);
  double supervised = 0, image = 0;
  for (std::size_t step = 0; step < static_cast<std::size_t>(batches) && (step + 1) * size <= order.size(); ++step) {
    const std::span<const std::size_t> examples = std::span(order).subspan(step * size, size);
    const Batch batch = read_batch(training, examples, network);
    const std::vector<float>& outputs = network.forward(batch.images, options.batch);
    supervised += supervised_loss(outputs, batch.truth, ranges).loss;
    image += image_loss.evaluate(examples, parameters_of(outputs, ranges), step).loss;
  }
  const double weight = supervised / image;
  if (!(weight > 0 && std::isfinite(weight)))
    throw ResultError("training: the supervised loss is " + std::to_string(supervised) + " and the image loss " +
                      std::to_string(image) + ": no weight makes them equal; give one");
  return weight;
}

}  // namespace itn
