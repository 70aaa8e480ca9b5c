#include "runtime/scene/mesh/hole_filling.h"

#include <limits>

#include "runtime/scene/transform.h"

namespace itn {
namespace {

// The chain of corners from `first` to `last` and the chord between them.
struct Chain {
  double area = 0;           // of its best triangulation
  std::uint32_t middle = 0;  // the third corner of the triangle at the chord
};

}  // namespace

std::vector<std::array<std::uint32_t, 3>> triangulate_loop(const std::vector<Vec3>& loop) {
  const std::size_t n = loop.size();
  std::vector<Chain> chains(n * n);
  const auto chain = [&](std::size_t first, std::size_t last) -> Chain& { return chains[first * n + last]; };
  for (std::size_t span = 2; span < n; ++span) {
    for (std::size_t first = 0; first + span < n; ++first) {
      const std::size_t last = first + span;
      Chain best{std::numeric_limits<double>::infinity(), 0};
      for (std::size_t k = first + 1; k < last; ++k) {
        const double area = chain(first, k).area + chain(k, last).area +
                            length(cross(loop[k] - loop[first], loop[last] - loop[first])) / 2;
        if (area < best.area) best = {area, static_cast<std::uint32_t>(k)};
      }
      chain(first, last) = best;
    }
  }
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::array<std::uint32_t, 2>> open{{0, static_cast<std::uint32_t>(n - 1)}};
  while (!open.empty()) {
    const auto [first, last] = open.back();
    open.pop_back();
    if (last - first < 2) continue;
    const std::uint32_t k = chain(first, last).middle;
    triangles.push_back({first, k, last});
    open.push_back({first, k});
    open.push_back({k, last});
  }
  return triangles;
}

}  // namespace itn
