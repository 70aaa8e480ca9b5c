#include "runtime/render/rendering_warnings.h"

#include <fmt/core.h>

#include <algorithm>

namespace itn {
namespace {

bool is_zero(const std::vector<float>& values) {
  return std::all_of(values.begin(), values.end(), [](float v) { return v == 0; });
}

}  // namespace

std::vector<std::string> warnings_of(const Rendering& image, const Scene& scene) {
  std::vector<std::string> warnings;
  constexpr double few = 1e-5;  // rounding alone stays far below
  if (static_cast<double>(image.misplaced) > few * static_cast<double>(image.paths))
    warnings.push_back(
        fmt::format("{}: {} paths met {} surfaces from the side where they cannot be: shapes that overlap or are "
                    "not closed, or a camera inside of a shape without its medium; the image is wrong there",
                    scene.file, image.paths, image.misplaced));
  if (image.endless > 0)
    warnings.push_back(
        fmt::format("{}: {} of {} paths found no end and were stopped: the image is too dark, which its standard "
                    "error does not say; let the medium absorb or be less dense, or set max_depth",
                    scene.file, image.endless, image.paths));
  const bool has_light = scene.environment || !scene.lights.empty();
  if (has_light && is_zero(image.mean) && is_zero(image.stderr_))
    warnings.push_back(
        fmt::format("{}: none of {} paths found light: the standard error of 0 says nothing about what the "
                    "image should be; light may be hidden, or so deep in a medium that paths end before it",
                    scene.file, image.paths));
  return warnings;
}

}  // namespace itn
