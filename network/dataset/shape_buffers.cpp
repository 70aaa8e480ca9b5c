#include "network/dataset/shape_buffers.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "runtime/scene/transform.h"

namespace itn {
namespace {

Vec3 vec(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

struct Camera {
  Vec3 origin, left, up, forward;
  double spread;  // half the width seen at distance 1
  int width, height;

  explicit Camera(const Sensor& sensor)
      : spread(std::tan(sensor.fov_x / 2 * std::numbers::pi / 180)), width(sensor.width), height(sensor.height) {
    origin = transform_point(sensor.to_world, {0, 0, 0});
    left = transform_vector(sensor.to_world, {1, 0, 0});
    up = transform_vector(sensor.to_world, {0, 1, 0});
    forward = transform_vector(sensor.to_world, {0, 0, 1});
  }

  Vec3 ray(int x, int y) const {
    const double a = spread * (1 - (2 * x + 1.0) / width), b = spread * (height - (2 * y + 1.0)) / width;
    return normalize(forward + a * left + b * up);
  }
  // Film position [pixel]; the point lies in front of the camera.
  Vec2 film(const Vec3& p) const {
    const Vec3 v = p - origin;
    const double z = dot(v, forward) * spread;
    return {(1 - dot(v, left) / z) * width / 2, (height - dot(v, up) / z * width) / 2};
  }
};

// Distance along the ray, and the barycentric coordinates (Moeller and Trumbore 1997).
bool meets(const Vec3& origin, const Vec3& ray, const std::array<Vec3, 3>& corner, double& t, double& u, double& v) {
  const Vec3 e1 = corner[1] - corner[0], e2 = corner[2] - corner[0], p = cross(ray, e2);
  const double det = dot(e1, p);
  if (det == 0) return false;
  const Vec3 s = origin - corner[0], q = cross(s, e1);
  u = dot(s, p) / det;
  v = dot(ray, q) / det;
  t = dot(e2, q) / det;
  return u >= 0 && v >= 0 && u + v <= 1 && t > 0;
}

// Pixels whose centre may lie between two film positions.
std::pair<int, int> pixel_range(double low, double high, int count) {
  const auto clamped = [&](double x) { return static_cast<int>(std::clamp(x, -1.0, static_cast<double>(count))); };
  return {std::max(0, clamped(std::floor(low - 0.5))), std::min(count - 1, clamped(std::ceil(high - 0.5)))};
}

}  // namespace

ShapeBuffers shape_buffers(const Scene& scene, int sensor, int body) {
  const Camera camera(scene.sensors[static_cast<std::size_t>(sensor)]);
  const std::size_t pixels = static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  ShapeBuffers buffers{std::vector<Vec3>(pixels, Vec3{0, 0, 0}), std::vector<double>(pixels),
                       std::vector<double>(pixels)};
  std::vector<double> nearest(pixels, std::numeric_limits<double>::infinity());
  for (int k = 0; k < static_cast<int>(scene.shapes.size()); ++k) {
    const Mesh& mesh = *scene.shapes[static_cast<std::size_t>(k)].mesh;
    for (const auto& triangle : mesh.triangle) {
      std::array<Vec3, 3> corner;
      Vec2 low{1e9, 1e9}, high{-1e9, -1e9};
      bool in_front = true;
      for (std::size_t c = 0; c < 3; ++c) {
        corner[c] = vec(mesh.position[triangle[c]]);
        in_front &= dot(corner[c] - camera.origin, camera.forward) > 0;
      }
      if (in_front)
        for (const Vec3& p : corner) {
          const Vec2 at = camera.film(p);
          for (std::size_t d = 0; d < 2; ++d) {
            low[d] = std::min(low[d], at[d]);
            high[d] = std::max(high[d], at[d]);
          }
        }
      else  // a floor that reaches behind the camera: any pixel may see it
        low = {-1e9, -1e9}, high = {1e9, 1e9};
      const auto [left, right] = pixel_range(low[0], high[0], camera.width);
      const auto [top, bottom] = pixel_range(low[1], high[1], camera.height);
      for (int y = top; y <= bottom; ++y)
        for (int x = left; x <= right; ++x) {
          const std::size_t i = static_cast<std::size_t>(y * camera.width + x);
          const Vec3 ray = camera.ray(x, y);
          double t = 0, u = 0, v = 0;
          if (!meets(camera.origin, ray, corner, t, u, v) || t >= nearest[i]) continue;
          nearest[i] = buffers.depth[i] = t;
          buffers.mask[i] = k == body;
          Vec3 normal = cross(corner[1] - corner[0], corner[2] - corner[0]);
          if (!mesh.normal.empty())
            normal = (1 - u - v) * vec(mesh.normal[triangle[0]]) + u * vec(mesh.normal[triangle[1]]) +
                     v * vec(mesh.normal[triangle[2]]);
          buffers.normal[i] = normalize(dot(normal, ray) > 0 ? -1 * normal : normal);
        }
    }
  }
  return buffers;
}

}  // namespace itn
