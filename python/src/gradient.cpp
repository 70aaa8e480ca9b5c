#include "python/src/gradient.h"

#include <fmt/format.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <nlohmann/json.hpp>

#include "itn/error.h"
#include "python/src/arrays.h"
#include "python/src/renderers.h"
#include "python/src/target.h"
#include "python/src/warning.h"
#include "runtime/inverse/measured_loss.h"
#include "runtime/render/derivative_check.h"
#include "runtime/render/rendering_warnings.h"

namespace itn::python {
namespace {

using namespace nb::literals;

Operator operator_of(bool single) { return single ? Operator::single : Operator::full; }

std::size_t count(int number) { return static_cast<std::size_t>(number); }

// The derivatives by textures and grids, by name.
nb::dict arrays_of(const RendererKey& key, std::vector<VoxelGrid>& values) {
  nb::dict result;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (values[i].data.empty()) continue;
    std::vector<std::size_t> shape{count(values[i].height), count(values[i].width), count(values[i].channels)};
    if (values[i].data.size() != shape[0] * shape[1] * shape[2]) shape.insert(shape.begin(), count(values[i].depth));
    result[key.derivatives[i].c_str()] = numpy_array(std::move(values[i].data), shape);
  }
  return result;
}

nb::dict named(const std::vector<std::string>& names, const std::vector<double>& numbers) {
  nb::dict result;
  for (std::size_t i = 0; i < names.size(); ++i) result[names[i].c_str()] = numbers[i];
  return result;
}

bool by_replay(const SceneObject& object, const std::vector<std::string>& names, const std::string& mode) {
  bool textures = false;
  for (const std::string& name : names) textures = textures || object.parameter(name).has_values();
  if (mode == "images" && textures)
    throw UsageError("mode 'images': no image could show the derivative by each texel or voxel; need 'adjoint'");
  return mode == "adjoint" || textures || (mode == "automatic" && names.size() > most_derivative_images);
}

// Computes loss and gradient for each target; those of several are independent.
nb::dict image_loss(const SceneObject& object, const Variant* variant, const std::vector<std::string>& names,
                    const Targets& targets, const std::vector<int>& sensors, int spp, std::uint64_t seed,
                    int first_sample, bool single, bool exposure, const std::string& mode, bool errors,
                    const nb::object& progress) {
  const std::shared_ptr<const Scene> scene = rendered(object, variant);
  const bool replay = by_replay(object, names, mode);
  std::vector<LossGradient> losses;
  std::vector<std::vector<VoxelGrid>> values;
  std::vector<double> exposures;
  interruptible(progress, [&](Running& running) {
    for (std::size_t t = 0; t < targets.size(); ++t) {
      const RendererKey key{sensors[t], operator_of(single), names};
      MeasuredLoss measured;
      if (replay)
        measured = with_renderer(object.renderers().gradients, key, running, [&](Kept<GradientRenderer>& kept) {
          show(kept, scene, seed + t);
          return measure_loss(*kept.renderer, first_sample, spp, *targets[t], exposure, errors);
        });
      else
        measured = with_renderer(object.renderers().images, key, running, [&](Kept<Renderer>& kept) {
          show(kept, scene, seed + t);
          return measure_loss(*kept.renderer, first_sample, spp, *targets[t], exposure, {}, errors);
        });
      losses.push_back(measured.loss);
      values.push_back(std::move(measured.values));
      exposures.push_back(measured.exposure);
      running.update(static_cast<double>(t + 1) / static_cast<double>(targets.size()));
    }
    return 0;
  });
  const LossGradient mean = mean_of(losses);
  const auto images = static_cast<float>(targets.size());
  for (std::size_t p = 0; p < values.front().size(); ++p)
    for (std::size_t i = 0; i < values.front()[p].data.size(); ++i) {
      float sum = 0;
      for (const std::vector<VoxelGrid>& of : values) sum += of[p].data[i] / images;
      values.front()[p].data[i] = sum;
    }
  nb::dict result;
  result["loss"] = mean.loss;
  result["loss_stderr"] = mean.loss_stderr;
  result["gradient"] = named(names, mean.gradient);
  result["gradient_stderr"] = named(names, mean.gradient_stderr);
  result["values"] = arrays_of({0, Operator::full, names}, values.front());
  result["exposures"] = exposures;
  return result;
}

// The sum of weight times derivative image.
nb::dict weigh(const SceneObject& object, const Variant* variant, const std::vector<std::string>& names,
               const FloatArray& weights, int spp, std::uint64_t seed, int first_sample, int sensor, bool single) {
  const std::shared_ptr<const Scene> scene = rendered(object, variant);
  const std::vector<double> weight(weights.data(), weights.data() + weights.size());
  const RendererKey key{sensor, operator_of(single), names};
  WeighedDerivatives sum = interruptible(nb::none(), [&](Running& running) {
    return with_renderer(object.renderers().gradients, key, running, [&](Kept<GradientRenderer>& kept) {
      show(kept, scene, seed);
      return kept.renderer->render(first_sample, {spp}, [&](const std::vector<Rendering>& groups) {
        if (groups.front().mean.size() != weight.size())
          throw UsageError(fmt::format("weights: got {}, need {}, one a value of the image", weight.size(),
                                       groups.front().mean.size()));
        return std::vector<std::vector<double>>{weight};
      });
    });
  });
  nb::dict result;
  result["gradient"] = named(names, sum.value);
  result["values"] = arrays_of(key, sum.values);
  return result;
}

std::string gradcheck(const SceneObject& object, const std::vector<std::string>& names, int spp, std::uint64_t seed,
                      int sensor, bool single, const nb::object& progress) {
  const std::shared_ptr<const Scene> scene = object.scene();
  DerivativeCheck check = plan_check(*scene, names);
  return interruptible(progress, [&](Running& running) {
    const std::shared_ptr<SharedDevice> device = shared_device();
    const std::lock_guard lock(device->mutex);
    RenderOptions options;
    options.sensor = sensor;
    options.spp = spp;
    options.seed = seed;
    options.op = operator_of(single);
    options.cancel = &running.cancel();
    options.progress = [&](double done) { running.update(done); };
    run_check(device->device, *scene, options, check);
    return to_json(check, scene->file, device->device).dump();
  });
}

using Matrix = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

// The scene with each row's values of the parameters.
std::vector<Scene> with_values(const SceneObject& object, const std::vector<std::string>& names, const Matrix& values) {
  std::vector<Scene> scenes(values.shape(0), *object.scene());
  for (std::size_t i = 0; i < scenes.size(); ++i)
    for (std::size_t p = 0; p < names.size(); ++p) set_parameter(scenes[i], object.parameter(names[p]), values(i, p));
  return scenes;
}

std::vector<BatchImage> batch_of(Kept<BatchRenderer>& kept, const std::vector<Scene>& scenes,
                                 const std::vector<std::uint64_t>& seeds, int first_sample) {
  if (!kept.renderer) {
    kept.renderer = std::make_unique<BatchRenderer>(kept.device->device, kept.options());
    kept.geometry = kept.renderer->add_geometry(kept.renderer->geometry_of(scenes.front()));
  }
  std::vector<BatchImage> images;
  for (std::size_t i = 0; i < scenes.size(); ++i) images.push_back({&scenes[i], kept.geometry, seeds[i], first_sample});
  return images;
}

// Images of one scene with many values of its parameters, side by side: (images, height, width, channels).
nb::object render_batch(const SceneObject& object, const std::vector<std::string>& names, const Matrix& values, int spp,
                        const std::vector<std::uint64_t>& seeds, int first_sample, int sensor, bool single,
                        const nb::object& progress) {
  const std::vector<Scene> scenes = with_values(object, names, values);
  const RendererKey key{sensor, operator_of(single), {}};
  const std::vector<Rendering> images = interruptible(progress, [&](Running& running) {
    return with_renderer(object.renderers().batches, key, running, [&](Kept<BatchRenderer>& kept) {
      const std::vector<BatchImage> batch = batch_of(kept, scenes, seeds, first_sample);  // makes the renderer
      return kept.renderer->render(batch, spp);
    });
  });
  for (std::size_t i = 0; i < images.size(); ++i)
    for (const std::string& text : warnings_of(images[i], scenes[i])) warn(text, 2);
  std::vector<float> all;
  for (const Rendering& image : images) all.insert(all.end(), image.mean.begin(), image.mean.end());
  const Rendering& first = images.front();
  return numpy_array(std::move(all), {images.size(), count(first.height), count(first.width), count(first.channels)});
}

// Computes for each image the sum of weight times derivative image: (images, parameters).
nb::object weigh_batch(const SceneObject& object, const std::vector<std::string>& names, const Matrix& values,
                       const FloatArray& weights, int spp, const std::vector<std::uint64_t>& seeds, int first_sample,
                       int sensor, bool single) {
  const std::vector<Scene> scenes = with_values(object, names, values);
  const RendererKey key{sensor, operator_of(single), names};
  const std::vector<Rendering> images = interruptible(nb::none(), [&](Running& running) {
    return with_renderer(object.renderers().batches, key, running, [&](Kept<BatchRenderer>& kept) {
      const std::vector<BatchImage> batch = batch_of(kept, scenes, seeds, first_sample);  // makes the renderer
      return kept.renderer->render(batch, spp);
    });
  });
  if (weights.size() != images.size() * images.front().mean.size())
    throw UsageError(fmt::format("weights: got {}, need {}, one a value of the images", weights.size(),
                                 images.size() * images.front().mean.size()));
  std::vector<double> sums;
  const float* weight = weights.data();
  for (const Rendering& image : images) {
    for (const Image& derivative : image.derivatives) {
      double sum = 0;
      for (std::size_t i = 0; i < derivative.mean.size(); ++i)
        sum += static_cast<double>(weight[i]) * static_cast<double>(derivative.mean[i]);
      sums.push_back(sum);
    }
    weight += image.mean.size();
  }
  return numpy_array(std::move(sums), {images.size(), names.size()});
}

// The images of 16 groups of whole batches would be moved about for longer than their paths take: fewer groups, all
// multiplied with each other, are as unbiased (image_loss.h) and leave out a quarter of the pairs.
std::size_t batch_groups(int spp) {
  for (const int groups : {4, 3, 2})
    if (spp % groups == 0) return count(groups);
  if (spp <= 16) return count(spp);
  throw UsageError(fmt::format("spp: got {}, need 2 to 16 or a multiple of 2 or 3, for a batch", spp));
}

// Losses and gradients of them against a target each.
nb::dict batch_loss(const SceneObject& object, const std::vector<std::string>& names, const Matrix& values,
                    const Targets& targets, int spp, const std::vector<std::uint64_t>& seeds, int first_sample,
                    int sensor, bool single, const nb::object& progress) {
  const std::size_t groups = batch_groups(spp);
  if (targets.size() != values.shape(0) || seeds.size() != values.shape(0))
    throw UsageError(fmt::format("a batch of {} images with {} targets and {} seeds; need one each", values.shape(0),
                                 targets.size(), seeds.size()));
  const std::vector<Scene> scenes = with_values(object, names, values);
  const RendererKey key{sensor, operator_of(single), names};
  std::vector<double> losses, gradient;
  interruptible(progress, [&](Running& running) {
    std::vector<Rendering> images =
        with_renderer(object.renderers().batches, key, running, [&](Kept<BatchRenderer>& kept) {
          const std::vector<BatchImage> batch = batch_of(kept, scenes, seeds, first_sample);
          return kept.renderer->render(batch, spp, static_cast<int>(groups));
        });
    for (std::size_t i = 0; i < scenes.size(); ++i) {
      const auto first = std::make_move_iterator(images.begin() + static_cast<std::ptrdiff_t>(i * groups));
      const std::vector<Rendering> of_image(first, first + static_cast<std::ptrdiff_t>(groups));
      const LossGradient of = loss_gradient(of_image, *targets[i], 1, false);
      losses.push_back(of.loss);
      gradient.insert(gradient.end(), of.gradient.begin(), of.gradient.end());
    }
    return 0;
  });
  nb::dict result;
  result["loss"] = numpy_array(std::move(losses), {scenes.size()});
  result["gradient"] = numpy_array(std::move(gradient), {scenes.size(), names.size()});
  return result;
}

}  // namespace

