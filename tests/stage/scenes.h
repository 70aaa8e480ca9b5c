// Scenes of the stage tests: a unit sphere about the origin, with or without a floor.
#pragma once
#include <algorithm>
#include <memory>

#include "itn/scene.h"

namespace itn::test {

// eta: of dielectrics, alpha: of rough ones
inline Bsdf bsdf_of(const std::string& type, double eta = 1.5, double alpha = 0.2,
                    const std::string& distribution = "ggx") {
  Bsdf bsdf = make_bsdf(type, distribution);
  if (type == "dielectric" || type == "roughdielectric") {
    bsdf.set("int_ior", eta);
    bsdf.set("ext_ior", 1);
  }
  if (type == "roughdielectric") bsdf.set("alpha", alpha);
  return bsdf;
}

inline Medium medium_of(double sigma_t, double albedo, double g) {
  Medium medium;
  medium.set("sigma_t", sigma_t);
  medium.set("albedo", albedo);
  if (g == 0) return medium;
  medium.phase.become(*find_model(phase_models(), "hg"));
  medium.phase.set("g", g);
  return medium;
}

// With what probability roulette lets a path go on from its vertex number `depth`. lasts: of heavy paths
inline double survival(int depth, double largest, double lasts) {
  return std::min(largest / 0.5, depth <= 512 ? 1 : largest < 16 ? 0.95 : lasts);
}

// The unit sphere, filled with the medium.
inline Scene sphere_scene(const Bsdf& bsdf, const Medium& medium) {
  Scene scene;
  scene.sensors.resize(1);
  Sensor& sensor = scene.sensors[0];
  sensor.fov_x = 30;
  sensor.width = sensor.height = sensor.crop_width = sensor.crop_height = 16;
  scene.bsdfs = {bsdf};
  scene.media = {medium};
  Shape shape;
  shape.kind = Shape::Kind::sphere;
  shape.bsdf = 0;
  shape.interior = 0;
  scene.shapes = {shape};
  scene.integrator.rr_depth = 1000;
  scene.environment.emplace();
  return scene;
}

// Adds the square [-half, half]^2 at z = height, facing up, u along x and v along y.
inline void add_floor(Scene& scene, const Bsdf& bsdf, float half, float height) {
  auto mesh = std::make_shared<Mesh>();
  mesh->position = {{-half, -half, height}, {half, -half, height}, {half, half, height}, {-half, half, height}};
  mesh->texcoord = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  mesh->triangle = {{0, 1, 2}, {0, 2, 3}};
  Shape shape;
  shape.mesh = mesh;
  shape.bsdf = static_cast<int>(scene.bsdfs.size());
  scene.bsdfs.push_back(bsdf);
  scene.shapes.push_back(shape);
}

// A sun so wide that chance finds it, with or without the sky.
inline Environment wide_sun(double aperture_degree, Vec3 direction, double sky_scale) {
  Environment emitter = make_environment("sunsky");
  emitter.sun.direction = direction;
  emitter.sun.aperture = aperture_degree;
  emitter.set("sky_scale", sky_scale);
  return emitter;
}

}  // namespace itn::test
