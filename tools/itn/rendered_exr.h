// An image as the file that `itn render` writes.
#pragma once
#include <string>
#include <vector>

#include "itn/exr.h"
#include "itn/renderer.h"

namespace itn::tools {

// Facts that the image does not say of itself.
struct RenderedExr {
  std::string scene;  // file
  std::vector<std::string> derivatives;
  std::uint64_t seed = 0;
  Operator op = Operator::full;
};

// scene: with the values of its parameters that were rendered.
ExrImage to_exr(const Rendering& image, const Scene& scene, const RenderedExr& about, const Device& device);

}  // namespace itn::tools
