// Training on made-up examples: that it learns, stops, ends and goes on as it says.
#include "network/training/trainer.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <mutex>
#include <set>

#include "../support/temporary_folder.h"
#include "itn/distribution.h"
#include "itn/error.h"
#include "itn/file.h"
#include "itn/network_file.h"
#include "network/model/random.h"

namespace {

using namespace itn;
using Catch::Contains;

constexpr int SIZE = 4;
const std::vector<OutputRange> outputs{{"sigma_t", 20, 300, true}, {"albedo", 0.3, 1, false}};

Network small_network(std::uint64_t seed = 1) {
  Network network({"rn", 1, SIZE, outputs, 2});
  network.initialise(seed);
  return network;
}

// Chequered images whose mean tells albedo, and whose contrast sigma_t; a little noise. meaningless: parameters of
// other images.
class MadeUpExamples : public Examples {
 public:
  explicit MadeUpExamples(std::size_t count, std::uint64_t seed, bool meaningless = false)
      : count_(count), seed_(seed), meaningless_(meaningless) {}
  std::size_t count() const override { return count_; }
  void read(std::size_t index, std::uint64_t look, std::span<float> image, std::span<double> truth) const override {
    const auto share = [&](std::uint64_t what, std::uint64_t of) {
      return 0.1 + 0.8 * random_uniform(seed_, what, of);
    };
    for (std::size_t i = 0; i < image.size(); ++i) {
      const double sign = (i % SIZE + i / SIZE) % 2 == 0 ? 1 : -1, noise = 0.02 * random_normal(seed_, 100 + index, i);
      image[i] = static_cast<float>(share(1, index) + 0.5 * sign * share(0, index) + noise);
    }
    const std::uint64_t described = meaningless_ ? index + 1000 : index;
    truth[0] = 20 * std::pow(15, share(0, described));
    truth[1] = 0.3 + 0.7 * share(1, described);
    if (!seen) return;
    const std::lock_guard lock(mutex_);  // several threads read a batch, in any order
    seen->push_back({index, look});
  }
  struct Seen {
    std::size_t index;
    std::uint64_t look;
  };
  std::vector<Seen>* seen = nullptr;

 private:
  mutable std::mutex mutex_;
  std::size_t count_;
  std::uint64_t seed_;
  bool meaningless_;
};

// Wants albedo 0.9 of everything, with noise that depends on the step.
class MadeUpImageLoss : public ImageLoss {
 public:
  Result evaluate(std::span<const std::size_t> examples, std::span<const double> parameters,
                  std::uint64_t step) override {
    Result result;
    for (std::size_t i = 0; i < examples.size(); ++i) {
      const double difference = parameters[2 * i + 1] - 0.9 + 0.01 * random_normal(9, step, i);
      result.loss += difference * difference / static_cast<double>(examples.size());
      result.gradient.push_back(0);
      result.gradient.push_back(broken ? NAN : 2 * difference / static_cast<double>(examples.size()));
    }
    asked.push_back({examples.begin(), examples.end()});
    steps.push_back(step);
    return result;
  }
  double validate(std::span<const std::size_t> examples, std::span<const double> parameters) override {
    double sum = 0;
    for (std::size_t i = 0; i < examples.size(); ++i) sum += std::pow(parameters[2 * i + 1] - 0.9, 2);
    validated.insert(validated.end(), examples.begin(), examples.end());
    return sum / static_cast<double>(examples.size());
  }
  std::vector<std::vector<std::size_t>> asked;
  std::vector<std::uint64_t> steps;
  std::vector<std::size_t> validated;
  bool broken = false;
};

TrainingOptions options(int epochs) {
  TrainingOptions result;
  result.epochs = epochs;
  result.batch = 8;
  result.first_learning_rate = 1e-2;
  result.seed = 5;
  result.data = "made up";
  return result;
}

bool same_weights(const Network& a, const Network& b) {
  for (std::size_t i = 0; i < a.weights().size(); ++i)
    if (a.weights()[i].values != b.weights()[i].values) return false;
  return true;
}

}  // namespace

