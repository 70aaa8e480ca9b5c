// Kernels of geometry_test.cl over one geometry.
#pragma once
#include <chrono>
#include <cmath>
#include <ctime>
#include <ostream>

#include "itn/device.h"
#include "runtime/render/compile/geometry.h"
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

// Wall time, and core seconds of the whole process: the measure on a machine with other work.
struct Seconds {
  double wall = 1, core = 1;
};
class Stopwatch {
 public:
  Seconds time() const;
  friend std::ostream& operator<<(std::ostream& out, const Stopwatch& watch);

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::clock_t clock_ = std::clock();
};

class GeometryOnDevice {
 public:
  GeometryOnDevice(const Scene& scene, int width, int box_width);
  // All in the same arrays; kernels see the last one.
  GeometryOnDevice(const std::vector<Scene>& scenes, int width, int box_width);
  Geometry geometry;
  const GeometryRecord& record() const { return geometry.records.back(); }

  std::vector<TestHit> trace(const std::vector<TestRay>& rays, Seconds* time = nullptr) const;
  // Flights of t_max: which ones the grid declares clear, and its bound of the distance from the origin to any surface.
  void fly(const std::vector<TestRay>& rays, std::vector<int>& clear, std::vector<float>& distance,
           Seconds* time = nullptr) const;
  // Queries of a path tracer inside a medium: rays of paths from `start` with t_max drawn from the mean free path.
  std::vector<TestRay> paths(Vec3 start, double mean_free_path, double albedo, std::size_t n, unsigned seed) const;
  WalkCounts walk(Vec3 start, double mean_free_path, std::uint64_t segments, unsigned seed) const;
  struct Frame {
    std::array<float, 3> normal, shading;
    std::array<float, 2> texture;
    std::array<float, 3> beside;
  };
  std::vector<Frame> frames(std::vector<TestHit> hits) const;
  std::array<int, 3> sizes() const;

 private:
  void set_arrays(cl::Kernel& kernel) const;
  Device device_;
  cl::Program program_;
  cl::Buffer nodes_, leaves_, primitives_, record_, grid_;
  int width_;
};

// The closest hit in double, over the same hierarchy; t infinite when there is none. Everything counts
// from t_min on.
struct ExactHit {
  double t = INFINITY;
  int primitive = -1;
};
ExactHit closest(const Geometry& geometry, const TestRay& ray, double t_min = 0);

// Distance along the ray in double, NaN: passes by.
double meet_triangle(const TestRay& ray, const std::array<float, 3>& a, const std::array<float, 3>& b,
                     const std::array<float, 3>& c);

Scene scene_of(std::vector<Shape> shapes);

}  // namespace itn::test
