#include "tools/itn/rendered_exr.h"

#include <nlohmann/json.hpp>

#include "itn/parameters.h"
#include "itn/version.h"
#include "tools/itn/common.h"

namespace itn::tools {

ExrImage to_exr(const Rendering& image, const Scene& scene, const RenderedExr& about, const Device& device) {
  const std::size_t channels = static_cast<std::size_t>(image.channels);
  ExrImage exr{image.width, image.height, {}, {}, {}};
  const std::vector<std::string> letters =
      channels == 1 ? std::vector<std::string>{"Y"} : std::vector<std::string>{"R", "G", "B"};
  const auto add = [&](const std::string& prefix) {
    for (const std::string& letter : letters) exr.channels.push_back(prefix + letter);
  };
  add("");
  add("stderr.");
  for (const std::string& name : about.derivatives) {
    add("derivative." + name + ".");
    add("derivative_stderr." + name + ".");
  }
  const std::size_t pixels = image.mean.size() / channels;
  const auto store = [&](const Image& from, std::size_t pixel) {
    for (std::size_t c = 0; c < channels; ++c) exr.data.push_back(from.mean[pixel * channels + c]);
    for (std::size_t c = 0; c < channels; ++c) exr.data.push_back(from.stderr_[pixel * channels + c]);
  };
  exr.data.reserve(pixels * exr.channels.size());
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    store(image, pixel);
    for (const Image& derivative : image.derivatives) store(derivative, pixel);
  }
  nlohmann::ordered_json parameters = nlohmann::ordered_json::object();
  for (const Parameter& p : list_parameters(scene)) parameters[p.name] = p.value;
  exr.header = {{"scene", about.scene},
                {"parameters", parameters.dump()},
                {"spp", std::to_string(image.spp)},
                {"seed", std::to_string(about.seed)},
                {"operator", name_of(about.op)},
                {"device", device.info().name + " (" + device.info().platform + ", " + device.info().driver + ")"},
                {"version", std::string("itn ") + version()},
                // OpenEXR's own name for it: readers that know "version" as a number of multi-part files hide the text.
                {"software", std::string("itn ") + version()}};
  return exr;
}

}  // namespace itn::tools
