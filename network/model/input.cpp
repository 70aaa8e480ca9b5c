#include "network/model/input.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>

#include "itn/colour.h"
#include "itn/error.h"
#include "itn/exr.h"
#include "itn/file.h"
#include "runtime/image/radiance.h"

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

// Planes of a picture of any kind and shape, one after the other.
struct Planes {
  int width = 0, height = 0;
  std::vector<float> values;
  std::vector<float> weight{};  // of a photo's pixels, 0 where one is saturated; empty: not known
  double saturated = 0;         // share of a photo's pixels
};

// Checks width and height before all else that may be wrong.
using CheckSize = std::function<void(int width, int height)>;

Planes photo_planes(const std::string& file, int colours, const PhotoOptions& options, const CheckSize& check,
                    std::vector<float>* errors = nullptr) {
  Photo photo = read_photo(file, options);
  check(photo.width, photo.height);
  if (colours == 1) photo = luminance_of(photo);
  if (photo.channels != colours)
    throw InputError(file + ": is grey, need colours: the network sees red, green and blue");
  const auto count = static_cast<std::size_t>(colours), pixels = photo.value.size() / count;
  std::vector<float> planes(photo.value.size());
  for (std::size_t i = 0; i < planes.size(); ++i) planes[i % count * pixels + i / count] = photo.value[i];
  if (photo.has_alpha) photo.weight.clear();  // it is alpha's, too
  if (errors) *errors = std::move(photo.noise);
  return {photo.width, photo.height, std::move(planes), std::move(photo.weight), photo.saturated};
}

// errors: of luminance, as radiance_of() has them.
Planes radiance_planes(const std::string& file, int colours, const PhotoOptions& photo, const std::string& prefix,
                       const CheckSize& check, std::vector<float>* errors = nullptr) {
  if (!is_exr(read_file(file))) return photo_planes(file, colours, photo, check, errors);
  const ExrImage image = read_exr(file);
  check(image.width, image.height);
  return {image.width, image.height, radiance_of(image, file, colours, prefix, errors)};
}

// The picture's whiteness, 0 to 1.
Planes mask_plane(const std::string& file, const CheckSize& check) {
  if (is_exr(read_file(file))) {
    const ExrImage image = read_exr(file);
    check(image.width, image.height);
    return {image.width, image.height,
            image.channel("mask") >= 0 ? plane(image, "mask", file) : finite_radiance(image, file, 1, "")};
  }
  PhotoOptions linear;
  linear.curve = transfer_curve("linear");
  return photo_planes(file, 1, linear, check);
}

constexpr float white_from = 0.5F;

// Nothing but black says nothing about an object.
void check_radiance(const std::vector<float>& luminance, const std::string& file) {
  if (const std::string wrong = wrong_with_radiance(luminance); !wrong.empty())
    throw InputError(fmt::format("{}: {}", file, wrong));
  if (std::none_of(luminance.begin(), luminance.end(), [](float value) { return value > 0; }))
    throw InputError(file + ": is black; need an image of a lit object");
}

struct Weight {
  std::size_t from;
  double share;
};

// Weights with which each of `size` pixels in a row averages `from` pixels that begin at `first`; only pixels from 0 to
// `end` exist. A window is as wide as the new pixel, or as an old one where those are wider: it then interpolates
// between the two nearest.
std::vector<std::vector<Weight>> windows(int first, int from, int end, int size) {
  const double step = static_cast<double>(from) / size, half = 0.5 * std::max(step, 1.0);
  std::vector<std::vector<Weight>> result(static_cast<std::size_t>(size));
  for (int i = 0; i < size; ++i) {
    const double low = std::max((i + 0.5) * step - half, 0.0), high = std::min((i + 0.5) * step + half, double(from));
    for (int j = std::max(static_cast<int>(low), -first); j < std::min(from, end - first) && j < high; ++j)
      result[static_cast<std::size_t>(i)].push_back(
          {static_cast<std::size_t>(first + j), (std::min(high, j + 1.0) - std::max(low, double(j))) / (high - low)});
  }
  return result;
}

struct Square {
  int left, top, side;
};

