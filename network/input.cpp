#include "network/input.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "runtime/base/colour.h"
#include "runtime/base/error.h"
#include "runtime/base/file.h"
#include "runtime/image/exr.h"

namespace itn {
namespace {

constexpr int any_size = 0;  // as long as it is square

void check_square(const std::string& file, int width, int height) {
  if (width != height)
    throw InputError(
        fmt::format("{}: has {} x {} pixels, need a square image; cut it, and give the camera of what is left", file,
                    width, height));
}

ExrImage read_square(const std::string& file, int size, const std::string& hash) {
  ExrImage image = read_exr(file);
  if (size == any_size) check_square(file, image.width, image.height);
  if (size != any_size && (image.width != size || image.height != size))
    throw InputError(fmt::format("{}: has {} x {} pixels, need {} x {}", file, image.width, image.height, size, size));
  const auto found = image.header.find("hash");
  if (!hash.empty() && (found == image.header.end() || found->second != hash))
    throw InputError(fmt::format("{}: is of another data set (hash {}, need {}); render it again", file,
                                 found == image.header.end() ? "none" : found->second, hash));
  return image;
}

// One channel of an image, row-major.
std::vector<float> plane(const ExrImage& image, const std::string& name, const std::string& file) {
  const int channel = image.channel(name);
  if (channel < 0)
    throw InputError(fmt::format("{}: has no channel {}, only {}", file, name, fmt::join(image.channels, ", ")));
  std::vector<float> values(image.data.size() / image.channels.size());
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = image.data[i * image.channels.size() + static_cast<std::size_t>(channel)];
  return values;
}

[[noreturn]] void fail_at(const std::string& file, int size, std::size_t pixel, const std::string& what) {
  const auto side = static_cast<std::size_t>(size);
  throw InputError(fmt::format("{}: pixel {}, {}: {}", file, pixel % side, pixel / side, what));
}

// One colour (luminance) or three, plane after plane, finite.
std::vector<float> finite_radiance(const ExrImage& image, const std::string& file, int colours,
                                   const std::string& prefix) {
  std::vector<float> radiance;
  const std::size_t pixels = image.data.size() / image.channels.size();
  const bool has_colours = image.channel(prefix + "R") >= 0, has_luminance = image.channel(prefix + "Y") >= 0;
  if (colours == 1 && has_luminance) {
    radiance = plane(image, prefix + "Y", file);
  } else if (has_colours) {
    for (const char* letter : {"R", "G", "B"}) {
      const std::vector<float> values = plane(image, prefix + letter, file);
      radiance.insert(radiance.end(), values.begin(), values.end());
    }
    if (colours == 1) {
      std::vector<float> luminance(pixels);
      for (std::size_t c = 0; c < 3; ++c) {
        const auto weight = static_cast<float>(luminance_weights[c]);
        for (std::size_t i = 0; i < pixels; ++i) luminance[i] += weight * radiance[c * pixels + i];
      }
      radiance = std::move(luminance);
    }
  } else {
    const std::string need = colours == 1 ? fmt::format("no channel {0}Y, nor {0}R, {0}G and {0}B", prefix)
                                          : fmt::format("no channels {0}R, {0}G and {0}B", prefix);
    throw InputError(fmt::format("{}: has {}; only {}", file, need, fmt::join(image.channels, ", ")));
  }
  for (std::size_t i = 0; i < radiance.size(); ++i)
    if (!std::isfinite(radiance[i]))
      fail_at(file, image.width, i % pixels, fmt::format("is {}, need a finite number", radiance[i]));
  return radiance;
}

std::vector<float> square_photo(const std::string& file, int colours, const PhotoOptions& options) {
  Photo photo = read_photo(file, options);
  if (colours == 1) photo = luminance_of(photo);
  check_square(file, photo.width, photo.height);
  if (photo.channels != colours)
    throw InputError(file + ": is grey, need colours: the network sees red, green and blue");
  const auto count = static_cast<std::size_t>(colours), pixels = photo.value.size() / count;
  std::vector<float> planes(photo.value.size());
  for (std::size_t i = 0; i < planes.size(); ++i) planes[i % count * pixels + i / count] = photo.value[i];
  return planes;
}

// What lies below 0 is noise, or no radiance. Nothing but black says nothing about an object.
void check_radiance(const std::vector<float>& luminance, const std::string& file) {
  double above = 0, below = 0;
  for (const float value : luminance) (value > 0 ? above : below) += std::fabs(static_cast<double>(value));
  constexpr double most_below = 0.1;
  if (below > most_below * above)
    throw InputError(
        fmt::format("{}: its pixels below 0 weigh {:.3g} of those above; need radiance: is it a difference, "
                    "or is black subtracted wrongly?",
                    file, below / above));
  if (above == 0) throw InputError(file + ": is black; need an image of a lit object");
}

struct Weight {
  std::size_t from;
  double share;
};

// What each of `size` pixels in a row takes of `from` pixels: the parts within a window as wide as itself, or as one of
// those where they are wider; then it lies between the two nearest.
std::vector<std::vector<Weight>> windows(int from, int size) {
  const double step = static_cast<double>(from) / size, half = 0.5 * std::max(step, 1.0);
  std::vector<std::vector<Weight>> result(static_cast<std::size_t>(size));
  for (int i = 0; i < size; ++i) {
    const double low = std::max((i + 0.5) * step - half, 0.0), high = std::min((i + 0.5) * step + half, double(from));
    for (int j = static_cast<int>(low); j < from && j < high; ++j)
      result[static_cast<std::size_t>(i)].push_back(
          {static_cast<std::size_t>(j), (std::min(high, j + 1.0) - std::max(low, double(j))) / (high - low)});
  }
  return result;
}

// Of square planes.
std::vector<float> resampled(const std::vector<float>& planes, int size, int count) {
  const std::size_t pixels = planes.size() / static_cast<std::size_t>(count);
  const auto width = static_cast<std::size_t>(std::lround(std::sqrt(static_cast<double>(pixels))));
  const std::vector<std::vector<Weight>> window = windows(static_cast<int>(width), size);
  std::vector<float> result;
  for (std::size_t plane = 0; plane < planes.size(); plane += pixels)
    for (const auto& rows : window)
      for (const auto& columns : window) {
        double sum = 0;
        for (const Weight& row : rows)
          for (const Weight& column : columns)
            sum += row.share * column.share * static_cast<double>(planes[plane + row.from * width + column.from]);
        result.push_back(static_cast<float>(sum));
      }
  return result;
}

double mean_of(std::span<const float> values) {
  double sum = 0;
  for (const float value : values) sum += static_cast<double>(value);
  return sum / static_cast<double>(values.size());
}

[[noreturn]] void fail_missing(const std::string& input) {
  const bool of_shape = input == "normal" || input == "nearness" || input == "light";
  throw UsageError("the network sees '" + input +
                   "': " + (of_shape ? "needs the shape's buffers and the light" : "it is not given for this image"));
}

}  // namespace

std::vector<float> read_luminance(const std::string& file, int size, const std::string& hash,
                                  std::vector<float>* errors) {
  return luminance_of(read_square(file, size, hash), file, errors);
}

std::vector<float> luminance_of(const ExrImage& image, const std::string& file, std::vector<float>* errors) {
  return radiance_of(image, file, 1, "", errors);
}

std::vector<float> radiance_of(const ExrImage& image, const std::string& file, int colours, const std::string& prefix,
                               std::vector<float>* errors) {
  std::vector<float> radiance = finite_radiance(image, file, colours, prefix);
  if (!errors) return radiance;
  if (colours == 3) {
    errors->clear();
    for (const char* letter : {"R", "G", "B"}) {
      const std::vector<float> values = plane(image, prefix + "stderr." + letter, file);
      errors->insert(errors->end(), values.begin(), values.end());
    }
  } else {
    errors->assign(radiance.size(), 0.0F);
    if (image.channel(prefix + "Y") < 0 && image.channel(prefix + "stderr.R") >= 0) {
      // One path brings all three colours: their errors go together, for the most part.
      for (std::size_t c = 0; c < 3; ++c) {
        const std::vector<float> values = plane(image, prefix + "stderr." + std::array{"R", "G", "B"}[c], file);
        for (std::size_t i = 0; i < values.size(); ++i)
          (*errors)[i] += static_cast<float>(luminance_weights[c]) * values[i];
      }
    } else if (image.channel(prefix + "stderr.Y") >= 0) {
      *errors = plane(image, prefix + "stderr.Y", file);
    }
  }
  if (!std::all_of(errors->begin(), errors->end(), [](float error) { return std::isfinite(error); }))
    throw InputError(file + ": standard errors are not finite; render the data set again");
  return radiance;
}

std::vector<float> read_resampled_luminance(const std::string& file, int size, const PhotoOptions& photo) {
  return read_resampled_radiance(file, size, 1, photo);
}

std::vector<float> read_resampled_radiance(const std::string& file, int size, int colours, const PhotoOptions& photo,
                                           const std::string& prefix) {
  const std::vector<float> radiance = is_exr(read_file(file))
                                          ? finite_radiance(read_square(file, any_size, ""), file, colours, prefix)
                                          : square_photo(file, colours, photo);
  check_radiance(radiance, file);
  return resampled(radiance, size, colours);
}

SeenShape seen_shape(std::vector<float> normal, const std::vector<float>& depth, std::vector<float> mask, int size,
                     const std::string& name, double unit) {
  const std::size_t pixels = mask.size();
  SeenShape shape{std::move(normal), std::vector<float>(pixels), std::move(mask)};
  double depths = 0, covered = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    const float seen = shape.mask[i];
    const double x = shape.normal[i], y = shape.normal[pixels + i], z = shape.normal[2 * pixels + i];
    const double length = std::sqrt(x * x + y * y + z * z);
    if (seen != 0 && seen != 1) fail_at(name, size, i, fmt::format("mask is {}, need 0 or 1", seen));
    if (!(length < 1.01)) fail_at(name, size, i, fmt::format("the normal has the length {}, need 1 or 0", length));
    if (seen == 0) continue;
    if (length < 0.99) fail_at(name, size, i, fmt::format("the normal has the length {}, need 1", length));
    if (!std::isfinite(depth[i])) fail_at(name, size, i, fmt::format("depth is {}, need a finite number", depth[i]));
    depths += depth[i];
    covered += 1;
  }
  if (covered == 0) throw InputError(name + ": the mask is 0 everywhere: no object can be seen");
  for (std::size_t i = 0; i < pixels; ++i)
    if (shape.mask[i] == 1) shape.nearness[i] = static_cast<float>((depths / covered - depth[i]) / unit);
  return shape;
}

