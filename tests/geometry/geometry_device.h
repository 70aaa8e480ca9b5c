// Kernels of geometry_test.cl over one geometry.
#pragma once
#include <memory>

#include "runtime/device/device.h"
#include "runtime/scene/geometry.h"
#include "tests/support/meshes.h"

namespace itn::test {

// As in geometry_test.cl.
struct TestRay {
  std::array<float, 3> origin, direction;
  float t_max = 1e30f;
  std::int32_t skip = -1, inside = 0;
};
struct TestHit {
  float t, u, v;
  std::array<float, 3> position;
  std::int32_t primitive, front;
};

struct WalkCounts {
  std::uint64_t segments = 0, escaped = 0, front = 0, surface = 0;
};

class GeometryOnDevice {
 public:
  GeometryOnDevice(const Scene& scene, int width, int box_width);
  Geometry geometry;
  const GeometryRecord& record() const { return geometry.records.back(); }

  std::vector<TestHit> trace(const std::vector<TestRay>& rays, double* seconds = nullptr) const;
  WalkCounts walk(Vec3 start, double mean_free_path, std::uint64_t segments, unsigned seed) const;
  std::array<int, 3> sizes() const;

 private:
  void set_arrays(cl::Kernel& kernel) const;
  Device device_;
  cl::Program program_;
  cl::Buffer nodes_, leaves_, primitives_, record_;
};

Scene scene_of(std::vector<Shape> shapes);

}  // namespace itn::test
