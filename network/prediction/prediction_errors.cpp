#include "network/prediction/prediction_errors.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "itn/error.h"
#include "network/training/dataset_examples.h"

namespace itn {
namespace {

bool is_test(const Manifest::Image& image) {
  return image.split != Manifest::Split::train && image.split != Manifest::Split::validation;
}

double mean_in_training(const Manifest& set, const std::string& name) {
  double sum = 0, count = 0;
  for (const Manifest::Image& image : set.images)
    if (image.split == Manifest::Split::train) {
      sum += parameter_of(image, name);
      count += 1;
    }
  return sum / count;
}

}  // namespace

std::vector<std::string> test_images(const std::string& folder, const Manifest& set) {
  std::vector<std::string> files;
  for (const Manifest::Image& image : set.images)
    if (is_test(image)) files.push_back((std::filesystem::path(folder) / image.file).string());
  if (files.empty())
    throw InputError(manifest_file(folder) +
                     ": has no images to test with (unseen_light, unseen_shape, unseen_both); name some");
  return files;
}

JudgeErrors errors_of_judge(Network& judge, const std::string& folder, const Manifest& set, std::uint64_t seed,
                            const std::atomic<bool>& cancel) {
  DatasetImages images;
  for (const Manifest::Split split :
       {Manifest::Split::unseen_light, Manifest::Split::unseen_shape, Manifest::Split::unseen_both})
    if (std::any_of(set.images.begin(), set.images.end(), [&](const auto& image) { return image.split == split; }))
      append(images, read_images(folder, set, split, wanted_by(judge.description()), cancel));
  const NetworkDescription& description = judge.description();
  const JudgedExamples examples(images, description, {.seed = seed}, description.outputs.size() - 1);
  return judge_errors(predict(judge, examples), description.limit);
}

std::vector<ParameterError> errors_on(const Manifest& set, const PredictedImages& predicted) {
  std::vector<const Manifest::Image*> images;
  for (const Manifest::Image& image : set.images)
    if (is_test(image)) images.push_back(&image);
  const auto count = static_cast<double>(images.size());
  std::vector<ParameterError> errors;
  for (std::size_t p = 0; p < predicted.network.outputs.size(); ++p) {
    ParameterError error{predicted.network.outputs[p].name};
    const double constant = mean_in_training(set, error.name);
    bool has_intervals = true;
    for (std::size_t i = 0; i < images.size(); ++i) {
      const double truth = parameter_of(*images[i], error.name);
      const ParameterEstimate& said = predicted.images[i].parameters[p];
      error.root_mean_square += (said.value - truth) * (said.value - truth) / count;
      error.mean_absolute += std::fabs(said.value - truth) / count;
      error.constant += std::fabs(constant - truth) / count;
      error.held += (said.low <= truth && truth <= said.high ? 1 : 0) / count;
      has_intervals &= std::isfinite(said.low);
    }
    error.root_mean_square = std::sqrt(error.root_mean_square);
    if (!has_intervals) error.held = std::numeric_limits<double>::quiet_NaN();
    errors.push_back(error);
  }
  return errors;
}

}  // namespace itn
