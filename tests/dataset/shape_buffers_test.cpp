// Buffers of a known shape, as the camera of a data set sees it.
#include "network/dataset/shape_buffers.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "network/dataset/dataset_scene.h"
#include "runtime/scene/shapes/polygonise.h"
#include "runtime/scene/transform.h"

using namespace itn;

TEST_CASE("normal, depth and mask of a ball on the floor are those of the ball") {
  Manifest set;
  set.size = 64;
  const auto mesh = std::make_shared<const Mesh>(shape_mesh(ball({0, 0, 0}, 1), 20000));
  const Scene scene = dataset_scene(set, mesh, sun_and_sky(sun_direction(0, 30)), {});
  const ShapeBuffers buffers = shape_buffers(scene, 0, 1);
  const Sensor& sensor = scene.sensors[0];
  const Vec3 camera = transform_point(sensor.to_world, {0, 0, 0}), centre{0, 0, 0.5};
  const double radius = 0.5, spread = std::tan(sensor.fov_x / 2 * std::numbers::pi / 180);
  int body = 0, floor = 0;
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) {
      const std::size_t i = static_cast<std::size_t>(64 * y + x);
      const Vec3 ray = normalize(
          transform_vector(sensor.to_world, {spread * (1 - (2 * x + 1) / 64.0), spread * (1 - (2 * y + 1) / 64.0), 1}));
      const double along = dot(centre - camera, ray);
      const double miss = length(centre - (camera + along * ray));
      if (std::abs(miss - radius) < 0.01) continue;  // the mesh is a polyhedron
      CAPTURE(x, y);
      const Vec3 hit = camera + buffers.depth[i] * ray;
      if (miss < radius) {
        ++body;
        CHECK(buffers.mask[i] == 1);
        CHECK(buffers.depth[i] == Approx(along - std::sqrt(radius * radius - miss * miss)).margin(0.01));
        CHECK(dot(buffers.normal[i], normalize(hit - centre)) > 0.999);
      } else {
        ++floor;
        CHECK(buffers.mask[i] == 0);
        CHECK(hit[2] == Approx(0).margin(2e-3));
        CHECK(buffers.normal[i][2] == Approx(1));
      }
    }
  CHECK(body > 1000);
  CHECK(floor > 1000);
}
