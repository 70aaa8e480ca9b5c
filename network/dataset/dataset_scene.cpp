#include "network/dataset/dataset_scene.h"

#include <cmath>
#include <numbers>

#include "runtime/base/random.h"
#include "runtime/scene/mesh/shape_meshes.h"
#include "runtime/scene/transform.h"

namespace itn {
namespace {

constexpr double view_angle = 2.5;      // [degree]
constexpr double view_width = 1.6;      // [unit] at the object: any shape fits, however it is rotated
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

double camera_distance() { return view_width / 2 / std::tan(view_angle / 2 * std::numbers::pi / 180); }

// From the object towards the camera, unit.
Vec3 towards_camera(const Manifest::Image& image) {
  if (!image.camera) return normalize(Vec3{0, -1, 1});
  const double e = image.camera->elevation * std::numbers::pi / 180, a = image.camera->azimuth * std::numbers::pi / 180;
  return {std::cos(e) * std::sin(a), -std::cos(e) * std::cos(a), std::sin(e)};
}

Sensor sensor_of(const Manifest& set, const Manifest::Image& image) {
  Sensor sensor;
  sensor.id = "camera";
  sensor.fov_x = view_angle;
  const Vec3 target{0, 0, view_height};
  sensor.to_world = look_at(target + camera_distance() * towards_camera(image), target, {0, 0, 1});
  sensor.width = sensor.height = sensor.crop_width = sensor.crop_height = set.size;
  sensor.spp = set.spp;
  sensor.luminance = !set.in_colours;
  sensor.filter = FilterKind::box;
  return sensor;
}

}  // namespace

const char *const dataset_sigma_t = "medium.sigma_t", *const dataset_albedo = "medium.albedo",
                  *const dataset_g = "phase.g";

DatasetMaterial material_of(const Manifest::Image& image) {
  return {image.sigma_t, image.albedo, image.g, image.colours};
}

Scene dataset_scene(const Manifest& set, const std::shared_ptr<const Mesh>& shape, const Environment& light,
                    const DatasetMaterial& material) {
  return dataset_scene(set, {}, shape, light, material);
}

Scene dataset_scene(const Manifest& set, const Manifest::Image& image, const std::shared_ptr<const Mesh>& shape,
                    const Environment& light, const DatasetMaterial& material) {
  static const std::shared_ptr<const Mesh> the_floor = floor_mesh();
  static const std::shared_ptr<const Bitmap> the_pattern = floor_pattern();
  Scene scene;
  scene.file = "data set";
  scene.integrator.rr_depth = 5;
  scene.sensors = {sensor_of(set, image)};

  Bsdf ground = make_bsdf("diffuse");
  ground.id = "ground";
  Texture& paint = ground.value("reflectance");
  paint = make_bitmap(the_pattern);
  paint.nearest = true;
  paint.wrap = Texture::Wrap::repeat;
  const double repeats = 2 * floor_half_side / (the_pattern->width * tile);
  paint.to_uv = {repeats, 0, 0, 0, repeats, 0};
  const Manifest::Boundary& of_body = image.boundary ? *image.boundary : set.boundary;
  Bsdf boundary = make_bsdf(of_body.rough ? "roughdielectric" : "null");
  boundary.id = "boundary";
  if (of_body.rough) {
    boundary.set("alpha", of_body.alpha);
    boundary.set("int_ior", of_body.int_ior);
  }
  scene.bsdfs = {ground, boundary};

  Medium medium;
  medium.id = "medium";
  if (material.colours) {
    Rgb sigma_t = material.colours->sigma_t;
    for (double& value : sigma_t) value *= set.mm_per_unit;
    medium.set("sigma_t", sigma_t);
    medium.set("albedo", material.colours->albedo);
  } else {
    medium.set("sigma_t", material.sigma_t * set.mm_per_unit);
    medium.set("albedo", material.albedo);
  }
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

Scene in_flash(Scene scene, double irradiance) {
  const Transform& camera = scene.sensors.front().to_world;
  scene.environment = lamp_alone(-1.0 * transform_vector(camera, {0, 0, 1}), irradiance);
  return scene;
}

Vec3 before_camera(const Manifest::Image& image, const Vec3& direction) {
  return image.camera ? transform_vector(rotate({0, 0, 1}, -image.camera->azimuth), direction) : direction;
}

}  // namespace itn
