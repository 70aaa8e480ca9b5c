// Scenes far from the origin, and shapes that single precision does not tell.
#include <cmath>
#include <cstdint>
#include <stdexcept>

#include "runtime/scene/box.h"
#include "runtime/scene/mesh/placed_mesh.h"
#include "runtime/scene/transform.h"
#include "tests/scene/scene_folder.h"

using namespace itn;

namespace {

// One of each thing that has a place; $x moves all of them.
const std::string everything = R"(<default name="x" value="0"/>
<sensor type="perspective"><transform name="to_world"><lookat origin="0,0,-5" target="0,0,0" up="0,1,0"/><translate x="$x"/></transform></sensor>
<sensor type="distant"><film type="hdrfilm"><integer name="width" value="1"/><integer name="height" value="1"/></film>
  <vector name="direction" value="0 0 1"/><point name="target" x="$x" y="0" z="0"/></sensor>
<emitter type="point"><point name="position" x="$x" y="4" z="0"/></emitter>
<emitter type="spot"><transform name="to_world"><translate x="1"/><translate x="$x"/></transform></emitter>
<shape type="rectangle"><transform name="to_world"><translate y="2"/><translate x="$x"/></transform>
  <emitter type="directionalarea"/></shape>
<shape type="cube"><transform name="to_world"><rotate y="1" angle="30"/><translate x="$x"/></transform><bsdf type="null"/>
  <medium name="interior" type="heterogeneous"><volume name="sigma_t" type="constvolume"><float name="value" value="1"/>
  <transform name="to_world"><translate z="3"/><translate x="$x"/></transform></volume></medium></shape>
<shape type="sphere"><point name="center" x="$x" y="0" z="3"/>
  <sensor type="irradiancemeter"><film type="hdrfilm"><integer name="width" value="1"/><integer name="height" value="1"/></film></sensor></shape>
<shape type="obj"><string name="filename" value="a.obj"/><bsdf type="diffuse"><texture type="volume" name="reflectance">
  <volume name="volume" type="gridvolume"><string name="filename" value="grid.vol"/>
  <transform name="to_world"><translate z="3"/><translate x="$x"/></transform></volume></texture></bsdf></shape>
<shape type="shapegroup" id="g"><shape type="cylinder"/><shape type="cube"/></shape>
<shape type="instance"><ref id="g"/><transform name="to_world"><scale value="0.5"/><translate x="$x"/></transform></shape>)";

std::string tetrahedron(double x) {
  std::string text;
  for (const Vec3& p : {Vec3{0, 0, 0}, Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}}) {
    std::array<char, 100> line{};
    std::snprintf(line.data(), line.size(), "v %.17g %g %g\n", x + p[0] / 3, p[1], p[2]);
    text += line.data();
  }
  return text + "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
}

// A .vol file (scenes/README.md) of two voxels along x.
std::string two_voxels() {
  const std::array<std::int32_t, 5> sizes{1, 2, 1, 1, 1};
  const std::array<float, 8> numbers{0, 0, 0, 1, 1, 1, 0.2F, 0.8F};  // the box, and the values
  std::string bytes = "VOL\3";
  bytes.append(reinterpret_cast<const char*>(sizes.data()), sizeof sizes);
  bytes.append(reinterpret_cast<const char*>(numbers.data()), sizeof numbers);
  return bytes;
}

const Volume& texture_volume(const Scene& scene) {
  for (const Bsdf& bsdf : scene.bsdfs)
    for (const Texture& value : bsdf.values)
      if (value.volume) return *value.volume;
  throw std::logic_error("no texture has a volume");
}

Scene at(SceneFolder& folder, double x) {
  folder.write("a.obj", tetrahedron(x));
  folder.write("grid.vol", two_voxels());
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.17g", x);
  return folder.load(everything, {{"x", text.data()}});
}

Vec3 place_of(const Transform& t) { return transform_point(t, {0, 0, 0}); }

void check_same(const Vec3& a, const Vec3& b, const Vec3& shift, double tolerance) {
  for (std::size_t k = 0; k < 3; ++k) CHECK(a[k] == Approx(b[k] + shift[k]).margin(tolerance));
}

}  // namespace

TEST_CASE("a scene far away is the scene about the origin, with everything in it") {
  SceneFolder folder;
  const Scene here = at(folder, 0);
  const std::size_t meter_at = 0, camera_at = 1, distant_at = 2;  // those of shapes come first
  CHECK(here.sensors[camera_at].to_world.m[11] == -5);
  for (const double x : {1e3, 1e6, 1e9, -3.7e9}) {
    const Scene there = at(folder, x);
    INFO("at " << x);
    CHECK(there.warnings == here.warnings);
    const double tolerance = 1e-6 + 4e-16 * std::abs(x);
    const Vec3 shift = place_of(there.sensors[camera_at].to_world) - place_of(here.sensors[camera_at].to_world);
    CHECK(length(shift) < 5);  // about the middle, wherever that is
    check_same(*there.sensors[distant_at].target, *here.sensors[distant_at].target, shift, tolerance);
    REQUIRE(there.shapes.size() == here.shapes.size());
    for (std::size_t i = 0; i < here.shapes.size(); ++i) {
      const Shape &far = there.shapes[i], &near = here.shapes[i];
      INFO("shape " << i);
      if (!far.mesh) {
        check_same(far.center, near.center, shift, tolerance);
        continue;
      }
      REQUIRE(far.mesh->position.size() == near.mesh->position.size());
      for (std::size_t v = 0; v < near.mesh->position.size(); ++v) {
        const auto &p = far.mesh->position[v], &q = near.mesh->position[v];
        check_same({p[0], p[1], p[2]}, {q[0], q[1], q[2]}, shift, tolerance);
      }
    }
    for (std::size_t i = 0; i < here.lights.size(); ++i) {
      const char* name = here.lights[i].type() == "directionalarea" ? "center" : "position";
      check_same(there.lights[i].value(name).value, here.lights[i].value(name).value, shift, tolerance);
    }
    check_same(place_of(there.media[0].value("sigma_t").volume->to_world),
               place_of(here.media[0].value("sigma_t").volume->to_world), shift, tolerance);
    check_same(place_of(texture_volume(there).to_world), place_of(texture_volume(here).to_world), shift, tolerance);
    REQUIRE(there.sensors[meter_at].zone);
    check_same(there.sensors[meter_at].zone->center, here.sensors[meter_at].zone->center, shift, tolerance);
  }
}

