// The radiance to which an image's loss is relative.
#pragma once
#include "network/training/dataset_examples.h"

namespace itn {

// Means over the pixels that show the object.
struct ObjectRadiance {
  double mean_square = 0;  // of the radiance
  double noise = 0;        // of its standard errors
};

// example: of `images`, which have luminance and shapes.
ObjectRadiance object_radiance(const DatasetImages& images, std::size_t example);

// The mean square that an object has at least: darker ones count as black, or noise would decide. training: what the
// network learns from.
double least_mean_square(const DatasetImages& training);

}  // namespace itn
