// A damaged mesh, once mended, looks like the whole one; unmended, it is rendered on request and found out.
#include <catch2/catch.hpp>
#include <fstream>
#include <random>

#include "../support/temporary_folder.h"
#include "../support/z_test.h"
#include "runtime/scene/mesh/mesh_file.h"
#include "transport.h"

using namespace itn;
using namespace itn::test;

namespace {

// A mesh around a medium, with an index-matched boundary.
struct MeshScene {
  explicit MeshScene(const std::string& file) : mesh(read_mesh(file)) {}
  TemporaryFolder folder;
  Mesh mesh;

  Scene load(const LoadOptions& options = {}) const {
    write_ply(folder / "mesh.ply", mesh);
    std::ofstream(folder / "scene.xml") << R"(<scene version="3.0.0">
      <integrator type="volpath"/>
      <emitter type="constant"/>
      <sensor type="perspective">
        <float name="fov" value="40"/>
        <transform name="to_world"><lookat origin="0, -4, 1.5" target="0, 0, 0" up="0, 0, 1"/></transform>
        <film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="32"/><rfilter type="box"/></film>
      </sensor>
      <shape type="ply"><string name="filename" value="mesh.ply"/><bsdf type="null"/>
        <medium type="homogeneous" name="interior"><float name="sigma_t" value="10"/></medium>
      </shape>
    </scene>)";
    return load_scene(folder / "scene.xml", {}, options);
  }
};

Rendering render(const Scene& scene, std::uint64_t seed) {
  RenderOptions options;
  options.spp = 256;
  options.seed = seed;
  return itn::render(device(), scene, options);
}

}  // namespace

TEST_CASE("a mended mesh has the image of the whole one, within noise", "[transport][stat]") {
  MeshScene knot(test_scene("mitsuba/knot.ply"));
  const Rendering whole = render(knot.load(), 1);
  std::mt19937 random(1);
  for (int k = 0; k < 20; ++k)
    knot.mesh.triangle.erase(knot.mesh.triangle.begin() +
                             static_cast<std::ptrdiff_t>(random() % knot.mesh.triangle.size()));
  const Scene scene = knot.load();
  REQUIRE(scene.warnings.size() == 1);
  CHECK_THAT(scene.warnings[0], Catch::Contains("closed ") && Catch::Contains(" holes with "));
  const Rendering mended = render(scene, 2);
  CHECK(mended.misplaced == 0);
  std::vector<double> z;
  for (std::size_t i = 0; i < whole.mean.size(); i += static_cast<std::size_t>(whole.channels)) {
    const double spread = std::hypot(whole.stderr_[i], mended.stderr_[i]);
    if (spread > 0) z.push_back((mended.mean[i] - whole.mean[i]) / spread);
  }
  REQUIRE(z.size() > 200);
  constexpr double significance = 0.0027;
  const Estimate a = image_mean(whole), b = image_mean(mended);
  CHECK(std::abs(a.value - b.value) < 4 * std::hypot(a.stderr_, b.stderr_));
  CHECK(z_histogram(z).p_value > significance);
  double largest = 0;
  for (const double score : z) largest = std::max(largest, std::abs(score));
  CHECK(largest < largest_z_bound(z.size(), significance));
}

TEST_CASE("an open mesh is rendered on request, and its stray paths are counted", "[transport]") {
  MeshScene star(test_scene("mitsuba/star.ply"));
  std::erase_if(star.mesh.triangle, [&](const auto& t) { return star.mesh.position[t[0]][1] < 0; });
  CHECK_THROWS_WITH(star.load(), Catch::Contains("open edges") && Catch::Contains("(open)"));
  const Scene scene = star.load({.open = true});
  REQUIRE(scene.warnings.size() == 1);
  const Rendering image = render(scene, 3);
  CHECK(image.misplaced > image.paths / 100);
  for (const float value : image.mean) CHECK(std::isfinite(value));
}
