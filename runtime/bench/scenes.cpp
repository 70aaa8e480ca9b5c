#include "runtime/bench/scenes.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <numbers>

#include "runtime/base/file.h"
#include "runtime/image/exr.h"

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

void write_tiles(const std::string& path) {
  constexpr int size = 128, tile = 8;
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

// Everything but the sensor's place, the light and the object is the same in all scenes.
std::string scene_xml(int rr_depth, double fov, const char* lookat, const std::string& body) {
  return fmt::format(R"(<scene version="3.0.0">
  <integrator type="volpath">
    <integer name="max_depth" value="256"/>
    <integer name="rr_depth" value="{}"/>
  </integrator>
  <sensor type="perspective">
    <float name="fov" value="{}"/>
    <transform name="to_world">
      <lookat {} up="0, 0, 1"/>
    </transform>
    <film type="hdrfilm">
      <integer name="width" value="128"/>
      <integer name="height" value="128"/>
      <rfilter type="box"/>
    </film>
    <sampler type="independent">
      <integer name="sample_count" value="64"/>
    </sampler>
  </sensor>
{}</scene>
)",
                     rr_depth, fov, lookat, body);
}

std::string medium_xml(double sigma_t, const std::string& albedo, double g) {
  return fmt::format(R"(    <medium type="homogeneous" name="interior" id="material">
      <float name="sigma_t" value="{}"/>
      {}
      <phase type="hg">
        <float name="g" value="{}"/>
      </phase>
    </medium>
)",
                     sigma_t, albedo, g);
}

std::string object_xml(const char* mesh, const std::string& bsdf, const std::string& medium) {
  return fmt::format(R"(  <shape type="ply">
    <string name="filename" value="{}"/>
{}{}  </shape>
)",
                     mesh, bsdf, medium);
}

std::string rough_xml(const char* distribution, double alpha, double ior) {
  return fmt::format(R"(    <bsdf type="roughdielectric">
      <string name="distribution" value="{}"/>
      <float name="alpha" value="{}"/>
      <float name="int_ior" value="{}"/>
      <float name="ext_ior" value="1"/>
    </bsdf>
)",
                     distribution, alpha, ior);
}

std::string scalar_albedo(double albedo) { return fmt::format(R"(<float name="albedo" value="{}"/>)", albedo); }

// 30 degrees from the zenith. Widening the sun keeps its power.
std::string sunsky_xml(double aperture) {
  return fmt::format(R"(  <emitter type="sunsky">
    <vector name="sun_direction" value="-0.4, -0.3, 0.866"/>
    <float name="sun_aperture" value="{}"/>
  </emitter>
)",
                     aperture);
}

constexpr const char* constant_xml = R"(  <emitter type="constant">
    <rgb name="radiance" value="1, 1, 1"/>
  </emitter>
)";

constexpr const char* floor_xml = R"(  <shape type="rectangle">
    <transform name="to_world">
      <scale x="8" y="8"/>
    </transform>
    <bsdf type="diffuse">
      <texture type="bitmap" name="reflectance">
        <string name="filename" value="tiles.exr"/>
        <transform name="to_uv">
          <scale value="3"/>
        </transform>
      </texture>
    </bsdf>
  </shape>
)";

}  // namespace

std::vector<BenchScene> write_bench_scenes(const std::string& folder) {
  write_ply(folder + "/knot.ply", torus_knot());
  Triangles object = star();
  stand_on_floor(object);
  write_ply(folder + "/star.ply", object);
  write_tiles(folder + "/tiles.exr");

  std::vector<BenchScene> scenes;
  const auto add = [&](const std::string& group, const std::string& name, const std::string& xml) {
    const std::string file = fmt::format("{}/{:02}.xml", folder, scenes.size());
    write_file(file, xml);
    scenes.push_back({name, group, file});
  };

  constexpr const char* knot_view = R"(origin="0, -4.2, 2.4" target="0, 0, 0")";
  struct Material {
    double sigma_t, albedo, g;
  };
  for (const bool sunny : {false, true})
    for (const auto& [sigma_t, albedo, g] : {Material{25, .6, .5}, {25, .95, .5}, {100, .9, .5}, {300, .95, .8}})
      add(sunny ? "knot, sunsky" : "knot, constant",
          fmt::format("knot {} {} {} {}", sunny ? "sunsky" : "constant", sigma_t, albedo, g),
          scene_xml(
              5, 36, knot_view,
              (sunny ? sunsky_xml(0.5358) : constant_xml) +
                  object_xml("knot.ply", rough_xml("ggx", 0.2, 1.5), medium_xml(sigma_t, scalar_albedo(albedo), g))));

  // Narrow view from 45 degrees above, as in the paper's data.
  constexpr const char* floor_view = R"(origin="0, -24, 24.35" target="0, 0, 0.35")";
  for (const auto& [sigma_t, albedo, g] : {Material{30, .39, .2}, {100, .87, .4}, {276, .95, .8}})
    add("star on a floor, index-matched", fmt::format("star matched {} {} {}", sigma_t, albedo, g),
        scene_xml(
            20, 2.5, floor_view,
            sunsky_xml(30) + floor_xml +
                object_xml("star.ply", "    <bsdf type=\"null\"/>\n", medium_xml(sigma_t, scalar_albedo(albedo), g))));
  add("star on a floor, rough", "star rough 100 RGB .5",
      scene_xml(20, 2.5, floor_view,
                sunsky_xml(8) + floor_xml +
                    object_xml("star.ply", rough_xml("beckmann", 0.25, 1.33),
                               medium_xml(100, R"(<rgb name="albedo" value="0.97, 0.9, 0.7"/>)", 0.5))));
  return scenes;
}

}  // namespace itn
