#include "network/training/dataset_examples.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <limits>
#include <mutex>
#include <utility>

#include "itn/error.h"
#include "network/dataset/dataset_scene.h"
#include "network/dataset/stored_image.h"
#include "network/model/random.h"
#include "runtime/base/parallel.h"

namespace itn {
namespace {

std::string path_of(const std::string& folder, const std::string& file) {
  return (std::filesystem::path(folder) / file).string();
}

}  // namespace

Wanted wanted_by(const NetworkDescription& network) {
  const Needs needs(network);
  return {sees(network, "rgb") ? 3 : 1, needs.flash, needs.shape || needs.mask};
}

DatasetImages read_images(const std::string& folder, const Manifest& manifest, Manifest::Split split,
                          const Wanted& wanted, const std::atomic<bool>& cancel, const std::function<void()>& read) {
  if (wanted.colours == 3 && !manifest.in_colours)
    throw UsageError(folder + ": its images are of luminance; the network sees colours");
  if (wanted.flash && !(manifest.flash > 0)) throw UsageError(folder + ": has no flash; the network sees one");
  DatasetImages result;
  result.linear_sigma_t = manifest.linear_sigma_t;
  std::copy_if(manifest.images.begin(), manifest.images.end(), std::back_inserter(result.images),
               [&](const Manifest::Image& image) { return image.split == split; });
  const std::size_t count = result.images.size();
  if (count == 0) throw InputError(manifest_file(folder) + ": has no images of the split " + split_name(split));
  result.radiance.resize(count);
  result.errors.resize(count);
  if (wanted.flash) {
    result.flash.resize(count);
    result.flash_errors.resize(count);
  }
  if (wanted.shapes && manifest.cameras) result.shapes.resize(count);
  for (const Manifest::Image& image : result.images) {
    result.lights.push_back(before_camera(image, manifest.lights[static_cast<std::size_t>(image.light)].direction));
    result.shape_of.push_back(manifest.cameras ? result.shape_of.size() : static_cast<std::size_t>(image.shape));
  }
  std::mutex reporting;
  parallel_for(count, [&](std::size_t i) {
    if (cancel) throw Interrupted();
    const ExrImage content = read_stored(folder, manifest, result.images[i]);
    const std::string file = path_of(folder, result.images[i].file);
    result.radiance[i] = radiance_of(content, file, wanted.colours, "", &result.errors[i]);
    if (wanted.flash) result.flash[i] = radiance_of(content, file, wanted.colours, "flash.", &result.flash_errors[i]);
    if (wanted.shapes && manifest.cameras) result.shapes[i] = seen_shape_of(content, file);
    const std::lock_guard lock(reporting);
    read();
  });
  if (wanted.shapes && !manifest.cameras) {
    result.shapes.resize(manifest.shapes.size());
    parallel_for(manifest.shapes.size(), [&](std::size_t i) {
      const Manifest::Shape& shape = manifest.shapes[i];
      result.shapes[i] = seen_shape_of(read_stored(folder, manifest, shape), path_of(folder, shape.buffers));
    });
  }
  return result;
}

void append(DatasetImages& all, DatasetImages more) {
  for (std::size_t& shape : more.shape_of) shape += all.shapes.size();
  const auto move_all = [](auto& from, auto& to) { std::move(from.begin(), from.end(), std::back_inserter(to)); };
  move_all(more.images, all.images);
  move_all(more.radiance, all.radiance);
  move_all(more.errors, all.errors);
  move_all(more.flash, all.flash);
  move_all(more.flash_errors, all.flash_errors);
  move_all(more.shapes, all.shapes);
  move_all(more.shape_of, all.shape_of);
  move_all(more.lights, all.lights);
  all.linear_sigma_t = more.linear_sigma_t;
}

double mean_luminance(const DatasetImages& images) {
  double sum = 0, count = 0;
  for (const std::vector<float>& radiance : images.radiance)
    for (const float value : radiance) {
      sum += value;
      count += 1;
    }
  if (!(sum > 0)) throw InputError("the images of the data set are black; is there light in its scenes?");
  return sum / count;
}

std::vector<std::string> parameters_of(const Manifest::Image& image) {
  if (!image.colours) return {"sigma_t", "albedo", "g"};
  return {"sigma_t.R", "sigma_t.G", "sigma_t.B", "albedo.R", "albedo.G", "albedo.B", "g"};
}

std::vector<OutputRange> output_ranges(const DatasetImages& images) {
  const std::vector<OutputRange> defaults = default_outputs();
  std::vector<OutputRange> ranges;
  for (const std::string& name : parameters_of(images.images.front())) {
    OutputRange range{name, std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(), false};
    const bool is_sigma_t = name.starts_with("sigma_t");
    for (const OutputRange& usual : defaults)
      if (usual.name == name && !(is_sigma_t && images.linear_sigma_t)) range = usual;
    range.logarithmic = is_sigma_t && !images.linear_sigma_t;
    for (const Manifest::Image& image : images.images) {
      const double parameter = parameter_of(image, name);
      range.low = std::min(range.low, parameter);
      range.high = std::max(range.high, parameter);
    }
    ranges.push_back(range);
  }
  return ranges;
}

double parameter_of(const Manifest::Image& image, const std::string& name) {
  const std::vector<std::string> names = parameters_of(image);
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end())
    throw UsageError(fmt::format("the data set has no parameter '{}', only {}", name, fmt::join(names, ", ")));
  const auto index = static_cast<std::size_t>(found - names.begin());
  if (index + 1 == names.size()) return image.g;
  if (!image.colours) return index == 0 ? image.sigma_t : image.albedo;
  return index < 3 ? image.colours->sigma_t[index] : image.colours->albedo[index - 3];
}

