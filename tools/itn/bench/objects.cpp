#include "tools/itn/bench/objects.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <vector>

#include "itn/exr.h"
#include "itn/file.h"
#include "runtime/base/parallel.h"

namespace itn {
namespace {

constexpr double pi = std::numbers::pi;
using Point = std::array<double, 3>;

struct Triangles {
  std::vector<Point> vertex;
  std::vector<std::array<std::int32_t, 3>> face;
};

Point operator+(const Point& a, const Point& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
Point operator*(double s, const Point& a) { return {s * a[0], s * a[1], s * a[2]}; }
Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Point normalized(const Point& a) { return (1 / std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])) * a; }

// A closed tube around the (2, 3) torus knot: 256 x 128 quads, 65,536 triangles.
Triangles torus_knot() {
  constexpr int along = 256, around = 128;
  constexpr double radius = 0.75, swing = 0.35, tube = 0.28;
  const auto centre = [](double t) -> Point {
    const double r = radius + swing * std::cos(3 * t);
    return {r * std::cos(2 * t), r * std::sin(2 * t), 1.2 * swing * std::sin(3 * t)};
  };
  Triangles mesh;
  for (int i = 0; i < along; ++i) {
    const double t = 2 * pi * i / along, step = 1e-4;
    const Point c = centre(t), tangent = normalized(centre(t + step) + -1.0 * centre(t - step));
    const Point side = normalized(cross(tangent, c)), normal = cross(side, tangent);
    for (int j = 0; j < around; ++j) {
      const double a = 2 * pi * j / around;
      mesh.vertex.push_back(c + tube * (std::cos(a) * normal + std::sin(a) * side));
    }
  }
  for (int i = 0; i < along; ++i)
    for (int j = 0; j < around; ++j) {
      const int k = (i + 1) % along, l = (j + 1) % around;
      mesh.face.push_back({i * around + j, k * around + l, k * around + j});
      mesh.face.push_back({i * around + j, i * around + l, k * around + l});
    }
  return mesh;
}

// A sphere with rounded spikes, from a cube of 74 x 74 quads a side: 65,712 triangles.
Triangles star() {
  constexpr int n = 74;
  Triangles mesh;
  std::map<std::array<int, 3>, std::int32_t> index;
  const auto vertex = [&](const std::array<int, 3>& lattice) {
    const auto [entry, is_new] = index.try_emplace(lattice, static_cast<std::int32_t>(mesh.vertex.size()));
    if (is_new) {
      Point d;
      for (std::size_t k = 0; k < 3; ++k) d[k] = std::tan(pi / 4 * (2.0 * lattice[k] / n - 1));
      d = normalized(d);
      const double spikes = std::sin(4 * d[0]) * std::sin(4 * d[1] + 1) * std::sin(4 * d[2] + 2);
      mesh.vertex.push_back((1 + 0.6 * spikes) * d);
    }
    return entry->second;
  };
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const int side : {0, n})
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
          std::array<std::int32_t, 4> quad;
          for (std::size_t corner = 0; corner < 4; ++corner) {
            std::array<int, 3> lattice{};
            lattice[axis] = side;
            lattice[(axis + 1) % 3] = i + (corner == 1 || corner == 2);
            lattice[(axis + 2) % 3] = j + (corner >= 2);
            quad[corner] = vertex(lattice);
          }
          if (side == 0) std::swap(quad[1], quad[3]);
          mesh.face.push_back({quad[0], quad[1], quad[2]});
          mesh.face.push_back({quad[0], quad[2], quad[3]});
        }
  return mesh;
}

// Longest side 1 scene unit, centred in x and y, standing on z = 0.
void stand_on_floor(Triangles& mesh) {
  Point low = mesh.vertex[0], high = mesh.vertex[0];
  for (const Point& v : mesh.vertex)
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], v[k]);
      high[k] = std::max(high[k], v[k]);
    }
  const double longest = std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
  for (Point& v : mesh.vertex)
    v = {(v[0] - (low[0] + high[0]) / 2) / longest, (v[1] - (low[1] + high[1]) / 2) / longest,
         (v[2] - low[2]) / longest};
}

template <class T>
void append(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

void write_ply(const std::string& path, const Triangles& mesh) {
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
      "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
      mesh.vertex.size(), mesh.face.size());
  for (const Point& v : mesh.vertex)
    for (const double x : v) append(bytes, static_cast<float>(x));
  for (const auto& face : mesh.face) {
    append(bytes, std::uint8_t{3});
    append(bytes, face);
  }
  write_file(path, bytes);
}

