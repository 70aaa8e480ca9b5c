#include "runtime/dataset/dataset_scene.h"

#include <cmath>
#include <numbers>

#include "runtime/base/random.h"
#include "runtime/scene/mesh/shape_meshes.h"
#include "runtime/scene/transform.h"

namespace itn {
namespace {

constexpr double view_angle = 2.5;      // [degree]
constexpr double view_width = 1.6;      // [unit] at the object: any shape fits, however it is turned
constexpr double view_height = 0.45;    // what the lens is aimed at, above the floor [unit]
constexpr double floor_half_side = 40;  // [unit]: beyond what light from the object reaches
constexpr double floor_depth = 1e-3;    // below the shape's lowest point: surfaces that coincide have no order
constexpr double tile = 1.0 / 6;        // of the floor's pattern [unit]

// Tiles of two greys, each a little different: light that passes through a body shows what is beneath it. 16 x 16
// tiles, one texel each, repeated.
std::shared_ptr<const Bitmap> floor_pattern() {
  constexpr int tiles = 16;
  Bitmap bitmap{tiles, tiles, 1, {}};
  for (int y = 0; y < tiles; ++y)
    for (int x = 0; x < tiles; ++x) {
      const double shade = random_uniform(7, 0, static_cast<std::uint64_t>(tiles * y + x));
      bitmap.data.push_back(static_cast<float>(((x + y) % 2 == 0 ? 0.25 : 0.55) + 0.1 * shade));
    }
  return std::make_shared<const Bitmap>(std::move(bitmap));
}

std::shared_ptr<const Mesh> floor_mesh() {
  Mesh mesh = rectangle_mesh();
  for (auto& p : mesh.position)
    p = {static_cast<float>(floor_half_side) * p[0], static_cast<float>(floor_half_side) * p[1],
         static_cast<float>(-floor_depth)};
  return std::make_shared<const Mesh>(std::move(mesh));
}

Sensor sensor_of(const Manifest& set) {
  Sensor sensor;
  sensor.id = "camera";
  sensor.fov_x = view_angle;
  const double distance = view_width / 2 / std::tan(view_angle / 2 * std::numbers::pi / 180);
  const Vec3 target{0, 0, view_height};
  sensor.to_world = look_at(target + distance * normalize(Vec3{0, -1, 1}), target, {0, 0, 1});
  sensor.width = sensor.height = sensor.crop_width = sensor.crop_height = set.size;
  sensor.spp = set.spp;
  sensor.luminance = true;
  sensor.filter = FilterKind::box;
  return sensor;
}

}  // namespace

const char *const dataset_sigma_t = "medium.sigma_t", *const dataset_albedo = "medium.albedo",
                  *const dataset_g = "phase.g";

Scene dataset_scene(const Manifest& set, const std::shared_ptr<const Mesh>& shape, const Environment& light,
                    const DatasetMaterial& material) {
  static const std::shared_ptr<const Mesh> the_floor = floor_mesh();
  static const std::shared_ptr<const Bitmap> the_pattern = floor_pattern();
  Scene scene;
  scene.file = "data set";
  scene.integrator.rr_depth = 5;
  scene.sensors = {sensor_of(set)};

  Bsdf ground = make_bsdf("diffuse");
  ground.id = "ground";
  Texture& paint = ground.value("reflectance");
  paint = make_bitmap(the_pattern);
  paint.nearest = true;
  paint.wrap = Texture::Wrap::repeat;
  const double repeats = 2 * floor_half_side / (the_pattern->width * tile);
  paint.to_uv = {repeats, 0, 0, 0, repeats, 0};
  Bsdf boundary = make_bsdf(set.boundary.rough ? "roughdielectric" : "null");
  boundary.id = "boundary";
  if (set.boundary.rough) {
    boundary.set("alpha", set.boundary.alpha);
    boundary.set("int_ior", set.boundary.int_ior);
  }
  scene.bsdfs = {ground, boundary};

  Medium medium;
  medium.id = "medium";
  medium.set("sigma_t", material.sigma_t * set.mm_per_unit);
  medium.set("albedo", material.albedo);
  medium.phase.become(*find_model(phase_models(), "hg"));
  medium.phase.id = "phase";
  medium.phase.set("g", material.g);
  scene.media = {medium};

  Shape floor, body;
  floor.id = "floor";
  floor.mesh = the_floor;
  floor.bsdf = 0;
  body.id = "body";
  body.mesh = shape;
  body.bsdf = 1;
  body.interior = 0;
  scene.shapes = {floor, body};

  scene.environment = light;
  return scene;
}

}  // namespace itn