TEST_CASE("A network learns what its images tell: far better than the best constant guess") {
  const MadeUpExamples training(64, 1), validation(32, 2);
  Network network = small_network();
  Trainer trainer(network, training, validation, options(12));
  while (!trainer.finished()) trainer.step();
  REQUIRE(trainer.curve().size() == 12);
  CHECK(trainer.steps() == 12 * 8);
  // Shares uniform over 0.8: their variance is 0.8^2 / 12 = 0.053, the constant guess's loss.
  CHECK(trainer.curve().back().supervised < 0.053 / 4);
  CHECK(trainer.curve().back().validation < 0.053 / 4);
}

TEST_CASE("An epoch takes every example once, in an order of its own; what fills no batch waits") {
  MadeUpExamples training(19, 1);
  const MadeUpExamples validation(1, 2);
  std::vector<MadeUpExamples::Seen> seen;
  training.seen = &seen;
  Network network = small_network();
  Trainer trainer(network, training, validation, options(2));
  CHECK(trainer.steps_in_epoch() == 2);
  while (!trainer.finished()) trainer.step();
  REQUIRE(seen.size() == 32);
  const auto indices = [&](std::size_t first, std::size_t end) {
    std::set<std::size_t> result;
    for (std::size_t i = first; i < end; ++i) result.insert(seen[i].index);
    return result;
  };
  CHECK(indices(0, 16).size() == 16);
  CHECK(indices(16, 32).size() == 16);
  CHECK(indices(0, 8) != indices(16, 24));  // the first batches
}

TEST_CASE("A step is Adam's, at the schedule's rate, with the gradient of the batch; validation is the mean over all") {
  const MadeUpExamples training(16, 1), validation(11, 2);
  const TrainingOptions chosen = options(2);
  Network network = small_network(), by_hand = small_network();
  Trainer trainer(network, training, validation, chosen);
  Adam adam(by_hand.weights());
  const std::size_t values = by_hand.image_values();
  for (std::uint64_t step = 0; step < 4; ++step) {
    const std::vector<std::size_t> order = random_order(chosen.seed, RANDOM_ORDER + step / 2, 16);
    std::vector<float> images(8 * values);
    std::vector<double> truth(16);
    for (std::size_t i = 0; i < 8; ++i)
      training.read(order[step % 2 * 8 + i], 0, std::span(images).subspan(i * values, values),
                    std::span(truth).subspan(2 * i, 2));
    by_hand.backward(supervised_loss(by_hand.forward(images, 8), truth, outputs).gradient);
    adam.step(by_hand.weights(), by_hand.gradients(),
              scheduled_learning_rate(chosen.first_learning_rate, chosen.last_learning_rate, step, 4));
    trainer.step();
    CHECK(same_weights(network, by_hand));
  }
  double sum = 0;
  for (std::size_t i = 0; i < 11; ++i) {
    std::vector<float> image(values);
    std::vector<double> truth(2);
    validation.read(i, 0, image, truth);
    sum += supervised_loss(by_hand.forward(image, 1), truth, outputs).loss;
  }
  CHECK(trainer.curve().back().validation == Approx(sum / 11).epsilon(1e-5));
}

TEST_CASE("Training stopped at any step goes on from its checkpoint to the same bits") {
  const MadeUpExamples training(24, 1), validation(5, 2);
  TrainingOptions chosen = options(2);
  chosen.image_weight = 0.5;
  MadeUpImageLoss image_loss;
  Network whole = small_network();
  Trainer undisturbed(whole, training, validation, chosen, &image_loss);
  while (!undisturbed.finished()) undisturbed.step();

  const TemporaryFolder folder;
  const std::string file = folder / "checkpoint.safetensors";
  for (const std::uint64_t stop : {0, 2, 3, 4, 6}) {  // an epoch has three steps
    INFO("stopped after step " << stop);
    Network stopped_network = small_network(), network = small_network(77);
    Trainer stopped(stopped_network, training, validation, chosen, &image_loss);
    while (stopped.steps() < stop) stopped.step();
    stopped.write_checkpoint(file);

    Trainer trainer(network, training, validation, chosen, &image_loss);
    trainer.read_checkpoint(file);
    CHECK(trainer.steps() == stop);
    CHECK(same_weights(network, stopped_network));
    stopped.restore_best();
    trainer.restore_best();
    CHECK(same_weights(network, stopped_network));
    trainer.read_checkpoint(file);
    while (!trainer.finished()) trainer.step();
    CHECK(same_weights(network, whole));
    CHECK(trainer.curve() == undisturbed.curve());
    CHECK(trainer.best_epoch() == undisturbed.best_epoch());
  }
}

