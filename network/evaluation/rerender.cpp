#include "network/evaluation/rerender.h"

#include <algorithm>

#include "runtime/base/random.h"

namespace itn {
namespace {

constexpr std::int64_t batch_paths = 1 << 22;  // seconds, even on a CPU
constexpr std::int64_t most_images = 64;       // memory: every group of samples is an image of its own

}  // namespace

std::uint64_t image_seed(std::uint64_t seed, EvaluationStream stream, std::uint64_t index) {
  return random_bits(seed, static_cast<std::uint64_t>(stream), index);
}

std::size_t images_per_batch(int size, int spp) {
  const std::int64_t paths = std::int64_t{size} * size * spp;
  return static_cast<std::size_t>(std::clamp<std::int64_t>(batch_paths / paths, 1, most_images));
}

void in_batches(std::size_t count, std::size_t at_once, const std::function<void(std::size_t, std::size_t)>& call) {
  for (std::size_t first = 0; first < count; first += at_once) call(first, std::min(count, first + at_once));
}

std::vector<Rendering> rerender(RenderedLoss& renderer, const std::vector<RerenderedImage>& images, int size, int spp,
                                const std::function<void(std::size_t)>& after) {
  std::vector<Rendering> result;
  in_batches(images.size(), images_per_batch(size, spp), [&](std::size_t first, std::size_t end) {
    const auto at = images.begin();
    for (Rendering& rendering : renderer.render(std::vector<RerenderedImage>(at + static_cast<std::ptrdiff_t>(first),
                                                                             at + static_cast<std::ptrdiff_t>(end)),
                                                spp))
      result.push_back(std::move(rendering));
    if (after) after(end);
  });
  return result;
}

}  // namespace itn