Square whole(const Planes& planes) { return {0, 0, planes.width}; }

enum class Kind { values, errors };

// A square of the planes, black beyond them. errors: independent standard errors, added as such.
std::vector<float> resampled(const Planes& planes, const Square& square, int size, Kind kind = Kind::values) {
  const auto width = static_cast<std::size_t>(planes.width), pixels = width * static_cast<std::size_t>(planes.height);
  const auto of_columns = windows(square.left, square.side, planes.width, size),
             of_rows = windows(square.top, square.side, planes.height, size);
  std::vector<float> result;
  for (std::size_t plane = 0; plane < planes.values.size(); plane += pixels)
    for (const auto& rows : of_rows)
      for (const auto& columns : of_columns) {
        double sum = 0;
        for (const Weight& row : rows)
          for (const Weight& column : columns) {
            const double part =
                row.share * column.share * static_cast<double>(planes.values[plane + row.from * width + column.from]);
            sum += kind == Kind::errors ? part * part : part;
          }
        result.push_back(static_cast<float>(kind == Kind::errors ? std::sqrt(sum) : sum));
      }
  return result;
}

// Share of the object's pixels that are saturated.
double saturated_share(const Planes& planes, const CutOut& object) {
  double all = 0, saturated = 0;
  for (std::size_t i = 0; i < planes.weight.size(); ++i) {
    if (object.white[i] == 0) continue;
    all += 1;
    saturated += planes.weight[i] == 0;
  }
  return all > 0 ? saturated / all : 0;
}

// grey: (size, size).
SeenShape seen_mask(std::vector<float> grey, int size, const std::string& file) {
  SeenShape seen{{}, {}, std::move(grey)};
  for (float& value : seen.mask) value = value > white_from ? 1.0F : 0.0F;
  if (std::find(seen.mask.begin(), seen.mask.end(), 1.0F) == seen.mask.end())
    throw InputError(fmt::format("{}: no pixel of {} x {} is white; need the object in white", file, size, size));
  return seen;
}

// Over all planes. mask: empty, or of the pixels where it is 1.
double mean_of(std::span<const float> planes, std::span<const float> mask) {
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    if (!mask.empty() && mask[i % mask.size()] != 1) continue;
    sum += static_cast<double>(planes[i]);
    count += 1;
  }
  return sum / count;
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

ResampledImage read_resampled_radiance(const std::string& file, int size, int colours, const PhotoOptions& photo,
                                       const std::string& prefix, const CutOut* object) {
  Planes radiance = radiance_planes(file, colours, photo, prefix, [&](int width, int height) {
    if (!object) check_square(file, width, height);
    if (object && (width != object->width || height != object->height))
      throw InputError(fmt::format("{}: has {} x {} pixels, its mask {} x {}; need as many", file, width, height,
                                   object->width, object->height));
  });
  check_radiance(radiance.values, file);
  const double saturated = object ? saturated_share(radiance, *object) : radiance.saturated;
  return {object ? cut_planes(std::move(radiance.values), *object) : resampled(radiance, whole(radiance), size),
          saturated};
}

