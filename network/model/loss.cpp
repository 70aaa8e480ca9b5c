#include "itn/loss.h"

#include <cmath>

#include "itn/distribution.h"

namespace itn {

OutputLoss supervised_loss(std::span<const float> outputs, std::span<const double> truth,
                           const std::vector<OutputRange>& ranges) {
  OutputLoss result{0, std::vector<float>(outputs.size())};
  const auto count = static_cast<double>(outputs.size());
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const double output = outputs[i];
    const double difference = share_of_output(output) - ranges[i % ranges.size()].share(truth[i]);
    result.loss += difference * difference / count;
    result.gradient[i] = static_cast<float>(2 * difference * share_derivative(output) / count);
  }
  return result;
}

OutputLoss training_loss(std::span<const float> outputs, std::span<const double> truth,
                         const NetworkDescription& network) {
  return network.distribution ? likelihood_loss(outputs, truth, network.outputs)
                              : supervised_loss(outputs, truth, network.outputs);
}

std::vector<double> parameters_of(std::span<const float> outputs, const NetworkDescription& network) {
  std::vector<double> parameters;
  for (std::size_t first = 0; first < outputs.size(); first += network.raw_outputs())
    for (std::size_t i = 0; i < network.outputs.size(); ++i)
      parameters.push_back(network.outputs[i].parameter(outputs[first + i]));
  return parameters;
}

void add_image_loss(OutputLoss& loss, const ImageLoss::Result& image, double weight, std::span<const float> outputs,
                    const std::vector<OutputRange>& ranges) {
  loss.loss += weight * image.loss;
  const std::size_t n = ranges.size();
  // An output's part of the supervised loss's gradient is at most 2 s^2 (1 - s) over their number, greatest at s = 2/3.
  const double longest = 2 * (4.0 / 27) * std::sqrt(static_cast<double>(n)) / static_cast<double>(outputs.size());
  std::vector<double> gradient(n);
  for (std::size_t first = 0; first < outputs.size(); first += n) {
    double square = 0;
    for (std::size_t i = 0; i < n; ++i) {
      gradient[i] = weight * image.gradient[first + i] * ranges[i].parameter_derivative(outputs[first + i]);
      square += gradient[i] * gradient[i];
    }
    const double shorter = square > longest * longest ? longest / std::sqrt(square) : 1;
    for (std::size_t i = 0; i < n; ++i) loss.gradient[first + i] += static_cast<float>(shorter * gradient[i]);
  }
}

}  // namespace itn
