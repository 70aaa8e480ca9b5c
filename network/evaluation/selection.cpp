#include "network/evaluation/selection.h"

#include <algorithm>
#include <map>
#include <tuple>

#include "runtime/base/random.h"

namespace itn {

std::vector<Manifest::Image> choose(const std::vector<Manifest::Image>& images, std::size_t count, std::uint64_t seed) {
  if (count >= images.size()) return images;
  std::vector<std::size_t> sorted(images.size());
  for (std::size_t i = 0; i < images.size(); ++i) sorted[i] = i;
  // Within a cell in random order: materials follow a sequence, and every k-th of that might be alike.
  const auto key = [&](std::size_t i) {
    return std::tuple(images[i].split, images[i].shape, images[i].light, random_bits(seed, 1, i));
  };
  std::sort(sorted.begin(), sorted.end(), [&](std::size_t a, std::size_t b) { return key(a) < key(b); });
  const double step = static_cast<double>(images.size()) / static_cast<double>(count);
  const double first = step * random_uniform(seed, 0, 0);
  std::vector<std::size_t> chosen;
  for (std::size_t k = 0; k < count; ++k)
    chosen.push_back(
        sorted[std::min(images.size() - 1, static_cast<std::size_t>(first + static_cast<double>(k) * step))]);
  std::sort(chosen.begin(), chosen.end());
  std::vector<Manifest::Image> result;
  result.reserve(chosen.size());
  for (const std::size_t i : chosen) result.push_back(images[i]);
  return result;
}

std::vector<Manifest::Image> choose_of_each_shape(const std::vector<Manifest::Image>& images, std::size_t count,
                                                  std::uint64_t seed) {
  std::map<int, std::vector<Manifest::Image>> of_shape;
  for (const Manifest::Image& image : images) of_shape[image.shape].push_back(image);
  std::vector<Manifest::Image> result;
  for (const auto& [shape, own] : of_shape)
    for (const Manifest::Image& image : choose(own, count, random_bits(seed, 2, static_cast<std::uint64_t>(shape))))
      result.push_back(image);
  return result;
}

}  // namespace itn
