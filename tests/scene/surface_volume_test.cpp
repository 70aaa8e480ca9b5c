// surfacevolume: a picture on a mesh that drives the medium below (runtime/scene/volume/surface_volume.h).
#include "runtime/scene/volume/surface_volume.h"

#include <cmath>
#include <limits>
#include <random>

#include "itn/parameters.h"
#include "runtime/scene/mesh/nearest_point.h"
#include "runtime/scene/transform.h"
#include "tests/scene/scene_folder.h"

using namespace itn;

namespace {

// A ball of radius 2 with u along its equator, which ends meet at a seam, and v from pole to pole.
Mesh ball(int steps) {
  Mesh mesh;
  for (int j = 0; j <= steps; ++j)
    for (int i = 0; i <= 2 * steps; ++i) {
      const double theta = M_PI * j / steps, phi = M_PI * i / steps;
      mesh.position.push_back({static_cast<float>(2 * std::sin(theta) * std::cos(phi)),
                               static_cast<float>(2 * std::sin(theta) * std::sin(phi)),
                               static_cast<float>(2 * std::cos(theta))});
      mesh.texcoord.push_back({static_cast<float>(0.5 * i / steps), static_cast<float>(j) / static_cast<float>(steps)});
    }
  const auto at = [&](int i, int j) { return static_cast<std::uint32_t>(j * (2 * steps + 1) + i); };
  for (int j = 0; j < steps; ++j)
    for (int i = 0; i < 2 * steps; ++i) {
      if (j > 0) mesh.triangle.push_back({at(i, j), at(i, j + 1), at(i + 1, j)});
      if (j + 1 < steps) mesh.triangle.push_back({at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)});
    }
  return mesh;
}

// A picture that goes smoothly around and across.
double shown(double u, double v) { return 0.5 + 0.3 * std::sin(2 * M_PI * u) * std::sin(M_PI * v) + 0.1 * v; }

Texture picture() {
  auto bitmap = std::make_shared<Bitmap>();
  bitmap->width = 256;
  bitmap->height = 128;
  bitmap->channels = 1;
  for (int y = 0; y < 128; ++y)
    for (int x = 0; x < 256; ++x) bitmap->data.push_back(static_cast<float>(shown((x + 0.5) / 256, (y + 0.5) / 128)));
  return make_bitmap(bitmap);
}

}  // namespace

TEST_CASE("the nearest point of a mesh is that of its nearest triangle") {
  const Mesh mesh = ball(8);
  const NearestPoint nearest(mesh);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-3, 3);
  const auto point = [&](std::size_t t, double b, double c) {
    Vec3 p{0, 0, 0};
    const std::array<double, 3> share{1 - b - c, b, c};
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t a = 0; a < 3; ++a) p[a] += share[k] * static_cast<double>(mesh.position[mesh.triangle[t][k]][a]);
    return p;
  };
  for (int k = 0; k < 200; ++k) {
    const Vec3 p{uniform(random), uniform(random), uniform(random)};
    const NearestPoint::Place found = nearest(p);
    CHECK(length(p - point(found.triangle, found.b, found.c)) == Approx(found.distance).epsilon(1e-9).margin(1e-12));
    CHECK((found.b >= 0 && found.c >= 0 && found.b + found.c <= 1 + 1e-12));
    double least = std::numeric_limits<double>::infinity();  // of many places of all triangles
    for (std::size_t t = 0; t < mesh.triangle.size(); ++t)
      for (int i = 0; i <= 8; ++i)
        for (int j = 0; i + j <= 8; ++j) least = std::min(least, length(p - point(t, i / 8.0, j / 8.0)));
    CHECK(found.distance <= least + 1e-12);
    CHECK(found.distance > least - 0.1);  // places are this near to each other
  }
}