TEST_CASE("The image loss is asked about the batch, and pulls the network where it wants it") {
  const MadeUpExamples training(16, 1), validation(8, 2);
  MadeUpImageLoss image_loss;
  TrainingOptions chosen = options(20);
  chosen.image_weight = 20;
  Network network = small_network();
  Trainer trainer(network, training, validation, chosen, &image_loss);
  while (!trainer.finished()) trainer.step();
  REQUIRE(image_loss.asked.size() == 40);
  std::set<std::size_t> first_epoch(image_loss.asked[0].begin(), image_loss.asked[0].end());
  first_epoch.insert(image_loss.asked[1].begin(), image_loss.asked[1].end());
  CHECK(first_epoch.size() == 16);
  for (std::size_t i = 0; i < 40; ++i) CHECK(image_loss.steps[i] == i);
  CHECK(trainer.curve().back().image < 0.25 * trainer.curve().front().image);
}

TEST_CASE("Where validation is by images, the truth of the validation examples has no influence") {
  TrainingOptions chosen = options(6);
  chosen.image_weight = 20;
  chosen.validated_by_images = true;
  chosen.shards = GENERATE(1, 2);
  std::vector<std::vector<EpochLosses>> curves;
  for (const bool meaningless : {false, true}) {
    const MadeUpExamples training(16, 1), validation(12, 2, meaningless);
    MadeUpImageLoss image_loss;
    Network network = small_network();
    Trainer trainer(network, training, validation, chosen, &image_loss);
    const double before = trainer.validation_loss();
    CHECK(image_loss.validated == std::vector<std::size_t>{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11});
    while (!trainer.finished()) trainer.step();
    curves.push_back(trainer.curve());
    CHECK(curves.back().back().validation < 0.5 * before);
    CHECK(curves.back().back().validation == trainer.validation_loss());
  }
  CHECK(curves[0] == curves[1]);
}

TEST_CASE("The balanced weight makes both losses equal over the first batches") {
  const MadeUpExamples training(24, 1), validation(8, 2);
  const TrainingOptions chosen = options(1);
  Network network = small_network();
  MadeUpImageLoss image_loss;
  const double weight = balanced_image_weight(network, training, chosen, image_loss, 2);
  const std::vector<std::vector<std::size_t>> asked = image_loss.asked;
  REQUIRE(asked.size() == 2);
  CHECK(same_weights(network, small_network()));

  double supervised = 0, image = 0;
  for (std::size_t step = 0; step < 2; ++step) {
    const Batch batch = read_batch(training, asked[step], network);
    const std::vector<float>& raw = network.forward(batch.images, chosen.batch);
    supervised += supervised_loss(raw, batch.truth, outputs).loss;
    image += image_loss.evaluate(asked[step], parameters_of(raw, network.description()), step).loss;
  }
  CHECK(weight * image == Approx(supervised));

  // The batches are those that training begins with; an epoch has three of them.
  MadeUpImageLoss in_training;
  TrainingOptions with_image = chosen;
  with_image.image_weight = weight;
  Trainer trainer(network, training, validation, with_image, &in_training);
  while (!trainer.finished()) trainer.step();
  CHECK(std::vector(in_training.asked.begin(), in_training.asked.begin() + 2) == asked);
  MadeUpImageLoss all;
  balanced_image_weight(network, training, chosen, all, 100);
  CHECK(all.asked.size() == 3);
  class Perfect : public MadeUpImageLoss {
   public:
    Result evaluate(std::span<const std::size_t>, std::span<const double>, std::uint64_t) override { return {}; }
  } perfect;
  CHECK_THROWS_AS(balanced_image_weight(network, training, chosen, perfect, 2), ResultError);
}

