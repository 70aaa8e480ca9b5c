#include <catch2/catch.hpp>
#include <fstream>

#include "itn/error.h"
#include "itn/load_scene.h"
#include "tests/support/temporary_folder.h"

using namespace itn;

TEST_CASE("a whole scene is read with Mitsuba's defaults") {
  TemporaryFolder folder;
  std::ofstream(folder / "a.ply") << "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
                                     "property float z\nelement face 4\nproperty list uchar int vertex_indices\n"
                                     "end_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n";
  std::ofstream(folder / "s.xml") << R"(<scene version="3.0.0">
  <default name="g" value="0.5"/>
  <integrator type="volpath"><integer name="max_depth" value="-1"/></integrator>
  <medium type="homogeneous" id="skin">
    <rgb name="sigma_t" value="1, 2, 3"/><float name="albedo" value="0.9"/>
    <phase type="hg"><float name="g" value="$g"/></phase>
  </medium>
  <sensor type="perspective">
    <transform name="to_world"><lookat origin="0,0,-5" target="0,0,0" up="0,1,0"/></transform>
    <film type="hdrfilm"><integer name="width" value="64"/><integer name="height" value="32"/></film>
    <sampler type="independent"><integer name="sample_count" value="16"/></sampler>
  </sensor>
  <shape type="ply">
    <string name="filename" value="a.ply"/>
    <bsdf type="roughdielectric"><float name="alpha" value="0.2"/><string name="int_ior" value="water"/></bsdf>
    <ref name="interior" id="skin"/>
  </shape>
  <shape type="sphere"><float name="radius" value="2"/></shape>
  <emitter type="constant"/>
</scene>)";
  const Scene scene = load_scene(folder / "s.xml");
  REQUIRE(scene.media.size() == 1);
  CHECK(scene.media[0].id == "skin");
  CHECK(scene.media[0].phase.id == "hg0");
  CHECK(scene.media[0].phase.number("g") == 0.5);
  CHECK(scene.media[0].value("sigma_t").by_component);
  CHECK(scene.media[0].colour("sigma_t") == Rgb{1, 2, 3});
  REQUIRE(scene.shapes.size() == 2);
  CHECK(scene.shapes[0].mesh->triangle.size() == 4);
  CHECK(scene.shapes[0].mesh->normal.size() == 4);
  CHECK(scene.shapes[0].interior == 0);
  CHECK(scene.bsdfs[static_cast<std::size_t>(scene.shapes[0].bsdf)].number("int_ior") == 1.333);
  CHECK(scene.bsdfs[static_cast<std::size_t>(scene.shapes[1].bsdf)].type() == "diffuse");
  CHECK(scene.sensors[0].spp == 16);
  CHECK(scene.warnings.empty());
  CHECK(load_scene(folder / "s.xml", {{"g", "-0.5"}}).media[0].phase.number("g") == -0.5);
  CHECK_THROWS_AS(load_scene(folder / "s.xml", {{"g", "1.5"}}), InputError);
  CHECK_THROWS_AS(load_scene(folder / "s.xml", {{"h", "1.5"}}), UsageError);
}
