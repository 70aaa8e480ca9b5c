#include "python/src/render.h"

#include <fmt/format.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "itn/error.h"
#include "python/src/arrays.h"
#include "python/src/renderers.h"
#include "runtime/image/preview.h"
#include "runtime/render/rendering_warnings.h"

namespace itn::python {
namespace {

using namespace nb::literals;

nb::dict as_dict(Rendering&& image, const RendererKey& key, const Scene& scene) {
  const std::vector<std::size_t> shape{static_cast<std::size_t>(image.height), static_cast<std::size_t>(image.width),
                                       static_cast<std::size_t>(image.channels)};
  nb::dict result;
  result["warnings"] = warnings_of(image, scene);
  result["image"] = numpy_array(std::move(image.mean), shape);
  result["stderr"] = numpy_array(std::move(image.stderr_), shape);
  result["mean"] = image.mean_of_image;
  result["mean_stderr"] = image.stderr_of_mean;
  nb::dict derivatives, errors;
  for (std::size_t i = 0; i < image.derivatives.size(); ++i) {
    derivatives[key.derivatives[i].c_str()] = numpy_array(std::move(image.derivatives[i].mean), shape);
    errors[key.derivatives[i].c_str()] = numpy_array(std::move(image.derivatives[i].stderr_), shape);
  }
  result["derivatives"] = derivatives;
  result["derivatives_stderr"] = errors;
  result["spp"] = image.spp;
  result["paths"] = image.paths;
  result["misplaced"] = image.misplaced;
  result["endless"] = image.endless;
  result["build_s"] = image.build_s;
  result["render_s"] = image.render_s;
  return result;
}

nb::dict render_image(const SceneObject& object, const Variant* variant, const RendererKey& key, int spp,
                      std::uint64_t seed, int first_sample, const nb::object& progress) {
  const std::shared_ptr<const Scene> scene = rendered(object, variant);
  Rendering image = interruptible(progress, [&](Running& running) {
    return with_renderer(object.renderers().images, key, running, [&](Kept<Renderer>& kept) {
      show(kept, scene, seed);
      return kept.renderer->render(first_sample, spp);
    });
  });
  return as_dict(std::move(image), key, *scene);
}

nb::object picture(const FloatArray& image, bool is_signed) {
  if (image.ndim() != 3 || (image.shape(2) != 1 && image.shape(2) != 3))
    throw UsageError("picture: need an array of shape (height, width, 1 or 3)");
  const auto channels = static_cast<int>(image.shape(2));
  const std::vector<float> values = as_vector(image);
  return numpy_array(is_signed ? red_blue(values, channels).bytes : tone_mapped(values, channels),
                     {image.shape(0), image.shape(1), 3});
}

}  // namespace

void bind_render(nb::module_& module) {
  module.def(
      "render",
      [](const SceneObject& object, const Variant* variant, const std::vector<std::string>& derivatives, int spp,
         std::uint64_t seed, int sensor, bool single, int first_sample, const nb::object& progress) {
        return render_image(object, variant, {sensor, single ? Operator::single : Operator::full, derivatives}, spp,
                            seed, first_sample, progress);
      },
      "scene"_a, "variant"_a.none(), "derivatives"_a, "spp"_a, "seed"_a, "sensor"_a, "single"_a, "first_sample"_a,
      "progress"_a.none());
  module.def("picture", &picture, "image"_a, "signed"_a,
             "8-bit sRGB of an image, tone-mapped, or of a derivative, in red and blue.");
}

}  // namespace itn::python