TEST_CASE("scenes that are no farther away than some of their sizes stay where they are") {
  SceneFolder folder;
  const Scene scene = at(folder, 20);
  CHECK(place_of(scene.sensors[1].to_world) == Vec3{20, 0, -5});
  CHECK(scene.shapes[2].center == Vec3{20, 0, 3});
}

TEST_CASE("a mesh far from its own origin is as exact as its file") {
  SceneFolder folder;
  const std::string body =
      "<shape type=\"ply\"><string name=\"filename\" value=\"a.ply\"/><transform name=\"to_world\">"
      "<translate x=\"-1e7\"/></transform></shape>";
  const auto binary = [&](const std::string& type, double x) {
    std::string text = "ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty " + type + " x\nproperty " +
                       type + " y\nproperty " + type +
                       " z\nelement face 1\nproperty list uchar int vertex_indices\n"
                       "end_header\n";
    for (const Vec3& p : {Vec3{0, 0, 0}, Vec3{1.25, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}})
      for (std::size_t k = 0; k < 3; ++k) {
        const double value = p[k] + (k == 0 ? x : 0);
        const auto single = static_cast<float>(value);
        text += type == "double" ? std::string(reinterpret_cast<const char*>(&value), 8)
                                 : std::string(reinterpret_cast<const char*>(&single), 4);
      }
    const std::int32_t corners[3] = {0, 1, 2};
    text += '\3';
    return text + std::string(reinterpret_cast<const char*>(corners), 12);
  };
  folder.write("a.ply", binary("double", 1e7));
  const Scene exact = folder.load(body);
  CHECK(exact.warnings.empty());
  CHECK(box_of(exact.shapes[0]).high[0] == 1.25F);
  // One part in 2^24 of 1e7 is more than a third of the mesh.
  folder.write("a.ply", binary("float", 1e7));
  folder.check_error(body, 2, {"a.ply", "single precision", "60 %", "double"});
  folder.write("a.ply", binary("float", 1e5));
  const Scene rounded = folder.load(body);
  REQUIRE(!rounded.warnings.empty());
  CHECK_THAT(rounded.warnings[0], Catch::Contains("scene.xml:2") && Catch::Contains("0.48 %"));
}

TEST_CASE("what single precision does not tell is said, and refused where it tells nothing") {
  SceneFolder folder;
  const auto pair = [](const std::string& distance) {
    return "<shape type=\"sphere\" id=\"one\"/>\n<shape type=\"sphere\" id=\"other\"><point name=\"center\" x=\"" +
           distance + "\" y=\"0\" z=\"0\"/></shape>";
  };
  CHECK(folder.load(pair("1000")).warnings.empty());
  const Scene far = folder.load(pair("1e5"));
  REQUIRE(far.warnings.size() == 1);
  CHECK_THAT(far.warnings[0], Catch::Contains("size of 2") && Catch::Contains("5e+04") && Catch::Contains("1.2 %"));
  folder.check_error(pair("1e8"), 2, {"one", "single precision", "of its size", "render them apart"});
}

TEST_CASE("a huge surface beside a small one is said to blur it") {
  SceneFolder folder;
  const auto floor = [](const std::string& size) {
    return "<shape type=\"rectangle\" id=\"floor\"><transform name=\"to_world\"><scale value=\"" + size +
           "\"/></transform></shape>\n<shape type=\"sphere\" id=\"ball\"/>";
  };
  CHECK(folder.load(floor("1000")).warnings.empty());
  const Scene scene = folder.load(floor("1e6"));
  REQUIRE(scene.warnings.size() == 1);
  CHECK_THAT(scene.warnings[0], Catch::Contains("floor") && Catch::Contains("ball") && Catch::Contains("24 %"));
}

TEST_CASE("of more than a few equal surfaces the rest are left out, and said; lamps and unequal ones stay") {
  SceneFolder folder;
  const auto many = [](const std::string& content) {
    std::string text;
    for (int i = 0; i < 100; ++i) text += "<shape type=\"sphere\">" + content + "</shape>";
    return text;
  };
  const Scene scene = folder.load(many(""));
  CHECK(scene.shapes.size() == 16);
  REQUIRE(scene.warnings.size() == 1);
  CHECK_THAT(scene.warnings[0], Catch::Contains("83 others"));
  // Light would be refracted by each: a white furnace with two was .83.
  CHECK(folder.load(many("<bsdf type=\"dielectric\"/>")).shapes.size() == 1);
  CHECK(folder.load(many("<emitter type=\"area\"/>")).shapes.size() == 100);
  std::string unequal;
  for (int i = 0; i < 100; ++i)
    unequal += "<shape type=\"sphere\"><float name=\"radius\" value=\"" + std::to_string(1 + 1e-6 * i) + "\"/></shape>";
  CHECK(folder.load(unequal).shapes.size() == 100);
}
