#include "network/loss.h"

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

std::vector<double> parameters_of(std::span<const float> outputs, const std::vector<OutputRange>& ranges) {
  std::vector<double> parameters(outputs.size());
  for (std::size_t i = 0; i < outputs.size(); ++i) parameters[i] = ranges[i % ranges.size()].parameter(outputs[i]);
  return parameters;
}

void add_image_loss(OutputLoss& loss, const ImageLoss::Result& image, double weight, std::span<const float> outputs,
                    const std::vector<OutputRange>& ranges) {
  loss.loss += weight * image.loss;
  for (std::size_t i = 0; i < outputs.size(); ++i)
    loss.gradient[i] +=
        static_cast<float>(weight * image.gradient[i] * ranges[i % ranges.size()].parameter_derivative(outputs[i]));
}

}  // namespace itn
