// Selects a few of a data set's images, which stand for all, to be rendered again.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "network/dataset/manifest.h"

namespace itn {

// `count` of the images (all, if there are no more), in their order. Systematic sampling: with the images sorted by
// split, shape and light, every k-th from a random one on; each is chosen with equal probability, and splits, shapes
// and lights have their share to within one image.
std::vector<Manifest::Image> choose(const std::vector<Manifest::Image>& images, std::size_t count, std::uint64_t seed);

// `count` of each shape's images.
std::vector<Manifest::Image> choose_of_each_shape(const std::vector<Manifest::Image>& images, std::size_t count,
                                                  std::uint64_t seed);

}  // namespace itn