TEST_CASE("Training ends early when validation does not get better, and has the best weights") {
  const MadeUpExamples training(16, 1), validation(16, 2, true);  // what is learnt is of no use there
  TrainingOptions chosen = options(60);
  chosen.patience = 3;
  Network network = small_network();
  Trainer trainer(network, training, validation, chosen);
  Network best = small_network();
  while (!trainer.finished()) {
    trainer.step();
    if (trainer.curve().size() == trainer.best_epoch() + 1 && trainer.steps() % trainer.steps_in_epoch() == 0)
      best.weights() = network.weights();
  }
  CHECK(trainer.curve().size() == trainer.best_epoch() + 4);
  CHECK(trainer.curve().size() < 60);
  for (const EpochLosses& losses : trainer.curve())
    CHECK(losses.validation >= trainer.curve()[trainer.best_epoch()].validation);
  CHECK_FALSE(same_weights(network, best));
  trainer.restore_best();
  CHECK(same_weights(network, best));
  CHECK_THROWS_AS(trainer.step(), UsageError);
}

TEST_CASE("A loss or an example that is not finite ends training and leaves the weights alone") {
  const MadeUpExamples training(8, 1), validation(1, 2);
  MadeUpImageLoss image_loss;
  image_loss.broken = true;
  TrainingOptions chosen = options(1);
  chosen.image_weight = 1;
  Network network = small_network();
  Trainer trainer(network, training, validation, chosen, &image_loss);
  CHECK_THROWS_AS(trainer.step(), ResultError);
  CHECK(same_weights(network, small_network()));

  class Broken : public MadeUpExamples {
   public:
    using MadeUpExamples::MadeUpExamples;
    void read(std::size_t index, std::uint64_t look, std::span<float> image, std::span<double> truth) const override {
      MadeUpExamples::read(index, look, image, truth);
      image[3] = NAN;
    }
  };
  const Broken broken(8, 1);
  Trainer other(network, broken, validation, options(1));
  CHECK_THROWS_AS(other.step(), InputError);
  CHECK(same_weights(network, small_network()));
}

TEST_CASE("A checkpoint of other circumstances or a damaged one is an input error, and changes nothing") {
  const MadeUpExamples training(16, 1), validation(4, 2);
  const TemporaryFolder folder;
  const std::string file = folder / "checkpoint.safetensors";
  Network network = small_network();
  Trainer trainer(network, training, validation, options(1));
  trainer.step();
  trainer.write_checkpoint(file);
  const std::string bytes = read_file(file);

  const auto message = [&](const TrainingOptions& chosen, const Examples& examples) -> std::string {
    Network other = small_network(2);
    Trainer reader(other, examples, validation, chosen);
    try {
      reader.read_checkpoint(file);
    } catch (const InputError& error) {
      CHECK(same_weights(other, small_network(2)));
      CHECK(reader.steps() == 0);
      return error.what();
    }
    return "accepted";
  };
  CHECK(message(options(1), training) == "accepted");
  TrainingOptions chosen = options(1);
  chosen.batch = 4;
  CHECK_THAT(message(chosen, training), Contains("was made with batch '8', and now it is '4'"));
  chosen = options(1);
  chosen.data = "others";
  CHECK_THAT(message(chosen, training), Contains("was made with data 'made up'"));
  CHECK_THAT(message(options(1), MadeUpExamples(17, 1)), Contains("training_examples"));

  const auto changed = [&](const std::string& name, const std::string& value) {
    Safetensors content = parse_safetensors(bytes, file);
    content.metadata[name] = value;
    write_file(file, safetensors_bytes(content, Precision::single));
    return message(options(1), training);
  };
  CHECK_THAT(changed("version", "0"), Contains("version is '0'"));
  CHECK_THAT(changed("kind", "ssn"), Contains("kind 'ssn'"));
  CHECK_THAT(changed("progress", "{}"), Contains("'progress'"));
  CHECK_THAT(changed("progress", R"({"steps":1,"sums":[0,0,0],"curve":[[1,1,1]],"best_epoch":0})"),
             Contains("contradicts itself"));
  std::string flipped = bytes;
  flipped[flipped.size() - 4] ^= 1;  // the last bit of the last number
  write_file(file, flipped);
  CHECK_THAT(message(options(1), training), Contains("checksum differs"));
  write_network(file, network, Precision::single);
  CHECK_THAT(message(options(1), training), Contains("format is 'itn.network'"));
  write_file(file, std::string_view(bytes).substr(0, bytes.size() / 2));
  CHECK_THAT(message(options(1), training), Contains("truncated") || Contains("are there"));
}

