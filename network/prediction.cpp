#include "network/prediction.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "network/loss.h"

namespace itn {
namespace {

constexpr std::size_t AT_ONCE = 32;

void append(std::vector<double>& to, const std::vector<double>& from) { to.insert(to.end(), from.begin(), from.end()); }

}  // namespace

Predictions predict(Network& network, const Examples& examples) {
  Predictions result;
  result.outputs = network.description().outputs.size();
  for (std::size_t first = 0; first < examples.count(); first += AT_ONCE) {
    std::vector<std::size_t> indices(std::min(AT_ONCE, examples.count() - first));
    std::iota(indices.begin(), indices.end(), first);
    const Batch batch = read_batch(examples, indices, network);
    const std::vector<float>& outputs = network.forward(batch.images, static_cast<int>(indices.size()));
    append(result.predicted, parameters_of(outputs, network.description().outputs));
    append(result.truth, batch.truth);
  }
  return result;
}

std::vector<double> root_mean_square_errors(const Predictions& predictions) {
  std::vector<double> squares(predictions.outputs);
  for (std::size_t i = 0; i < predictions.truth.size(); ++i) {
    const double difference = predictions.predicted[i] - predictions.truth[i];
    squares[i % predictions.outputs] += difference * difference;
  }
  for (double& square : squares)
    square =
        std::sqrt(square * static_cast<double>(predictions.outputs) / static_cast<double>(predictions.truth.size()));
  return squares;
}

}  // namespace itn