// Smooth noise on the whole numbers, from 0 to 1.
double lattice_noise(double x, double y, double z) {
  const double i = std::floor(x), j = std::floor(y), k = std::floor(z);
  const auto value = [&](double a, double b, double c) {
    auto h = static_cast<std::uint32_t>(static_cast<std::int32_t>(i + a) * 73856093) ^
             static_cast<std::uint32_t>(static_cast<std::int32_t>(j + b) * 19349663) ^
             static_cast<std::uint32_t>(static_cast<std::int32_t>(k + c) * 83492791);
    h = (h ^ (h >> 16)) * 0x7feb352dU;
    h = (h ^ (h >> 15)) * 0x846ca68bU;
    return static_cast<double>(h ^ (h >> 16)) * 0x1p-32;
  };
  const auto eased = [](double t) { return t * t * (3 - 2 * t); };
  const double u = eased(x - i), v = eased(y - j), w = eased(z - k);
  const auto along_x = [&](double b, double c) { return std::lerp(value(0, b, c), value(1, b, c), u); };
  return std::lerp(std::lerp(along_x(0, 0), along_x(1, 0), v), std::lerp(along_x(0, 1), along_x(1, 1), v), w);
}

double octaves(double x, double y, double z) {
  return (4 * lattice_noise(x, y, z) + 2 * lattice_noise(2 * x, 2 * y, 2 * z) + lattice_noise(4 * x, 4 * y, 4 * z)) / 7;
}

double cloud_density(double x, double y, double z) {
  const double from_centre = std::hypot(x - 0.5, y - 0.5, z - 0.5);
  if (from_centre > 0.5) return 0;
  return std::clamp(2.5 * (octaves(8 * x, 8 * y, 8 * z) + 0.12 - 1.3 * from_centre), 0.0, 1.0);
}

double plume_density(double x, double y, double z) {
  const double bend = 0.08 * std::sin(9 * z), width = 0.06 + 0.3 * z;
  const double from_axis = std::hypot(x - 0.5 - bend, y - 0.5 + 0.5 * bend) / width;
  if (from_axis > 1) return 0;
  return std::clamp(3 * (octaves(12 * x, 12 * y, 12 * z - 3) - 0.25 - 0.5 * from_axis), 0.0, 1.0) * (1 - 0.6 * z);
}

// value: of the centres of voxels in the unit cube.
void write_volume(const std::string& path, double (*value)(double, double, double)) {
  constexpr std::int32_t size = 256;
  std::vector<float> voxels(static_cast<std::size_t>(size) * size * size);
  parallel_for(size, [&](int k) {
    std::size_t at = static_cast<std::size_t>(k) * size * size;
    for (int j = 0; j < size; ++j)
      for (int i = 0; i < size; ++i)
        voxels[at++] = static_cast<float>(value((i + 0.5) / size, (j + 0.5) / size, (k + 0.5) / size));
  });
  std::string bytes = "VOL";
  append(bytes, std::uint8_t{3});
  for (const std::int32_t number : {1, size, size, size, 1}) append(bytes, number);  // 1: 32-bit floats
  for (const float bound : {0.0F, 0.0F, 0.0F, 1.0F, 1.0F, 1.0F}) append(bytes, bound);
  bytes.append(reinterpret_cast<const char*>(voxels.data()), voxels.size() * sizeof(float));
  write_file(path, bytes);
}

}  // namespace

void write_cloud(const std::string& path) { write_volume(path, cloud_density); }

void write_plume(const std::string& path) { write_volume(path, plume_density); }

void write_knot(const std::string& path) { write_ply(path, torus_knot()); }

void write_star(const std::string& path) {
  Triangles object = star();
  stand_on_floor(object);
  write_ply(path, object);
}

void write_tiles(const std::string& path, int size) {
  const int tile = size / 16;
  ExrImage image;
  image.width = image.height = size;
  image.channels = {"R", "G", "B"};
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) {
      const bool light = (x / tile + y / tile) % 2 == 0;
      for (const float value : light ? std::array{0.7F, 0.65F, 0.55F} : std::array{0.2F, 0.22F, 0.28F})
        image.data.push_back(value);
    }
  write_exr(path, image);
}

void write_window_sky(const std::string& path) {
  ExrImage image;
  image.width = 256;
  image.height = 128;
  image.channels = {"R", "G", "B"};
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const double up = std::cos(pi * (y + 0.5) / image.height);
      const bool window = x >= 60 && x < 76 && y >= 30 && y < 46;
      for (const double tint : {0.7, 0.85, 1.0})
        image.data.push_back(static_cast<float>(window ? 60 : tint * (0.25 + 0.35 * std::max(up, 0.0))));
    }
  write_exr(path, image);
}

}  // namespace itn
