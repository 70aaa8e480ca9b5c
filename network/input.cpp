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

// Row-major, finite.
std::vector<float> finite_luminance(const ExrImage& image, const std::string& file) {
  std::vector<float> luminance;
  if (image.channel("Y") >= 0) {
    luminance = plane(image, "Y", file);
  } else if (image.channel("R") >= 0) {
    luminance.resize(image.data.size() / image.channels.size());
    for (std::size_t c = 0; c < 3; ++c) {
      const std::vector<float> values = plane(image, std::array{"R", "G", "B"}[c], file);
      const auto weight = static_cast<float>(luminance_weights[c]);
      for (std::size_t i = 0; i < values.size(); ++i) luminance[i] += weight * values[i];
    }
  } else {
    throw InputError(
        fmt::format("{}: has no channel Y, nor R, G and B; only {}", file, fmt::join(image.channels, ", ")));
  }
  for (std::size_t i = 0; i < luminance.size(); ++i)
    if (!std::isfinite(luminance[i]))
      fail_at(file, image.width, i, fmt::format("is {}, need a finite number", luminance[i]));
  return luminance;
}

std::vector<float> square_photo(const std::string& file, const PhotoOptions& options) {
  const Photo photo = luminance_of(read_photo(file, options));
  check_square(file, photo.width, photo.height);
  return photo.value;
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

}  // namespace

std::vector<float> read_luminance(const std::string& file, int size, const std::string& hash,
                                  std::vector<float>* errors) {
  return luminance_of(read_square(file, size, hash), file, errors);
}

std::vector<float> luminance_of(const ExrImage& image, const std::string& file, std::vector<float>* errors) {
  std::vector<float> luminance = finite_luminance(image, file);
  if (!errors) return luminance;
  *errors = image.channel("stderr.Y") < 0 ? std::vector<float>(luminance.size()) : plane(image, "stderr.Y", file);
  if (!std::all_of(errors->begin(), errors->end(), [](float error) { return std::isfinite(error); }))
    throw InputError(file + ": standard errors are not finite; render the data set again");
  return luminance;
}

std::vector<float> read_resampled_luminance(const std::string& file, int size, const PhotoOptions& photo) {
  const std::vector<float> luminance =
      is_exr(read_file(file)) ? finite_luminance(read_square(file, any_size, ""), file) : square_photo(file, photo);
  check_radiance(luminance, file);
  const auto width = static_cast<std::size_t>(std::lround(std::sqrt(static_cast<double>(luminance.size()))));
  const std::vector<std::vector<Weight>> window = windows(static_cast<int>(width), size);
  std::vector<float> result;
  for (const auto& rows : window)
    for (const auto& columns : window) {
      double sum = 0;
      for (const Weight& row : rows)
        for (const Weight& column : columns)
          sum += row.share * column.share * static_cast<double>(luminance[row.from * width + column.from]);
      result.push_back(static_cast<float>(sum));
    }
  return result;
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

void network_input(const NetworkDescription& network, std::span<const float> luminance, const KnownScene* known,
                   std::span<float> input) {
  const auto side = static_cast<std::size_t>(network.size);
  const std::size_t pixels = side * side;
  if (luminance.size() != pixels || input.size() != static_cast<std::size_t>(network.channels) * pixels)
    throw UsageError(fmt::format("an image of {} pixels for a network of {} x {}", luminance.size(), side, side));
  const auto m = static_cast<float>(network.luminance), darkest = static_cast<float>(darkest_radiance) * m;
  for (std::size_t i = 0; i < pixels; ++i)
    input[i] = std::log((std::max(luminance[i], 0.0F) + darkest) / (m + darkest));
  if (network.channels == 1) return;
  if (!known || known->shape.nearness.size() != pixels)
    throw UsageError("a network of six channels needs the shape's buffers and the light");
  const std::vector<float>& normal = known->shape.normal;
  std::copy(normal.begin(), normal.end(), input.begin() + static_cast<std::ptrdiff_t>(pixels));
  std::copy(known->shape.nearness.begin(), known->shape.nearness.end(),
            input.begin() + static_cast<std::ptrdiff_t>(4 * pixels));
  for (std::size_t i = 0; i < pixels; ++i) {
    double cosine = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) cosine += known->light[axis] * normal[axis * pixels + i];
    input[5 * pixels + i] = static_cast<float>(cosine);
  }
}

void mirror_input(const NetworkDescription& network, std::span<float> input) {
  const auto side = static_cast<std::ptrdiff_t>(network.size);
  for (auto row = input.begin(); row != input.end(); row += side) std::reverse(row, row + side);
  if (network.channels == 1) return;
  const auto pixels = static_cast<std::size_t>(side * side);
  for (float& x : input.subspan(pixels, pixels)) x = -x;  // of the normals
}

}  // namespace itn
