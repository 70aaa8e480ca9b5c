#include "network/training/object_radiance.h"

#include <cmath>

namespace itn {

ObjectRadiance object_radiance(const DatasetImages& images, std::size_t example) {
  const std::vector<float>&radiance = images.radiance[example], &errors = images.errors[example],
        &mask = images.shapes[images.shape_of[example]].mask;
  ObjectRadiance result;
  double count = 0;
  for (std::size_t pixel = 0; pixel < mask.size(); ++pixel) {
    if (!(mask[pixel] > 0)) continue;
    result.mean_square += std::pow(double{radiance[pixel]}, 2);
    result.noise += std::pow(double{errors[pixel]}, 2);
    count += 1;
  }
  return {result.mean_square / count, result.noise / count};
}

double least_mean_square(const DatasetImages& training) {
  return std::pow(darkest_radiance * mean_luminance(training), 2);
}

}  // namespace itn