void bind_gradient(nb::module_& module) {
  module.def("image_loss", &image_loss, "scene"_a, "variant"_a.none(), "parameters"_a, "targets"_a, "sensors"_a,
             "spp"_a, "seed"_a, "first_sample"_a, "single"_a, "exposure"_a, "mode"_a, "errors"_a, "progress"_a.none());
  module.def("weigh", &weigh, "scene"_a, "variant"_a.none(), "parameters"_a, "weights"_a, "spp"_a, "seed"_a,
             "first_sample"_a, "sensor"_a, "single"_a);
  module.def("gradcheck", &gradcheck, "scene"_a, "parameters"_a, "spp"_a, "seed"_a, "sensor"_a, "single"_a,
             "progress"_a.none());
  module.def("render_batch", &render_batch, "scene"_a, "parameters"_a, "values"_a, "spp"_a, "seeds"_a, "first_sample"_a,
             "sensor"_a, "single"_a, "progress"_a.none());
  module.def("weigh_batch", &weigh_batch, "scene"_a, "parameters"_a, "values"_a, "weights"_a, "spp"_a, "seeds"_a,
             "first_sample"_a, "sensor"_a, "single"_a);
  module.def("batch_loss", &batch_loss, "scene"_a, "parameters"_a, "values"_a, "targets"_a, "spp"_a, "seeds"_a,
             "first_sample"_a, "sensor"_a, "single"_a, "progress"_a.none());
}

}  // namespace itn::python