TEST_CASE(
    "voxels of a surfacevolume show the picture at the nearest point, with an error of the second order in their "
    "edge") {
  const Mesh mesh = ball(128);  // whose facets the nearest point shows, too
  const Texture texture = picture();
  double last = 0;
  for (const int resolution : {8, 16}) {
    const Volume volume = surface_volume(mesh, texture, resolution);
    const VoxelGrid& grid = *volume.grid;
    CHECK((grid.width == resolution && grid.height == resolution && grid.depth == resolution && grid.channels == 1));
    // Between voxels as on the device, trilinear; half way to the middle, where all points of the surface are near.
    double sum = 0;
    int count = 0;
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    while (count < 2000) {
      const Vec3 w = normalize(Vec3{normal(random), normal(random), normal(random)});
      if (std::abs(w[2]) > 0.8) continue;  // near the poles the picture itself is sharp
      const Vec3 p = 1.6 * w;
      Vec3 at{};
      for (std::size_t a = 0; a < 3; ++a) at[a] = (p[a] / 4 + 0.5) * resolution - 0.5;
      double value = 0;
      for (int k = 0; k < 8; ++k) {
        double share = 1;
        std::size_t index = 0;
        for (std::size_t a = 3; a-- > 0;) {
          const double low = std::floor(at[a]);
          const bool up = (k >> a) & 1;
          share *= up ? at[a] - low : 1 - (at[a] - low);
          index = index * static_cast<std::size_t>(resolution) + static_cast<std::size_t>(low + (up ? 1 : 0));
        }
        value += share * static_cast<double>(grid.data[index]);
      }
      const double phi = std::atan2(w[1], w[0]);
      const double exact = shown((phi < 0 ? phi + 2 * M_PI : phi) / (2 * M_PI), std::acos(w[2]) / M_PI);
      sum += (value - exact) * (value - exact);
      ++count;
    }
    const double error = std::sqrt(sum / count);
    INFO("resolution " << resolution << ": " << error);
    CHECK(error < 0.25 / (resolution * resolution));
    if (last > 0) CHECK(error < 0.35 * last);
    last = error;
  }
}

TEST_CASE("a surfacevolume lies where its mesh does, and what it lacks is said") {
  SceneFolder folder;
  folder.write("p.pgm", std::string("P5 2 1 255\n") + std::string("\0\xff", 2));
  const auto volume = [](const std::string& inside) {
    return "<medium type=\"homogeneous\" id=\"m\">\n<volume type=\"surfacevolume\" name=\"albedo\">\n" + inside +
           "</volume></medium>";
  };
  const std::string texture =
      "<texture type=\"bitmap\"><string name=\"filename\" value=\"p.pgm\"/>"
      "<boolean name=\"raw\" value=\"true\"/><string name=\"filter_type\" value=\"nearest\"/></texture>";
  // u goes along x: below the left half of the rectangle all is black, below the right one white
  const std::string sheet =
      "<shape type=\"rectangle\"><transform name=\"to_world\"><scale x=\"3\"/></transform></shape>";
  const Scene scene = folder.load(volume(texture + sheet + "<integer name=\"resolution\" value=\"6\"/>"));
  const Volume& v = *scene.media.at(0).value("albedo").volume;
  CHECK((v.grid->width == 6 && v.grid->height == 2 && v.grid->depth == 1));
  CHECK(v.grid->data == std::vector<float>{0, 0, 0, 1, 1, 1, 0, 0, 0, 1, 1, 1});
  const Vec3 corner = transform_point(v.to_world, {1, 0, 0.5});
  CHECK((corner[0] == Approx(3) && corner[1] == Approx(-1) && corner[2] == Approx(0).margin(1e-12)));
  CHECK(find_parameter(list_parameters(scene), "m.albedo").by_voxels);
  folder.check_error(volume(sheet), 4, {"no <texture>"});
  folder.check_error(volume(texture), 4, {"no <shape>"});
  folder.check_error(volume(texture + "<shape type=\"sphere\"/>"), 4, {"has no mesh", "PLY"});
  folder.check_error(volume(texture + sheet + "<integer name=\"resolution\" value=\"0\"/>"), 4,
                     {"resolution = 0", "512"});
  folder.write_tetrahedron("t.ply");
  folder.check_error(volume(texture + "<shape type=\"ply\"><string name=\"filename\" value=\"t.ply\"/></shape>"), 4,
                     {"no texture coordinates"});
}
