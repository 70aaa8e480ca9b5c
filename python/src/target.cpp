#include "python/src/target.h"

#include <fmt/format.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>

#include <cmath>

#include "itn/error.h"
#include "python/src/arrays.h"
#include "python/src/scene.h"
#include "runtime/base/fingerprint.h"
#include "runtime/image/radiance.h"

namespace itn::python {
namespace {

using namespace nb::literals;

const Sensor& sensor_of(const SceneObject& object, int index) {
  return object.scene()->sensors.at(static_cast<std::size_t>(index));
}

std::string words(const FloatArray& array) {
  std::string result;
  for (std::size_t i = 0; i < array.ndim(); ++i) result += (i > 0 ? ", " : "") + std::to_string(array.shape(i));
  return "(" + result + ")";
}

std::vector<float> checked(const FloatArray& array, const std::vector<std::size_t>& shape, const char* what) {
  bool fits = array.ndim() == shape.size();
  for (std::size_t i = 0; fits && i < shape.size(); ++i) fits = array.shape(i) == shape[i];
  if (!fits)
    throw UsageError(fmt::format("{}: got an array of shape {}, need ({}), the size of the sensor's film", what,
                                 words(array), fmt::join(shape, ", ")));
  return as_vector(array);
}

// The same demands as read_target() has.
std::shared_ptr<TargetImage> from_arrays(const SceneObject& object, int sensor_index, const FloatArray& image,
                                         const std::optional<FloatArray>& mask,
                                         const std::optional<FloatArray>& error) {
  const Sensor& sensor = sensor_of(object, sensor_index);
  auto target = std::make_shared<TargetImage>();
  target->width = sensor.crop_width;
  target->height = sensor.crop_height;
  target->channels = sensor.luminance ? 1 : 3;
  const auto width = static_cast<std::size_t>(target->width), height = static_cast<std::size_t>(target->height);
  const auto channels = static_cast<std::size_t>(target->channels);
  target->value = checked(image, {height, width, channels}, "target");
  target->weight = mask ? checked(*mask, {height, width}, "mask") : std::vector<float>(width * height, 1.0F);
  if (error) target->error = checked(*error, {height, width, channels}, "target's standard error");
  double sum = 0;
  for (std::size_t i = 0; i < target->weight.size(); ++i) {
    const float weight = target->weight[i];
    const std::string at = fmt::format("pixel ({}, {})", i % width, i / width);
    if (!(weight >= 0 && std::isfinite(weight)))
      throw UsageError(fmt::format("mask: {} is {}; a mask holds weights, finite and 0 or more", at, weight));
    sum += static_cast<double>(weight);
    for (std::size_t c = i * channels; c < (i + 1) * channels; ++c) {
      if (weight > 0 && !std::isfinite(target->value[c]))
        throw UsageError(fmt::format("target: {} is {}; radiance is finite: give the pixel weight 0 in a mask", at,
                                     target->value[c]));
      if (error && weight > 0 && !(target->error[c] >= 0 && std::isfinite(target->error[c])))
        throw UsageError(fmt::format("target: the standard error of {} is {}; need a finite number, 0 or more", at,
                                     target->error[c]));
      if (weight == 0) target->value[c] = 0;
      if (weight == 0 && error) target->error[c] = 0;
    }
  }
  const auto place = [&](std::size_t i) {
    return fmt::format("pixel ({}, {})", i / channels % width, i / channels / width);
  };
  if (const std::string wrong = wrong_with_target(target->value, place); !wrong.empty())
    throw UsageError("target: " + wrong);
  if (sum == 0) throw UsageError("mask: every pixel is 0, so nothing is compared; need some above 0");
  return target;
}

std::shared_ptr<TargetImage> from_file(const SceneObject& object, int sensor_index, const std::string& file,
                                       const std::string& mask, const std::string& curve, double saturation) {
  const Sensor& sensor = sensor_of(object, sensor_index);
  return std::make_shared<TargetImage>(read_target(file, mask, sensor.crop_width, sensor.crop_height,
                                                   sensor.luminance ? 1 : 3, {transfer_curve(curve), saturation}));
}

// The fingerprint of all that the target holds.
std::string fingerprint_of_target(const TargetImage& target) {
  std::uint64_t all = fingerprint("");
  for (const std::vector<float>* values : {&target.value, &target.weight, &target.error, &target.noise})
    all = fingerprint({reinterpret_cast<const char*>(values->data()), values->size() * sizeof(float)}, all);
  return fingerprint_text(all);
}

}  // namespace

void bind_target(nb::module_& module) {
  nb::class_<TargetImage>(module, "Target", "An image that a scene is compared with.")
      .def_prop_ro(
          "note", [](const TargetImage& t) { return t.note; }, "What was done to a photo.")
      .def_prop_ro("fingerprint", &fingerprint_of_target);
  module.def("target_from_arrays", &from_arrays, "scene"_a, "sensor"_a, "image"_a, "mask"_a.none(), "error"_a.none());
  module.def("target_from_file", &from_file, "scene"_a, "sensor"_a, "file"_a, "mask"_a, "curve"_a = "auto",
             "saturation"_a = PhotoOptions().saturation);
}

}  // namespace itn::python
