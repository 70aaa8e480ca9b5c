// Errors of a network on a data set's test images.
#pragma once
#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "network/dataset/manifest.h"
#include "network/prediction/predict_images.h"
#include "network/training/judge.h"

namespace itn {

// The files of the images of unseen_light, unseen_shape and unseen_both. Throws InputError: there are none.
std::vector<std::string> test_images(const std::string& folder, const Manifest& set);

// Errors of a judge on the test images, each as it is, and spoilt as often as there are faults. Throws as
// predict_images().
JudgeErrors errors_of_judge(Network& judge, const std::string& folder, const Manifest& set, std::uint64_t seed,
                            const std::atomic<bool>& cancel);

// Errors of one parameter, in its unit.
struct ParameterError {
  std::string name;
  double root_mean_square = 0, mean_absolute = 0;
  double constant = 0;  // mean absolute error of who always says the mean of the training images
  double held = 0;      // share of the intervals of 95 % that hold the truth; NaN where there are none
};

// One an output of the network. predicted: of test_images(), in their order, in 1/mm.
std::vector<ParameterError> errors_on(const Manifest& set, const PredictedImages& predicted);

}  // namespace itn