SeenShape read_seen_shape(const std::string& file, int size, const std::string& hash) {
  return seen_shape_of(read_square(file, size, hash), file);
}

SeenShape seen_shape_of(const ExrImage& image, const std::string& file) {
  std::vector<float> mask = plane(image, "mask", file), normal;
  const std::vector<float> depth = plane(image, "depth", file);
  for (const char* name : {"normal.X", "normal.Y", "normal.Z"}) {
    const std::vector<float> values = plane(image, name, file);
    normal.insert(normal.end(), values.begin(), values.end());
  }
  return seen_shape(std::move(normal), depth, std::move(mask), image.width, file);
}

SeenShape read_resampled_seen_shape(const std::string& file, int size, const std::string& hash) {
  const SeenShape whole = read_seen_shape(file, any_size, hash);
  const std::size_t pixels = whole.mask.size(), side = static_cast<std::size_t>(size);
  const auto from = static_cast<std::size_t>(std::lround(std::sqrt(static_cast<double>(pixels))));
  const auto resampled = [&](const float* values, std::vector<float>& to) {
    for (std::size_t y = 0; y < side; ++y)
      for (std::size_t x = 0; x < side; ++x)
        to.push_back(values[(2 * y + 1) * from / (2 * side) * from + (2 * x + 1) * from / (2 * side)]);
  };
  SeenShape shape;
  for (std::size_t axis = 0; axis < 3; ++axis) resampled(&whole.normal[axis * pixels], shape.normal);
  resampled(whole.nearness.data(), shape.nearness);
  resampled(whole.mask.data(), shape.mask);
  if (std::find(shape.mask.begin(), shape.mask.end(), 1.0F) == shape.mask.end())
    throw InputError(
        fmt::format("{}: the object is smaller than a pixel of the {} x {} that the network sees; need "
                    "buffers that it fills: cut them, and the image, around it",
                    file, size, size));
  return shape;
}

