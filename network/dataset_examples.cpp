#include "network/dataset_examples.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <utility>

#include "network/random.h"
#include "runtime/base/error.h"
#include "runtime/dataset/stored_image.h"

namespace itn {
namespace {

std::string path_of(const std::string& folder, const std::string& file) {
  return (std::filesystem::path(folder) / file).string();
}

}  // namespace

DatasetImages read_images(const std::string& folder, const Manifest& manifest, Manifest::Split split, bool with_shapes,
                          const std::atomic<bool>& cancel) {
  DatasetImages result;
  for (const Manifest::Image& image : manifest.images) {
    if (cancel) throw Interrupted();
    if (image.split != split) continue;
    result.images.push_back(image);
    result.luminance.push_back(
        luminance_of(read_stored(folder, manifest, image), path_of(folder, image.file), &result.errors.emplace_back()));
  }
  if (result.images.empty())
    throw InputError(manifest_file(folder) + ": has no images of the split " + split_name(split));
  for (const Manifest::Light& light : manifest.lights) result.lights.push_back(light.direction);
  if (with_shapes)
    for (const Manifest::Shape& shape : manifest.shapes)
      result.shapes.push_back(seen_shape_of(read_stored(folder, manifest, shape), path_of(folder, shape.buffers)));
  return result;
}

void append(DatasetImages& all, DatasetImages more) {
  for (Manifest::Image& image : more.images) {
    image.shape += static_cast<int>(all.shapes.size());
    image.light += static_cast<int>(all.lights.size());
  }
  const auto move_all = [](auto& from, auto& to) { std::move(from.begin(), from.end(), std::back_inserter(to)); };
  move_all(more.images, all.images);
  move_all(more.luminance, all.luminance);
  move_all(more.errors, all.errors);
  move_all(more.shapes, all.shapes);
  move_all(more.lights, all.lights);
}

double mean_luminance(const DatasetImages& images) {
  double sum = 0, count = 0;
  for (const std::vector<float>& luminance : images.luminance)
    for (const float value : luminance) {
      sum += value;
      count += 1;
    }
  if (!(sum > 0)) throw InputError("the images of the data set are black; is there light in its scenes?");
  return sum / count;
}

std::vector<OutputRange> output_ranges(const DatasetImages& images) {
  std::vector<OutputRange> ranges = default_outputs();
  for (OutputRange& range : ranges)
    for (const Manifest::Image& image : images.images) {
      const double parameter = parameter_of(image, range.name);
      range.low = std::min(range.low, parameter);
      range.high = std::max(range.high, parameter);
    }
  return ranges;
}

double parameter_of(const Manifest::Image& image, const std::string& name) {
  if (name == "sigma_t") return image.sigma_t;
  if (name == "albedo") return image.albedo;
  if (name == "g") return image.g;
  throw UsageError("data sets have no parameter '" + name + "', only sigma_t, albedo and g");
}

DatasetExamples::DatasetExamples(const DatasetImages& images, NetworkDescription network, const Variation& variation)
    : images_(images), network_(std::move(network)), variation_(variation) {
  for (const OutputRange& range : network_.outputs) parameter_of(images_.images.front(), range.name);
  if (network_.channels > 1 && images_.shapes.empty())
    throw UsageError("a network of six channels needs the data set's shapes");
}

std::vector<float> DatasetExamples::luminance(std::size_t index, std::uint64_t look) const {
  const std::size_t original = index % images_.images.size();
  std::vector<float> values = images_.luminance[original];
  if (variation_.noise == 0) return values;
  const std::uint64_t stream = RANDOM_NOISE + look * count() + index;
  const double strength = variation_.noise * random_uniform(variation_.seed, stream, 2 * values.size());
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] += static_cast<float>(strength * images_.errors[original][i] * random_normal(variation_.seed, stream, i));
  return values;
}

void DatasetExamples::read(std::size_t index, std::uint64_t look, std::span<float> image,
                           std::span<double> truth) const {
  const std::size_t original = index % images_.images.size();
  const Manifest::Image& source = images_.images[original];
  if (network_.channels == 1) {
    network_input(network_, luminance(index, look), nullptr, image);
  } else {
    const KnownScene known{images_.shapes[static_cast<std::size_t>(source.shape)],
                           images_.lights[static_cast<std::size_t>(source.light)]};
    network_input(network_, luminance(index, look), &known, image);
  }
  if (index != original) mirror_input(network_, image);
  for (std::size_t i = 0; i < truth.size(); ++i) truth[i] = parameter_of(source, network_.outputs[i].name);
}

}  // namespace itn
