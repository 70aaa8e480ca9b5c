#include "runtime/image/noise.h"

#include <algorithm>
#include <cmath>

namespace itn {
namespace {

std::size_t pixel_at(const PixelView& picture, int x, int y) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width) + static_cast<std::size_t>(x);
}

double value_of(const PixelView& picture, std::size_t pixel, int channel) {
  return picture.value[pixel * static_cast<std::size_t>(picture.channels) + static_cast<std::size_t>(channel)];
}

// Pixel value and absolute response of Immerkaer's mask (whose variance is 36 times the noise's), at pixels that have
// weight and whose neighbours all have.
struct Answer {
  double value, size;
};

std::vector<Answer> answers_of(const PixelView& picture, int channel) {
  constexpr double enough = 1 << 18;
  const double pixels = static_cast<double>(picture.width) * picture.height;
  const int stride = std::max(1, static_cast<int>(std::sqrt(pixels / enough)));
  std::vector<Answer> answers;
  for (int y = 1; y + 1 < picture.height; y += stride)
    for (int x = 1; x + 1 < picture.width; x += stride) {
      double answer = 0, mean = 0;
      bool counts = true;
      for (int j = -1; j <= 1; ++j)
        for (int i = -1; i <= 1; ++i) {
          const std::size_t pixel = pixel_at(picture, x + i, y + j);
          const double value = value_of(picture, pixel, channel);
          counts &= picture.weight[pixel] > 0;
          answer += (i == 0 ? 2 : -1) * (j == 0 ? 2 : -1) * value;
          mean += value / 9;
        }
      if (counts) answers.push_back({mean, std::fabs(answer)});
    }
  return answers;
}

// Variance of the photons' noise over the value: the median over groups of pixels of similar values.
double gain_of(std::vector<Answer> answers, const Rounding& rounding) {
  constexpr std::size_t most_groups = 16, wanted_in_group = 64, least = 16;
  constexpr double normal_median = 0.6744897501960817, mask = 6;
  std::sort(answers.begin(), answers.end(), [](const Answer& a, const Answer& b) { return a.value < b.value; });
  if (answers.size() < least) return 0;
  const std::size_t groups = std::clamp<std::size_t>(answers.size() / wanted_in_group, 1, most_groups);
  std::vector<double> gains;
  for (std::size_t g = 0; g < groups; ++g) {
    const auto begin = answers.begin() + static_cast<std::ptrdiff_t>(g * answers.size() / groups),
               end = answers.begin() + static_cast<std::ptrdiff_t>((g + 1) * answers.size() / groups);
    const auto middle = begin + (end - begin) / 2;
    const double value = middle->value;
    std::nth_element(begin, middle, end, [](const Answer& a, const Answer& b) { return a.size < b.size; });
    const double noise = middle->size / normal_median / mask;
    if (const std::optional<double> rounded = rounding(value))
      gains.push_back(std::max(0.0, noise * noise - *rounded * *rounded) / value);
  }
  if (gains.empty()) return 0;
  const auto middle = gains.begin() + static_cast<std::ptrdiff_t>(gains.size() / 2);
  std::nth_element(gains.begin(), middle, gains.end());
  return *middle;
}

// Mean of the up to eight pixels around that count, at least 0.
double mean_around(const PixelView& picture, int x, int y, int channel) {
  double sum = 0;
  int count = 0;
  for (int j = std::max(0, y - 1); j <= std::min(picture.height - 1, y + 1); ++j)
    for (int i = std::max(0, x - 1); i <= std::min(picture.width - 1, x + 1); ++i) {
      const std::size_t pixel = pixel_at(picture, i, j);
      if ((i == x && j == y) || !(picture.weight[pixel] > 0)) continue;
      sum += value_of(picture, pixel, channel);
      ++count;
    }
  return count > 0 ? std::max(0.0, sum / count) : 0;
}

}  // namespace

void add_photon_noise(const PixelView& picture, const Rounding& rounding, std::vector<float>& noise) {
  for (int channel = 0; channel < picture.channels; ++channel) {
    const double gain = gain_of(answers_of(picture, channel), rounding);
    if (gain == 0) continue;
    for (int y = 0; y < picture.height; ++y)
      for (int x = 0; x < picture.width; ++x) {
        float& of = noise[pixel_at(picture, x, y) * static_cast<std::size_t>(picture.channels) +
                          static_cast<std::size_t>(channel)];
        const double square = static_cast<double>(of) * static_cast<double>(of);
        of = static_cast<float>(std::sqrt(square + gain * mean_around(picture, x, y, channel)));
      }
  }
}

}  // namespace itn
