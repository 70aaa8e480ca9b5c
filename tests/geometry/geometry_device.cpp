#include "tests/geometry/geometry_device.h"

#include <chrono>
#include <cstdlib>

namespace itn::test {

Scene scene_of(std::vector<Shape> shapes) {
  Scene scene;
  scene.media.resize(1);
  scene.bsdfs.resize(1);
  scene.shapes = std::move(shapes);
  return scene;
}

GeometryOnDevice::GeometryOnDevice(const Scene& scene, int width, int box_width) {
  geometry.box_width = box_width;
  append_geometry(scene, geometry);
  setenv("ITN_KERNEL_DIR", ITN_SOURCE_DIR "/tests/geometry", 1);
  program_ = device_.build("geometry_test.cl",
                           {{"WIDTH", std::to_string(width)}, {"BOX_WIDTH", std::to_string(box_width)}});
  unsetenv("ITN_KERNEL_DIR");
  nodes_ = device_.upload(geometry.nodes, "nodes");
  leaves_ = device_.upload(geometry.leaves, "leaves");
  primitives_ = device_.upload(geometry.primitives, "primitives");
  record_ = device_.upload(std::vector<GeometryRecord>{record()}, "record");
}

void GeometryOnDevice::set_arrays(cl::Kernel& kernel) const {
  kernel.setArg(0, nodes_);
  kernel.setArg(1, leaves_);
  kernel.setArg(2, primitives_);
  kernel.setArg(3, record_);
}

std::vector<TestHit> GeometryOnDevice::trace(const std::vector<TestRay>& rays, double* seconds) const {
  constexpr std::size_t each = 256;
  std::vector<TestRay> padded = rays;
  padded.resize((rays.size() + each - 1) / each * each, rays.at(0));
  cl::Kernel kernel(program_, "trace_rays");
  set_arrays(kernel);
  const cl::Buffer in = device_.upload(padded, "rays"), out = device_.allocate(padded.size() * sizeof(TestHit), "hits");
  kernel.setArg(4, in);
  kernel.setArg(5, out);
  kernel.setArg(6, static_cast<int>(each));
  device_.launch(kernel, 1, 1);  // compiles
  device_.finish();
  const auto start = std::chrono::steady_clock::now();
  device_.launch(kernel, padded.size() / each, 1);
  device_.finish();
  if (seconds) *seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::vector<TestHit> hits(rays.size());
  device_.download(out, hits);
  return hits;
}

WalkCounts GeometryOnDevice::walk(Vec3 start, double mean_free_path, std::uint64_t segments, unsigned seed) const {
  constexpr std::size_t items = 64;
  const auto each = static_cast<int>(segments / items);
  cl::Kernel kernel(program_, "walk");
  set_arrays(kernel);
  std::vector<std::uint32_t> counts(3 * items);
  const cl::Buffer out = device_.upload(counts, "counts");
  for (cl_uint k = 0; k < 3; ++k) kernel.setArg(4 + k, static_cast<float>(start[k]));
  kernel.setArg(7, static_cast<float>(mean_free_path));
  kernel.setArg(8, each);
  kernel.setArg(9, seed);
  kernel.setArg(10, out);
  device_.launch(kernel, items, 1);
  device_.download(out, counts);
  WalkCounts sum;
  sum.segments = static_cast<std::uint64_t>(each) * items;
  for (std::size_t i = 0; i < items; ++i) {
    sum.escaped += counts[3 * i];
    sum.front += counts[3 * i + 1];
    sum.surface += counts[3 * i + 2];
  }
  return sum;
}

std::array<int, 3> GeometryOnDevice::sizes() const {
  cl::Kernel kernel(program_, "sizes");
  std::vector<int> out(3);
  const cl::Buffer buffer = device_.upload(out, "sizes");
  kernel.setArg(0, buffer);
  device_.launch(kernel, 1);
  device_.download(buffer, out);
  return {out[0], out[1], out[2]};
}

}  // namespace itn::test