TEST_CASE("Training options that cannot be are usage errors") {
  const MadeUpExamples eight(8, 1), none(0, 1);
  Network network = small_network();
  const auto make = [&](TrainingOptions chosen, const Examples& training, const Examples& validation) {
    Trainer trainer(network, training, validation, std::move(chosen));
  };
  CHECK_NOTHROW(make(options(1), eight, eight));
  CHECK_THROWS_AS(make(options(0), eight, eight), UsageError);
  CHECK_THROWS_AS(make(options(1), none, eight), UsageError);
  CHECK_THROWS_AS(make(options(1), eight, none), UsageError);
  TrainingOptions chosen = options(1);
  chosen.batch = 9;
  CHECK_THROWS_AS(make(chosen, eight, eight), UsageError);
  chosen = options(1);
  chosen.image_weight = 1;
  CHECK_THROWS_AS(make(chosen, eight, eight), UsageError);
  chosen = options(1);
  chosen.validated_by_images = true;
  CHECK_THROWS_AS(make(chosen, eight, eight), UsageError);
  chosen = options(1);
  chosen.first_learning_rate = 0;
  CHECK_THROWS_AS(make(chosen, eight, eight), UsageError);
}

TEST_CASE("Every epoch is another look at the examples") {
  MadeUpExamples training(16, 1), validation(8, 2);
  std::vector<MadeUpExamples::Seen> trained, validated;
  training.seen = &trained;
  validation.seen = &validated;
  Network network = small_network();
  Trainer trainer(network, training, validation, options(2));
  while (!trainer.finished()) trainer.step();
  REQUIRE(trained.size() == 32);
  for (std::size_t i = 0; i < 32; ++i) CHECK(trained[i].look == i / 16);
  CHECK(validated.size() == 16);
  for (const MadeUpExamples::Seen& read : validated) CHECK(read.look == 0);
}

TEST_CASE("A distribution is learnt by likelihood: it says how far off it is, and goes on where it was stopped") {
  const MadeUpExamples training(64, 1), validation(200, 2);
  NetworkDescription description{"rn", 1, SIZE, outputs, 2};
  description.distribution = true;
  description.spread = {1, 1};
  const auto begin = [&] {
    Network network(description);
    network.initialise(1);
    return network;
  };
  Network whole = begin(), stopped = begin(), gone_on = begin();
  Trainer trainer(whole, training, validation, options(40));
  while (!trainer.finished()) trainer.step();
  trainer.restore_best();
  const TemporaryFolder folder;
  Trainer first(stopped, training, validation, options(40));
  for (int i = 0; i < 11; ++i) first.step();
  first.write_checkpoint(folder / "checkpoint.safetensors");
  Trainer second(gone_on, training, validation, options(40));
  second.read_checkpoint(folder / "checkpoint.safetensors");
  while (!second.finished()) second.step();
  second.restore_best();
  CHECK(same_weights(whole, gone_on));

  // A share of which nothing is known is uniform over 0.8, which costs log(0.8).
  CHECK(trainer.curve()[trainer.best_epoch()].validation < std::log(0.8) - 0.5);
  std::vector<double> square(2);
  for (std::size_t i = 0; i < validation.count(); ++i) {
    std::vector<float> image(SIZE * SIZE);
    std::vector<double> truth(2);
    validation.read(i, 0, image, truth);
    const Calibration c = calibration_of(whole.forward(image, 1), truth, description);
    for (std::size_t p = 0; p < 2; ++p) square[p] += c.score[p] * c.score[p] / static_cast<double>(validation.count());
  }
  for (const double mean : square) {
    CHECK(mean > 0.5);
    CHECK(mean < 2);
  }
}

TEST_CASE("An image loss needs a network without a distribution") {
  const MadeUpExamples training(64, 1), validation(32, 2);
  NetworkDescription description{"rn", 1, SIZE, outputs, 2};
  description.distribution = true;
  description.spread = {1, 1};
  Network network(description);
  MadeUpImageLoss image_loss;
  CHECK_THROWS_WITH(Trainer(network, training, validation, options(6), &image_loss), Contains("no distribution"));
}
