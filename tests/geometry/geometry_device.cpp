#include "tests/geometry/geometry_device.h"

#include <bit>
#include <cstdlib>

namespace itn::test {

Seconds Stopwatch::time() const {
  return {std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(),
          static_cast<double>(std::clock() - clock_) / CLOCKS_PER_SEC};
}

std::ostream& operator<<(std::ostream& out, const Stopwatch& watch) {
  const Seconds s = watch.time();
  return out << s.wall << " s, " << s.core << " core seconds";
}

Scene scene_of(std::vector<Shape> shapes) {
  Scene scene;
  scene.media.resize(1);
  scene.bsdfs.resize(1);
  scene.shapes = std::move(shapes);
  return scene;
}

GeometryOnDevice::GeometryOnDevice(const Scene& scene, int width, int box_width)
    : GeometryOnDevice(std::vector<Scene>{scene}, width, box_width) {}

GeometryOnDevice::GeometryOnDevice(const std::vector<Scene>& scenes, int width, int box_width) : width_(width) {
  geometry.box_width = box_width;
  for (const Scene& scene : scenes) append_geometry(scene, geometry);
  setenv("ITN_KERNEL_DIR", ITN_SOURCE_DIR "/tests/geometry", 1);
  program_ = device_.build("geometry_test.cl", {{"WIDTH", std::to_string(width)},
                                                {"BOX_WIDTH", std::to_string(box_width)},
                                                {"HAS_ROUND", "1"},
                                                {"HAS_SMOOTH", "1"},
                                                {"HAS_TEXTURE", "1"}});
  unsetenv("ITN_KERNEL_DIR");
  nodes_ = device_.upload(geometry.nodes, "nodes");
  leaves_ = device_.upload(geometry.leaves, "leaves");
  primitives_ = device_.upload(geometry.primitives, "primitives");
  grid_ = device_.upload(geometry.grid, "grid");
  record_ = device_.upload(std::vector<GeometryRecord>{record()}, "record");
}

void GeometryOnDevice::set_arrays(cl::Kernel& kernel) const {
  kernel.setArg(0, nodes_);
  kernel.setArg(1, leaves_);
  kernel.setArg(2, primitives_);
  kernel.setArg(3, record_);
}

std::vector<TestHit> GeometryOnDevice::trace(const std::vector<TestRay>& rays, Seconds* time) const {
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
  const Stopwatch watch;
  device_.launch(kernel, padded.size() / each, 1);
  device_.finish();
  if (time) *time = watch.time();
  std::vector<TestHit> hits(rays.size());
  device_.download(out, hits);
  return hits;
}

void GeometryOnDevice::fly(const std::vector<TestRay>& rays, std::vector<int>& clear, std::vector<float>& distance,
                           Seconds* time) const {
  const std::size_t n = (rays.size() + 15) / 16 * 16;
  std::vector<float> components(7 * n);
  for (std::size_t i = 0; i < n; ++i) {
    const TestRay& ray = rays[std::min(i, rays.size() - 1)];
    for (std::size_t k = 0; k < 3; ++k) {
      components[k * n + i] = ray.origin[k];
      components[(3 + k) * n + i] = ray.direction[k];
    }
    components[6 * n + i] = ray.t_max;
  }
  clear.resize(n);
  distance.resize(n);
  cl::Kernel kernel(program_, "fly");
  const cl::Buffer in = device_.upload(components, "rays"), out = device_.upload(clear, "clear"),
                   bound = device_.upload(distance, "distance");
  kernel.setArg(0, grid_);
  kernel.setArg(1, record_);
  kernel.setArg(2, in);
  kernel.setArg(3, out);
  kernel.setArg(4, bound);
  kernel.setArg(5, static_cast<int>(n));
  device_.launch(kernel, n / static_cast<std::size_t>(width_), 1);
  device_.finish();
  const Stopwatch watch;
  device_.launch(kernel, n / static_cast<std::size_t>(width_), 1);
  device_.finish();
  if (time) *time = watch.time();
  device_.download(out, clear);
  device_.download(bound, distance);
  clear.resize(rays.size());
  distance.resize(rays.size());
}

std::vector<GeometryOnDevice::Frame> GeometryOnDevice::frames(std::vector<TestHit> hits) const {
  const std::size_t n = hits.size();
  hits.resize((n + 15) / 16 * 16, hits.at(0));
  std::vector<Frame> frames(hits.size());
  cl::Kernel kernel(program_, "frames");
  const cl::Buffer in = device_.upload(hits, "hits"), out = device_.upload(frames, "frames");
  kernel.setArg(0, primitives_);
  kernel.setArg(1, in);
  kernel.setArg(2, out);
  device_.launch(kernel, hits.size() / static_cast<std::size_t>(width_), 1);
  device_.download(out, frames);
  frames.resize(n);
  return frames;
}

std::vector<TestRay> GeometryOnDevice::paths(Vec3 start, double mean_free_path, double albedo, std::size_t n,
                                             unsigned seed) const {
  constexpr std::size_t each = 1000;
  std::vector<TestRay> rays((n + each - 1) / each * each);
  cl::Kernel kernel(program_, "record_paths");
  set_arrays(kernel);
  for (cl_uint k = 0; k < 3; ++k) kernel.setArg(4 + k, static_cast<float>(start[k]));
  kernel.setArg(7, static_cast<float>(mean_free_path));
  kernel.setArg(8, static_cast<float>(albedo));
  kernel.setArg(9, static_cast<int>(each));
  kernel.setArg(10, seed);
  const cl::Buffer out = device_.allocate(rays.size() * sizeof(TestRay), "rays");
  kernel.setArg(11, out);
  device_.launch(kernel, rays.size() / each, 1);
  device_.download(out, rays);
  return rays;
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

namespace {

using Vector = std::array<double, 3>;
Vector operator-(const Vector& a, const Vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

double meet_triangle(const Vector& o, const Vector& d, const Vector& a, const Vector& b, const Vector& c) {
  const Vector e1 = b - a, e2 = c - a, p = cross(d, e2), s = o - a, q = cross(s, e1);
  const double det = dot(e1, p), u = dot(s, p) / det, v = dot(d, q) / det;
  return u >= 0 && v >= 0 && u + v <= 1 ? dot(e2, q) / det : NAN;
}

// The first solution from t_min on.
double meet_sphere(const Vector& o, const Vector& d, const Vector& center, double radius, double t_min) {
  const Vector f = o - center;
  const double a = dot(d, d), b = dot(f, d), root = std::sqrt(b * b - a * (dot(f, f) - radius * radius));
  const double t = (-b - root) / a;
  return t >= t_min ? t : (-b + root) / a;
}

double meet_disk(const Vector& o, const Vector& d, const Vector& center, const Vector& dual_u, const Vector& dual_v) {
  const Vector n = cross(dual_u, dual_v);
  const double t = dot(center - o, n) / dot(d, n);
  const Vector p = Vector{o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2]} - center;
  return std::pow(dot(p, dual_u), 2) + std::pow(dot(p, dual_v), 2) <= 1 ? t : NAN;
}

// The first solution from t_min on between the ends. dual: the axis over its squared length.
double meet_cylinder(const Vector& o, const Vector& d, const Vector& center, const Vector& dual, double radius,
                     double t_min) {
  const Vector f = o - center;
  const double square = dot(dual, dual), fz = dot(f, dual), dz = dot(d, dual);
  const double a = dot(d, d) - dz * dz / square, b = dot(f, d) - fz * dz / square;
  const double root = std::sqrt(b * b - a * (dot(f, f) - fz * fz / square - radius * radius));
  for (const double t : {(-b - root) / a, (-b + root) / a})
    if (t >= t_min && fz + t * dz >= 0 && fz + t * dz <= 1) return t;
  return NAN;
}

}  // namespace

double meet_triangle(const TestRay& ray, const std::array<float, 3>& a, const std::array<float, 3>& b,
                     const std::array<float, 3>& c) {
  const auto wide = [](const std::array<float, 3>& p) { return Vector{p[0], p[1], p[2]}; };
  return meet_triangle(wide(ray.origin), wide(ray.direction), wide(a), wide(b), wide(c));
}

ExactHit closest(const Geometry& geometry, const TestRay& ray, double t_min) {
  const auto width = static_cast<std::size_t>(geometry.box_width);
  const GeometryRecord& record = geometry.records.back();
  const Vector o{ray.origin[0], ray.origin[1], ray.origin[2]}, d{ray.direction[0], ray.direction[1], ray.direction[2]};
  ExactHit best;
  std::vector<int> stack{record.root};
  while (!stack.empty()) {
    const int child = stack.back();
    stack.pop_back();
    if (child == CHILD_NONE) continue;
    if (CHILD_IS_NODE(child)) {
      const float* node = &geometry.nodes[record.first_node + static_cast<std::size_t>(child) * NODE_ROWS * width];
      for (std::size_t i = 0; i < width; ++i) {
        double enter = t_min, leave = std::min<double>(best.t, ray.t_max);
        for (std::size_t k = 0; k < 3; ++k) {
          const double low = node[2 * k * width + i], high = node[(2 * k + 1) * width + i];
          if (d[k] == 0) {
            if (o[k] < low || o[k] > high) leave = -INFINITY;
          } else {
            const double a = (low - o[k]) / d[k], b = (high - o[k]) / d[k];
            enter = std::max(enter, std::min(a, b));
            leave = std::min(leave, std::max(a, b));
          }
        }
        if (enter <= leave) stack.push_back(std::bit_cast<int>(node[NODE_CHILD * width + i]));
      }
      continue;
    }
    const float* block =
        &geometry.leaves[record.first_leaf + static_cast<std::size_t>(CHILD_BLOCK_INDEX(child)) * BLOCK_ROWS * width];
    for (std::size_t i = 0; i < width; ++i) {
      const int primitive = std::bit_cast<int>(block[BLOCK_PRIMITIVE * width + i]);
      if (primitive < 0 || primitive == ray.skip) continue;
      const auto point = [&](std::size_t row) -> Vector {
        return {block[row * width + i], block[(row + 1) * width + i], block[(row + 2) * width + i]};
      };
      const double radius = block[BLOCK_RADIUS * width + i];
      const double t = !CHILD_IS_ROUND(child) ? meet_triangle(o, d, point(BLOCK_A), point(BLOCK_B), point(BLOCK_C))
                       : radius > 0           ? meet_sphere(o, d, point(BLOCK_CENTER), radius, t_min)
                       : radius < 0 ? meet_cylinder(o, d, point(BLOCK_CENTER), point(BLOCK_DUAL_AXIS), -radius, t_min)
                                    : meet_disk(o, d, point(BLOCK_CENTER), point(BLOCK_DUAL_U), point(BLOCK_DUAL_V));
      if (t >= t_min && t < best.t && t < ray.t_max) best = {t, primitive};
    }
  }
  return best;
}

std::array<int, 3> GeometryOnDevice::sizes() const {
  cl::Kernel kernel(program_, "sizes");
  std::vector<int> out(3);
  const cl::Buffer buffer = device_.upload(out, "sizes");
  kernel.setArg(0, buffer);
  device_.launch(kernel, 1, 1);
  device_.download(buffer, out);
  return {out[0], out[1], out[2]};
}

}  // namespace itn::test
