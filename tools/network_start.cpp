#include "tools/network_start.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>

#include "network/input.h"
#include "network/loss.h"
#include "runtime/dataset/dataset_light.h"
#include "runtime/dataset/shape_buffers.h"
#include "runtime/error.h"
#include "runtime/scene/box.h"
#include "runtime/scene/parameters.h"
#include "runtime/scene/transform.h"
#include "tools/run_folder.h"

namespace itn::tools {
namespace {

// The shape that a medium is inside of.
struct Body {
  int shape = 0;
  double longest_side = 1;  // of the box around it, along the axes [scene units]
};

Body body_of(const Scene& scene, int medium, const std::string& run) {
  std::vector<int> bodies;
  for (std::size_t i = 0; i < scene.shapes.size(); ++i)
    if (scene.shapes[i].interior == medium) bodies.push_back(static_cast<int>(i));
  if (bodies.size() != 1)
    throw UsageError(fmt::format(
        "--init {}: the network knows media inside of one shape, and {} is inside of {}; give --start instead", run,
        scene.media[static_cast<std::size_t>(medium)].id, bodies.size()));
  return {bodies.front(), box_of(scene.shapes[static_cast<std::size_t>(bodies.front())]).longest_side()};
}

// What a network of six channels knows beside the image.
SeenShape seen_shape_of(const Scene& scene, int sensor, const Body& body, const std::string& run) {
  const Sensor& camera = scene.sensors[static_cast<std::size_t>(sensor)];
  for (const Shape& shape : scene.shapes)
    if (!shape.mesh)
      throw UsageError("--init " + run + ": the network's view of the shape needs meshes; one of the shapes is round");
  const ShapeBuffers buffers = shape_buffers(scene, sensor, body.shape);
  std::vector<float> normal;
  for (std::size_t k = 0; k < 3; ++k)
    for (const Vec3& n : buffers.normal) normal.push_back(static_cast<float>(n[k]));
  return seen_shape(std::move(normal), {buffers.depth.begin(), buffers.depth.end()},
                    {buffers.mask.begin(), buffers.mask.end()}, camera.width, scene.file, body.longest_side);
}

std::array<double, 3> light_of(const Scene& scene, const std::string& run) {
  if (!scene.environment || scene.environment->kind == Emitter::Kind::constant)
    throw UsageError("--init " + run +
                     ": the network knows light that comes from somewhere, a sun or an environment map, and the "
                     "scene has none; give --start");
  if (scene.environment->kind == Emitter::Kind::envmap) return mean_direction(*scene.environment);
  return normalize(transform_vector(scene.environment->to_world, scene.environment->sunsky.sun_direction));
}

// By the outputs' names.
std::map<std::string, double> guess(Network& network, const std::string& image, const KnownScene* known) {
  const NetworkDescription& description = network.description();
  std::vector<float> input(network.image_values());
  network_input(description, read_luminance(image, description.size), known, input);
  const std::vector<double> parameters = parameters_of(network.forward(input, 1), description.outputs);
  std::map<std::string, double> by_name;
  for (std::size_t i = 0; i < parameters.size(); ++i) by_name[description.outputs[i].name] = parameters[i];
  return by_name;
}

std::string output_name(ParameterKind kind) {
  switch (kind) {
    case ParameterKind::sigma_t:
      return "sigma_t";
    case ParameterKind::albedo:
      return "albedo";
    case ParameterKind::g:
      return "g";
    default:
      return "";
  }
}

}  // namespace

void set_network_start(Scene& scene, const std::vector<std::string>& parameters, const std::vector<std::string>& given,
                       const std::string& run, const std::string& image, int sensor) {
  const std::vector<Parameter> all = list_parameters(scene);
  std::vector<Parameter> guessed;
  for (const std::string& name : parameters) {
    if (std::find(given.begin(), given.end(), name) != given.end()) continue;
    guessed.push_back(find_parameter(all, name));
    const Parameter& parameter = guessed.back();
    if (output_name(parameter.kind).empty())
      throw UsageError(fmt::format("--init {}: the network does not guess {}; give --start {}=VALUE", run, name, name));
    if (parameter.index != guessed.front().index)
      throw UsageError(
          fmt::format("--init {}: the network knows one medium, and {} is of another one than the "
                      "parameters before it; give --start {}=VALUE",
                      run, name, name));
  }
  if (guessed.empty()) return;

  Network network = network_of(run);
  const Medium& medium = scene.media.at(static_cast<std::size_t>(guessed.front().index));
  const Body body = body_of(scene, guessed.front().index, run);
  std::optional<SeenShape> shape;
  std::optional<KnownScene> known;
  if (network.description().channels > 1) {
    shape = seen_shape_of(scene, sensor, body, run);
    known.emplace(KnownScene{*shape, light_of(scene, run)});
  }
  const std::map<std::string, double> guesses = guess(network, image, known ? &*known : nullptr);
  for (const Parameter& parameter : guessed) {
    const auto found = guesses.find(output_name(parameter.kind));
    if (found == guesses.end())
      throw UsageError(fmt::format("--init {}: the network does not guess {}; give --start {}=VALUE", run,
                                   parameter.name, parameter.name));
    double value = found->second;
    // The network has learnt from bodies whose longest side is one scene unit: what it sees is sigma_t times that side.
    if (parameter.kind == ParameterKind::sigma_t)
      value *= network.description().mm_per_unit / body.longest_side / (medium.scale > 0 ? medium.scale : 1);
    set_parameter(scene, parameter, value);
  }
}

}  // namespace itn::tools
