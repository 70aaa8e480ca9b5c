#include "itn/bitmap.h"

#include "itn/error.h"
#include "itn/exr.h"
#include "itn/file.h"
#include "runtime/image/samples.h"
#include "runtime/image/srgb.h"

namespace itn {
namespace {

Bitmap bitmap_of_exr(const std::string& path) {
  const ExrImage image = read_exr(path);
  std::vector<int> from{image.channel("R"), image.channel("G"), image.channel("B")};
  if (from[0] < 0 || from[1] < 0 || from[2] < 0) from = {image.channel("Y")};
  if (from[0] < 0) {
    std::string names;
    for (const std::string& name : image.channels) names += " " + name;
    throw InputError(path + ": channels are" + names + "; need R, G and B, or Y");
  }
  Bitmap bitmap{image.width, image.height, static_cast<int>(from.size()), {}};
  bitmap.data.reserve(image.data.size() / image.channels.size() * from.size());
  for (std::size_t at = 0; at < image.data.size(); at += image.channels.size())
    for (const int channel : from) bitmap.data.push_back(image.data[at + static_cast<std::size_t>(channel)]);
  return bitmap;
}

}  // namespace

Bitmap read_bitmap(const std::string& path, bool raw) {
  const std::string bytes = read_file(path);
  if (is_exr(bytes)) return bitmap_of_exr(path);
  if (std::optional<HdrValues> hdr = read_hdr(bytes, path)) return {hdr->width, hdr->height, 3, std::move(hdr->data)};
  const Samples samples = read_samples(bytes, path);
  const auto channels = static_cast<std::size_t>(samples.channels),
             colours = static_cast<std::size_t>(samples.colours());
  Bitmap bitmap{samples.width, samples.height, samples.colours(), {}};
  bitmap.data.reserve(samples.data.size() / channels * colours);
  for (std::size_t at = 0; at < samples.data.size(); at += channels)
    for (std::size_t c = 0; c < colours; ++c) {
      const double encoded = samples.data[at + c] / 65535.0;
      bitmap.data.push_back(static_cast<float>(raw ? encoded : srgb_decode(encoded)));
    }
  return bitmap;
}

}  // namespace itn
