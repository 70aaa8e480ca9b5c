#include "network/prediction/known_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "itn/error.h"
#include "kernels/shared/environment_layout.h"
#include "network/dataset/dataset_light.h"
#include "network/dataset/shape_buffers.h"
#include "runtime/scene/box.h"
#include "runtime/scene/transform.h"

namespace itn {
namespace {

SeenShape seen_shape_of(Scene scene, int sensor, int size, const Body& body, const std::string& who) {
  film_for_network(scene, sensor, size, who);
  for (const Shape& shape : scene.shapes)
    if (!shape.mesh)
      throw UsageError(who + ": the network's view of the shape needs meshes; one of the shapes is round");
  const ShapeBuffers buffers = shape_buffers(scene, sensor, body.shape);
  std::vector<float> normal;
  for (std::size_t k = 0; k < 3; ++k)
    for (const Vec3& n : buffers.normal) normal.push_back(static_cast<float>(n[k]));
  return seen_shape(std::move(normal), {buffers.depth.begin(), buffers.depth.end()},
                    {buffers.mask.begin(), buffers.mask.end()}, size, scene.file, body.longest_side);
}

std::array<double, 3> light_of(const Scene& scene, const std::string& who) {
  if (!scene.environment || (scene.environment->model->traits & ENVIRONMENT_EVEN))
    throw UsageError(who +
                     ": the network knows light that comes from somewhere, a sun or an environment map, and the "
                     "scene has none");
  if (scene.environment->bitmap) return mean_direction(*scene.environment);
  return normalize(transform_vector(scene.environment->to_world, scene.environment->sun.direction));
}

}  // namespace

Body body_of(const Scene& scene, int medium, const std::string& who) {
  std::vector<int> bodies;
  for (std::size_t i = 0; i < scene.shapes.size(); ++i)
    if (scene.shapes[i].interior == medium) bodies.push_back(static_cast<int>(i));
  if (bodies.size() != 1)
    throw UsageError(fmt::format("{}: the network knows media inside of one shape, and {} is inside of {}", who,
                                 scene.media[static_cast<std::size_t>(medium)].id, bodies.size()));
  return {bodies.front(), box_of(scene.shapes[static_cast<std::size_t>(bodies.front())]).longest_side()};
}

void film_for_network(Scene& scene, int sensor, int size, const std::string& who) {
  Sensor& camera = scene.sensors[static_cast<std::size_t>(sensor)];
  if (camera.width != camera.height || camera.crop_width != camera.width || camera.crop_height != camera.height)
    throw UsageError(
        fmt::format("{}: the network sees square images, the scene's sensor takes {} x {} of {} x {} pixels", who,
                    camera.crop_width, camera.crop_height, camera.width, camera.height));
  const bool is_ideal =
      camera.principal_x == 0 && camera.principal_y == 0 && camera.pixel_aspect == 1 &&
      std::all_of(camera.distortion.begin(), camera.distortion.end(), [](double k) { return k == 0; });
  if (!is_ideal)
    throw UsageError(
        who +
        ": the network learnt from cameras without distortion whose axis is in the middle of the film, and "
        "the scene's is another one; undistort the image, and give a scene with such a camera");
  camera.width = camera.height = camera.crop_width = camera.crop_height = size;
}

SceneView::SceneView(const Scene& scene, int sensor, const NetworkDescription& network, const Body& body,
                     const std::string& who)
    : shape_(seen_shape_of(scene, sensor, network.size, body, who)) {
  if (sees(network, "light")) light_ = light_of(scene, who);
}

double sigma_t_in_scene(double sigma_t, const NetworkDescription& network, const Body& body) {
  return sigma_t * network.mm_per_unit / body.longest_side;
}

double sigma_t_unit(const Scene& scene, int medium, const NetworkDescription& network, const Body& body) {
  const double scale = scene.media.at(static_cast<std::size_t>(medium)).number("scale");
  return sigma_t_in_scene(1, network, body) / (scale > 0 ? scale : 1);
}

}  // namespace itn
