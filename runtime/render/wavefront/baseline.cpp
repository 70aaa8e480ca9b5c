#include "runtime/render/wavefront/baseline.h"

#include <cstdint>
#include <cstring>
#include <utility>

namespace itn {

BaselineTable::BaselineTable(int cells, int throughput_channels, int radiance_channels)
    : throughput_channels_(static_cast<std::size_t>(throughput_channels)),
      radiance_channels_(static_cast<std::size_t>(radiance_channels)),
      sums_(static_cast<std::size_t>(cells) * throughput_channels_) {}

void BaselineTable::add(const std::vector<float>& samples, int stride, std::span<const float> visits) {
  const std::size_t size = BASELINE_VISIT_SIZE(throughput_channels_, radiance_channels_),
                    a_path = BASELINE_VISITS * size;
  for (std::size_t path = 0; path * a_path < visits.size(); ++path) {
    const float* sample = &samples[path * static_cast<std::size_t>(stride)];
    for (std::size_t r = 0; r < radiance_channels_; ++r) gathered_[r] += sample[r];
    for (std::size_t v = 0; v < BASELINE_VISITS; ++v) {
      const float* visit = &visits[path * a_path + v * size];
      std::int32_t cell = 0;
      std::memcpy(&cell, visit, sizeof cell);
      if (cell == 0) continue;
      const float* weight = visit + 1;
      const float* before = weight + throughput_channels_;
      for (std::size_t c = 0; c < throughput_channels_; ++c) {
        // A throughput channel stands for its radiance channel, or for the mean of all.
        double future = 0;
        if (throughput_channels_ == 1)
          for (std::size_t r = 0; r < radiance_channels_; ++r)
            future += (sample[r] - before[r]) / static_cast<double>(radiance_channels_);
        else
          future = sample[c] - before[c];
        Sums& sums = sums_[static_cast<std::size_t>(cell - 1) * throughput_channels_ + c];
        sums.products += static_cast<double>(weight[c]) * future;
        sums.squares += static_cast<double>(weight[c]) * static_cast<double>(weight[c]);
      }
    }
  }
}

std::vector<float> BaselineTable::futures() const {
  std::vector<float> result;
  result.reserve(sums_.size());
  for (const Sums& sums : sums_)
    result.push_back(sums.squares > 0 ? static_cast<float>(sums.products / sums.squares) : 0.0F);
  return result;
}

std::array<float, 3> BaselineTable::take_tint() {
  const std::array<double, 3> gathered = std::exchange(gathered_, {});
  const double all = gathered[0] + gathered[1] + gathered[2];
  std::array<float, 3> tint{1, 1, 1};
  if (throughput_channels_ == 1 && radiance_channels_ == 3 && all > 0)
    for (std::size_t c = 0; c < 3; ++c) tint[c] = static_cast<float>(3 * gathered[c] / all);
  return tint;
}

}  // namespace itn
