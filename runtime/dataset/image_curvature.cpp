#include "runtime/dataset/image_curvature.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "runtime/base/error.h"

namespace itn {

const char* const curvature_attribute = "curvature";

ImageCurvature image_curvature(const Rendering& a, const Rendering& b, double sigma_t,
                               const std::vector<double>& mask) {
  const std::array<double, 3> scale{sigma_t, 1, 1};  // d by log sigma_t = sigma_t d by sigma_t
  ImageCurvature sum{};
  double count = 0;
  for (std::size_t pixel = 0; pixel < mask.size(); ++pixel) {
    if (!(mask[pixel] > 0)) continue;
    count += 1;
    const auto of = [&](const Rendering& half, std::size_t i) { return scale[i] * half.derivatives[i].mean[pixel]; };
    std::size_t entry = 0;
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = i; j < 3; ++j) sum[entry++] += (of(a, i) * of(b, j) + of(b, i) * of(a, j)) / 2;
  }
  for (double& value : sum) value /= count;
  return sum;
}

std::string to_text(const ImageCurvature& curvature) { return fmt::format("[{}]", fmt::join(curvature, ",")); }

ImageCurvature read_curvature(const std::string& text, const std::string& file) {
  const auto json = nlohmann::json::parse(text, nullptr, false);
  ImageCurvature curvature{};
  if (!json.is_array() || json.size() != curvature.size() ||
      !std::all_of(json.begin(), json.end(), [](const auto& value) { return value.is_number(); }))
    throw InputError(fmt::format("{}: its attribute {} is {}; need a list of {} numbers", file, curvature_attribute,
                                 text, curvature.size()));
  std::copy(json.begin(), json.end(), curvature.begin());
  return curvature;
}

}  // namespace itn