DatasetExamples::DatasetExamples(const DatasetImages& images, NetworkDescription network, const Variation& variation)
    : images_(images), network_(std::move(network)), variation_(variation) {
  for (const OutputRange& range : network_.outputs) parameter_of(images_.images.front(), range.name);
  const Wanted wanted = wanted_by(network_);
  if ((wanted.shapes && images_.shapes.empty()) || (wanted.flash && images_.flash.empty()))
    throw UsageError("the network sees more of the data set than was read: shapes or the flash");
  if (network_.cut_out == 0) return;
  const int size = network_.size;
  for (const SeenShape& shape : images_.shapes)
    objects_.push_back(cut_out(shape.mask, size, size, size, network_.cut_out, "data set"));
}

std::vector<float> DatasetExamples::noisy(const std::vector<float>& radiance, const std::vector<float>& errors,
                                          double strength, std::uint64_t stream) const {
  std::vector<float> values = radiance;
  if (strength == 0) return values;
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] += static_cast<float>(strength * errors[i] * random_normal(variation_.seed, stream, i));
  return values;
}

Photographs DatasetExamples::photographs(std::size_t index, std::uint64_t look) const {
  const std::size_t original = index % images_.images.size();
  const std::uint64_t stream = RANDOM_NOISE + look * count() + index;
  const std::vector<float>& radiance = images_.radiance[original];
  const double strength =
      variation_.noise == 0 ? 0 : variation_.noise * random_uniform(variation_.seed, stream, 2 * radiance.size());
  Photographs result{network_.size, noisy(radiance, images_.errors[original], strength, stream)};
  if (!images_.flash.empty())
    result.flash = noisy(images_.flash[original], images_.flash_errors[original], strength, RANDOM_FLASH + stream);
  if (!images_.shapes.empty()) result.shape = images_.shapes[images_.shape_of[original]];
  result.light = images_.lights[original];
  return result;
}

std::size_t DatasetExamples::of_another_shape(std::size_t index, std::uint64_t random) const {
  const std::size_t all = originals(), original = index % all;
  const std::size_t first = original + 1 + random % std::max<std::size_t>(1, all - 1);
  for (std::size_t k = 0; k < all; ++k)
    if (const std::size_t other = (first + k) % all; images_.shape_of[other] != images_.shape_of[original])
      return other;
  return first % all;
}

void DatasetExamples::read(std::size_t index, std::uint64_t look, std::span<float> image,
                           std::span<double> truth) const {
  const std::size_t original = index % images_.images.size();
  Photographs seen = photographs(index, look);
  if (!objects_.empty()) keep_object(seen, objects_[images_.shape_of[original]]);
  network_input(network_, seen.seen(), image);
  if (index >= originals()) mirror_input(network_, image);
  for (std::size_t i = 0; i < truth.size(); ++i)
    truth[i] = parameter_of(images_.images[original], network_.outputs[i].name);
}

}  // namespace itn
