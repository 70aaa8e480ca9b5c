#include "network/training/prediction.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "itn/distribution.h"
#include "runtime/base/statistics.h"

namespace itn {
namespace {

constexpr std::size_t AT_ONCE = 32;

void append(std::vector<double>& to, const std::vector<double>& from) { to.insert(to.end(), from.begin(), from.end()); }

// each(batch, raw outputs)
template <class Each>
void for_each_batch(Network& network, const Examples& examples, const Each& each) {
  for (std::size_t first = 0; first < examples.count(); first += AT_ONCE) {
    std::vector<std::size_t> indices(std::min(AT_ONCE, examples.count() - first));
    std::iota(indices.begin(), indices.end(), first);
    const Batch batch = read_batch(examples, indices, network);
    each(batch, network.forward(batch.images, static_cast<int>(indices.size())));
  }
}

}  // namespace

Predictions predict(Network& network, const Examples& examples) {
  Predictions result;
  result.outputs = network.description().outputs.size();
  for_each_batch(network, examples, [&](const Batch& batch, const std::vector<float>& outputs) {
    append(result.predicted, parameters_of(outputs, network.description()));
    append(result.truth, batch.truth);
  });
  return result;
}

std::vector<double> calibrated_spread(Network& network, const Examples& held_out) {
  const NetworkDescription& description = network.description();
  const std::size_t n = description.outputs.size(), raw_count = description.raw_outputs();
  std::vector<std::vector<double>> scores(n);  // of what the network says without any spread of its own
  for_each_batch(network, held_out, [&](const Batch& batch, const std::vector<float>& outputs) {
    for (std::size_t i = 0; (i + 1) * n <= batch.truth.size(); ++i) {
      const Calibration c = calibration_of(std::span(outputs).subspan(i * raw_count, raw_count),
                                           std::span(batch.truth).subspan(i * n, n), description);
      for (std::size_t p = 0; p < n; ++p) scores[p].push_back(std::fabs(c.score[p]) * description.spread[p]);
    }
  });
  const auto count = static_cast<double>(held_out.count());
  const auto rank = static_cast<std::size_t>(std::ceil(0.95 * (count + 1)));  // from 1
  if (rank > held_out.count()) return std::vector<double>(n, 1);
  std::vector<double> spread;
  for (std::vector<double>& s : scores) {
    std::nth_element(s.begin(), s.begin() + static_cast<std::ptrdiff_t>(rank - 1), s.end());
    spread.push_back(s[rank - 1] / normal_quantile(0.975));
  }
  return spread;
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