ResampledImage read_resampled_luminance(const std::string& file, int size, const PhotoOptions& photo) {
  Planes errors;
  const Planes luminance = radiance_planes(
      file, 1, photo, "", [&](int width, int height) { check_square(file, width, height); }, &errors.values);
  check_radiance(luminance.values, file);
  errors.width = luminance.width;
  errors.height = luminance.height;
  ResampledImage result{resampled(luminance, whole(luminance), size), luminance.saturated,
                        resampled(errors, whole(errors), size, Kind::errors)};
  if (luminance.width < size) std::fill(result.errors.begin(), result.errors.end(), 0.0F);
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

SeenShape read_mask(const std::string& file, int size) {
  const Planes grey = mask_plane(file, [&](int width, int height) { check_square(file, width, height); });
  return seen_mask(resampled(grey, whole(grey), size), size, file);
}

CutOut cut_out(const std::string& mask_file, int size, double share) {
  Planes white = mask_plane(mask_file, [](int, int) {});
  for (float& value : white.values) value = value > white_from ? 1.0F : 0.0F;
  return cut_out(std::move(white.values), white.width, white.height, size, share, mask_file);
}

CutOut cut_out(std::vector<float> white, int width, int height, int size, double share, const std::string& name) {
  const WhiteBox box = box_around_white(white, width, height);
  if (box.right < 0) throw InputError(name + ": nothing in it is white; need the object in white");
  const int side = std::max(1, static_cast<int>(std::lround(box.longer_side() / share)));
  const auto begin = [&](int first, int last) { return static_cast<int>(std::floor((first + last + 1 - side) / 2.0)); };
  const Square square{begin(box.left, box.right), begin(box.top, box.bottom), side};
  std::vector<float> covered = resampled({width, height, white}, square, size);
  SeenShape mask = seen_mask(covered, size, name);
  return {std::move(mask), width, height, std::move(white), square.left, square.top, side, std::move(covered)};
}

std::vector<float> cut_planes(std::vector<float> planes, const CutOut& object) {
  const auto size = static_cast<int>(std::lround(std::sqrt(static_cast<double>(object.covered.size()))));
  for (std::size_t i = 0; i < planes.size(); ++i) planes[i] *= object.white[i % object.white.size()];
  std::vector<float> result =
      resampled({object.width, object.height, std::move(planes)}, {object.left, object.top, object.side}, size);
  for (std::size_t i = 0; i < result.size(); ++i) {
    const float share = object.covered[i % object.covered.size()];
    result[i] = share > 0 ? result[i] / share : 0;
  }
  return result;
}

void keep_object(Photographs& photographs, const CutOut& object) {
  photographs.image = cut_planes(std::move(photographs.image), object);
  if (!photographs.flash.empty()) photographs.flash = cut_planes(std::move(photographs.flash), object);
  photographs.shape = object.mask;
}

WhiteBox box_around_white(std::span<const float> mask, int width, int height) {
  WhiteBox box{.left = width, .top = height};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      if (!(mask[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)] >
            white_from))
        continue;
      box = {std::min(box.left, x), std::max(box.right, x), std::min(box.top, y), std::max(box.bottom, y)};
    }
  return box;
}

double share_of_object(std::span<const float> mask) {
  const auto side = static_cast<int>(std::lround(std::sqrt(static_cast<double>(mask.size()))));
  return static_cast<double>(box_around_white(mask, side, side).longer_side()) / side;
}

void network_input(const NetworkDescription& network, const Seen& seen, std::span<float> input) {
  const auto side = static_cast<std::size_t>(network.size);
  const std::size_t pixels = side * side;
  if (input.size() != static_cast<std::size_t>(network.channels) * pixels)
    throw UsageError(fmt::format("input of {} numbers for a network of {} x {} pixels with {} channels", input.size(),
                                 side, side, network.channels));
  const SeenShape* shape = seen.shape;
  const std::span<const float> object = network.cut_out > 0 && shape ? shape->mask : std::span<const float>();
  if (network.cut_out > 0 && object.size() != pixels) fail_missing("mask");
  auto to = input.begin();
  const auto put_radiance = [&](const std::string& name, std::span<const float> radiance, std::size_t colours) {
    if (radiance.empty()) fail_missing(name);
    if (radiance.size() != colours * pixels)
      throw UsageError(
          fmt::format("an image of {} numbers for a network of {} x {} pixels", radiance.size(), side, side));
    const double unit = network.exposure ? std::max(mean_of(radiance, object), least_mean) : network.luminance;
    const auto m = static_cast<float>(unit), darkest = static_cast<float>(darkest_radiance) * m;
    for (std::size_t i = 0; i < radiance.size(); ++i) {
      const float value = object.empty() || object[i % pixels] == 1 ? std::max(radiance[i], 0.0F) : 0.0F;
      *to++ = std::log((value + darkest) / (m + darkest));
    }
  };
  const auto put = [&](const std::string& name, const std::vector<float>* values, std::size_t count) {
    if (!values || values->size() != count * pixels) fail_missing(name);
    to = std::copy(values->begin(), values->end(), to);
  };
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
