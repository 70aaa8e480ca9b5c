#include <algorithm>
#include <limits>
#include <numbers>

#include "itn/colour.h"
#include "runtime/render/compile/environment/fill.h"

namespace itn {
namespace {

constexpr double pi = std::numbers::pi;

[[noreturn]] void refuse_pixel(const Environment& environment, std::size_t x, std::size_t y, std::size_t c,
                               float value) {
  const auto got = fmt::format("{} at column {}, row {}, channel {}", value, x, y, c);
  if (!not_negative(value)) refuse(environment, "bitmap", "finite and not negative", got, "repair the image");
  refuse(environment, "bitmap", "in the range of 32-bit floats once scaled", got, "lower the scale");
}

}  // namespace

void envmap_fill(const Environment& environment, EnvironmentRecord& record, std::vector<float>& tables) {
  require(environment.bitmap != nullptr, environment, "bitmap", "an image", "none");
  const Bitmap& bitmap = *environment.bitmap;
  require(bitmap.width >= 2 && bitmap.height >= 3, environment, "bitmap", "at least 2 x 3 pixels",
          fmt::format("{} x {}", bitmap.width, bitmap.height), "for light of one colour use a constant emitter");
  const double scale = environment.number("scale");
  require(not_negative(scale), environment, "scale", "finite and not negative", scale);
  const auto width = static_cast<std::size_t>(bitmap.width), height = static_cast<std::size_t>(bitmap.height);
  const auto channels = static_cast<std::size_t>(bitmap.channels);
  require(tables.size() + 4 * (width + 2) * (height + 1) < std::numeric_limits<int>::max(), environment, "bitmap",
          "small enough to address with 31 bits", fmt::format("{} x {} pixels", width, height), "scale it down");

  std::fill_n(record.radiance, 3, static_cast<float>(scale));
  record.width = bitmap.width;
  record.height = bitmap.height;
  record.values = static_cast<int>(tables.size());
  tables.reserve(tables.size() + 3 * (width + 1) * height + height * (width + 2));
  std::vector<double> light(width * height);
  for (std::size_t y = 0; y < height; ++y)
    for (std::size_t x = 0; x <= width; ++x) {
      Rgb rgb;
      for (std::size_t c = 0; c < 3; ++c) {
        const float value = bitmap.data[(y * width + x % width) * channels + (channels == 1 ? 0 : c)];
        rgb[c] = scale * value;
        if (!(not_negative(value) && rgb[c] <= std::numeric_limits<float>::max()))
          refuse_pixel(environment, x, y, c, value);
        tables.push_back(value);
      }
      if (x < width) light[y * width + x] = luminance(rgb);
    }

  // A cell lies between four pixels.
  std::vector<double> weight;
  double squares = 0;
  const double step = pi / static_cast<double>(height - 1);
  for (std::size_t y = 0; y + 1 < height; ++y) {
    const double solid_angle =
        2 * std::sin((static_cast<double>(y) + 0.5) * step) * std::sin(step / 2) * 2 * pi / static_cast<double>(width);
    for (std::size_t x = 0; x < width; ++x) {
      const std::size_t left = y * width + x, right = y * width + (x + 1) % width;
      const double mean = (light[left] + light[right] + light[left + width] + light[right + width]) / 4;
      weight.push_back(solid_angle * mean);
      squares += solid_angle * mean * mean;
    }
  }
  record.sampling = append_sampling(weight, height - 1, width, tables);
  const double all = sum(weight);
  record.sky_weight = static_cast<float>(all);
  record.concentration = all > 0 ? static_cast<float>(4 * pi * squares / (all * all)) : 0.0F;
}

// Linear in its scale, and in its pixels: by all of them alike, as a picture of ones has it.
void envmap_move(const Environment& /*environment*/, const Parameter& p, EnvironmentRecord& moving,
                 std::vector<float>& tables) {
  if (!p.by_texels) return move_radiance(p, moving);
  moving.width = 1;
  moving.height = 2;
  moving.values = static_cast<int>(tables.size());
  tables.insert(tables.end(), 3 * static_cast<std::size_t>((moving.width + 1) * moving.height), 1.0F);
}

}  // namespace itn