SeenShape read_mask(const std::string& file, int size) {
  std::vector<float> grey;
  if (is_exr(read_file(file))) {
    const ExrImage image = read_square(file, any_size, "");
    grey = image.channel("mask") >= 0 ? plane(image, "mask", file) : finite_radiance(image, file, 1, "");
  } else {
    PhotoOptions linear;
    linear.curve = transfer_curve("linear");
    grey = square_photo(file, 1, linear);
  }
  SeenShape seen{{}, {}, resampled(grey, size, 1)};
  for (float& value : seen.mask) value = value > 0.5F ? 1.0F : 0.0F;
  if (std::find(seen.mask.begin(), seen.mask.end(), 1.0F) == seen.mask.end())
    throw InputError(fmt::format("{}: no pixel of {} x {} is white; need the object in white", file, size, size));
  return seen;
}

void network_input(const NetworkDescription& network, const Seen& seen, std::span<float> input) {
  const auto side = static_cast<std::size_t>(network.size);
  const std::size_t pixels = side * side;
  if (input.size() != static_cast<std::size_t>(network.channels) * pixels)
    throw UsageError(fmt::format("input of {} numbers for a network of {} x {} pixels with {} channels", input.size(),
                                 side, side, network.channels));
  const auto m = static_cast<float>(network.exposure ? std::max(mean_of(seen.image), 1e-30) : network.luminance),
             darkest = static_cast<float>(darkest_radiance) * m;
  auto to = input.begin();
  const auto put_radiance = [&](const std::string& name, std::span<const float> radiance, std::size_t colours) {
    if (radiance.empty()) fail_missing(name);
    if (radiance.size() != colours * pixels)
      throw UsageError(
          fmt::format("an image of {} numbers for a network of {} x {} pixels", radiance.size(), side, side));
    for (const float value : radiance) *to++ = std::log((std::max(value, 0.0F) + darkest) / (m + darkest));
  };
  const auto put = [&](const std::string& name, const std::vector<float>* values, std::size_t count) {
    if (!values || values->size() != count * pixels) fail_missing(name);
    to = std::copy(values->begin(), values->end(), to);
  };
  const SeenShape* shape = seen.shape;
  for (const std::string& name : inputs_of(network)) {
    if (name == "luminance") put_radiance(name, seen.image, 1);
    if (name == "rgb") put_radiance(name, seen.image, 3);
    if (name == "flash_luminance") put_radiance(name, seen.flash, 1);
    if (name == "flash_rgb") put_radiance(name, seen.flash, 3);
    if (name == "mask") put(name, shape ? &shape->mask : nullptr, 1);
    if (name == "normal") put(name, shape ? &shape->normal : nullptr, 3);
    if (name == "nearness") put(name, shape ? &shape->nearness : nullptr, 1);
    if (name == "light") {
      if (!seen.light || !shape || shape->normal.size() != 3 * pixels) fail_missing(name);
      for (std::size_t i = 0; i < pixels; ++i) {
        double cosine = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) cosine += (*seen.light)[axis] * shape->normal[axis * pixels + i];
        *to++ = static_cast<float>(cosine);
      }
    }
  }
}

void network_input(const NetworkDescription& network, std::span<const float> luminance, const KnownScene* known,
                   std::span<float> input) {
  network_input(network, {luminance, {}, known ? &known->shape : nullptr, known ? &known->light : nullptr}, input);
}

void mirror_input(const NetworkDescription& network, std::span<float> input) {
  const auto side = static_cast<std::ptrdiff_t>(network.size);
  for (auto row = input.begin(); row != input.end(); row += side) std::reverse(row, row + side);
  const auto pixels = static_cast<std::size_t>(side * side);
  std::size_t first = 0;
  for (const std::string& name : inputs_of(network)) {
    if (name == "normal")
      for (float& x : input.subspan(first, pixels)) x = -x;
    first += static_cast<std::size_t>(channels_of_input(name)) * pixels;
  }
}

}  // namespace itn
