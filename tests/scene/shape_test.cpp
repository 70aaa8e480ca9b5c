// Shapes in world space, and the checks of what bounds a medium.
#include <cmath>

#include "itn/parameters.h"
#include "runtime/scene/mesh/mesh_topology.h"
#include "runtime/scene/transform.h"
#include "tests/scene/scene_folder.h"

using namespace itn;

namespace {

const std::string medium = "<medium type=\"homogeneous\" name=\"interior\"/><bsdf type=\"null\"/>";

std::string mesh(const std::string& type, const std::string& file, const std::string& content = "") {
  return "<shape type=\"" + type + "\">\n<string name=\"filename\" value=\"" + file + "\"/>" + content + "</shape>";
}
std::string to_world(const std::string& steps) { return "<transform name=\"to_world\">" + steps + "</transform>"; }
Shape load(const std::string& element) { return SceneFolder().load(element).shapes.at(0); }

// Does every normal of the triangles, by winding, point away from the centre?
bool winds_outward(const Mesh& m, const Vec3& centre) {
  const auto corner = [&](std::uint32_t i) { return Vec3{m.position[i][0], m.position[i][1], m.position[i][2]}; };
  for (const auto& t : m.triangle)
    if (dot(cross(corner(t[1]) - corner(t[0]), corner(t[2]) - corner(t[0])), corner(t[0]) - centre) <= 0) return false;
  return true;
}

}  // namespace

TEST_CASE("a sphere has radius 1 about the origin unless it says otherwise") {
  const Shape s = load("<shape type=\"sphere\"/>");
  CHECK(s.kind == Shape::Kind::sphere);
  CHECK(s.center == Vec3{0, 0, 0});
  CHECK(s.radius == 1);
  CHECK(!s.flip_normals);
  CHECK(s.id == "sphere0");
}

TEST_CASE("a sphere's centre and radius go through to_world") {
  // Scale 3, then translate by 10: centre 3 (1, 2, 3) + (10, 0, 0), radius 3 * 2.
  const Shape s = load(
      "<shape type=\"sphere\"><point name=\"center\" x=\"1\" y=\"2\" z=\"3\"/><float name=\"radius\" value=\"2\"/>" +
      to_world("<scale value=\"3\"/><translate x=\"10\"/>") + "</shape>");
  CHECK(s.center == Vec3{13, 6, 9});
  CHECK(s.radius == Approx(6));
}

TEST_CASE("a reflected or flipped sphere has its normals inside, one that is both outside") {
  const std::string flip = "<boolean name=\"flip_normals\" value=\"true\"/>";
  CHECK(load("<shape type=\"sphere\">" + flip + "</shape>").flip_normals);
  CHECK(load("<shape type=\"sphere\">" + to_world("<scale x=\"-1\"/>") + "</shape>").flip_normals);
  CHECK(!load("<shape type=\"sphere\">" + flip + to_world("<scale x=\"-1\"/>") + "</shape>").flip_normals);
}

TEST_CASE("a disk's normal, edge_u x edge_v with flip_normals, is the transformed +z") {
  // As in Mitsuba: reflecting x leaves the normal, reflecting z turns it.
  const auto normal_z = [](const std::string& content) {
    const Shape s = load("<shape type=\"disk\">" + content + "</shape>");
    return (s.flip_normals ? -1 : 1) * cross(s.edge_u, s.edge_v)[2];
  };
  CHECK(normal_z("") == 1);
  CHECK(normal_z(to_world("<scale x=\"-1\"/>")) == 1);
  CHECK(normal_z(to_world("<scale z=\"-1\"/>")) == -1);
  CHECK(normal_z("<boolean name=\"flip_normals\" value=\"true\"/>") == -1);
  const Shape s = load("<shape type=\"disk\">" + to_world("<scale x=\"2\" y=\"3\"/><translate z=\"4\"/>") + "</shape>");
  CHECK(s.center == Vec3{0, 0, 4});
  CHECK(s.edge_u == Vec3{2, 0, 0});
  CHECK(s.edge_v == Vec3{0, 3, 0});
}

TEST_CASE("a cylinder stands on its points, and goes through to_world with its radius") {
  const Shape plain = load("<shape type=\"cylinder\"/>");
  CHECK(plain.kind == Shape::Kind::cylinder);
  CHECK(plain.center == Vec3{0, 0, 0});
  CHECK(plain.axis == Vec3{0, 0, 1});
  CHECK(plain.radius == 1);
  CHECK(!plain.flip_normals);
  const std::string points =
      "<point name=\"p0\" x=\"1\" y=\"2\" z=\"3\"/><point name=\"p1\" x=\"1\" y=\"4\" z=\"3\"/>"
      "<float name=\"radius\" value=\"0.5\"/>";
  // Twice as wide across, three times as long.
  const Shape s = load("<shape type=\"cylinder\">" + points +
                       to_world("<scale x=\"2\" y=\"3\" z=\"2\"/><translate z=\"1\"/>") + "</shape>");
  CHECK(s.center == Vec3{2, 6, 7});
  CHECK(s.axis == Vec3{0, 6, 0});
  CHECK(s.radius == Approx(1));
  CHECK(length(s.edge_u) == Approx(1));
  CHECK(dot(s.edge_u, s.edge_v) == Approx(0).margin(1e-12));
  CHECK(dot(s.edge_u, s.axis) == Approx(0).margin(1e-12));
  CHECK(length(s.edge_v) == Approx(1));
  // Mitsuba 3.9.1: a reflection leaves the normals outside.
  CHECK(!load("<shape type=\"cylinder\">" + to_world("<scale x=\"-1\"/>") + "</shape>").flip_normals);
  CHECK(load("<shape type=\"cylinder\"><boolean name=\"flip_normals\" value=\"true\"/></shape>").flip_normals);
}

TEST_CASE("a sphere's axes, which its texture follows, turn with to_world") {
  const Shape s = load("<shape type=\"sphere\">" + to_world("<rotate x=\"1\" angle=\"90\"/>") + "</shape>");
  CHECK(s.edge_v[2] == Approx(1));
  CHECK(s.axis[1] == Approx(-1));
}

TEST_CASE("a rectangle is [-1, 1]^2 with normal +z and texture coordinates in [0, 1]") {
  const Shape s = load("<shape type=\"rectangle\"/>");
  REQUIRE(s.mesh);
  CHECK(s.mesh->triangle.size() == 2);
  CHECK(winds_outward(*s.mesh, {0, 0, -1}));
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t c = 0; c < 2; ++c) CHECK(s.mesh->texcoord[i][c] == (s.mesh->position[i][c] + 1) / 2);
}

TEST_CASE("a cube is [-1, 1]^3, closed, winds outward and stays so under reflections") {
  for (const std::string steps : {"", "<scale x=\"-1\"/>", "<scale value=\"-2\"/>", "<rotate x=\"1\" angle=\"33\"/>"}) {
    const Shape s = load("<shape type=\"cube\">" + to_world(steps) + "</shape>");
    const Topology t = topology(*s.mesh);
    CHECK(t.closed());
    CHECK(winds_outward(*s.mesh, {0, 0, 0}));
    CHECK(t.volume == Approx(steps.find("-2") == std::string::npos ? 8 : 64));
  }
  CHECK(!winds_outward(*load("<shape type=\"cube\"><boolean name=\"flip_normals\" value=\"true\"/></shape>").mesh,
                       {0, 0, 0}));
}

TEST_CASE("a mesh without normals gets smooth ones weighted by angle, face_normals takes them away") {
  SceneFolder folder;
  folder.write_tetrahedron("t.ply");
  const auto smooth = folder.load(mesh("ply", "t.ply")).shapes[0].mesh;
  REQUIRE(smooth->normal.size() == 4);
  // At the origin three right angles meet, with normals -x, -y, -z.
  for (std::size_t c = 0; c < 3; ++c) CHECK(smooth->normal[0][c] == Approx(-1 / std::sqrt(3.0)));
  // At (1, 0, 0): angles 45, 45 (normals -z, -y) and 60 degrees (normal (1, 1, 1) / sqrt 3).
  const double a = M_PI / 4, b = M_PI / 3 / std::sqrt(3.0);
  const Vec3 expected = normalize(Vec3{b, b - a, b - a});
  for (std::size_t c = 0; c < 3; ++c) CHECK(smooth->normal[1][c] == Approx(expected[c]).margin(1e-6));
  CHECK(folder.load(mesh("ply", "t.ply", "<boolean name=\"face_normals\" value=\"true\"/>"))
            .shapes[0]
            .mesh->normal.empty());
}

TEST_CASE("normals of a file are turned as normals are") {
  SceneFolder folder;
  folder.write("n.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 1 1 0\nf 1//1 2//1 3//1\n");
  const auto m = folder.load(mesh("obj", "n.obj", to_world("<scale x=\"2\"/>"))).shapes[0].mesh;
  // The inverse transpose of scale (2, 1, 1) takes (1, 1, 0) to (0.5, 1, 0).
  CHECK(m->normal[0][0] == Approx(0.5 / std::sqrt(1.25)));
  CHECK(m->normal[0][1] == Approx(1 / std::sqrt(1.25)));
}

TEST_CASE("normals of length 0 in a file are computed, with a warning") {
  SceneFolder folder;
  folder.write("n.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 0\nvn 0 1 1\nf 1//1 2//2 3//2\n");
  const Scene scene = folder.load(mesh("obj", "n.obj"));
  CHECK(scene.shapes[0].mesh->normal[0] == std::array<float, 3>{0, 0, 1});
  CHECK(scene.shapes[0].mesh->normal[1][1] == Approx(std::sqrt(0.5)));
  REQUIRE(scene.warnings.size() == 1);
  CHECK_THAT(scene.warnings[0], Catch::Contains("1 of 3 vertex normals"));
}

TEST_CASE("flip_normals turns triangles and normals around") {
  SceneFolder folder;
  folder.write_tetrahedron("t.ply");
  const auto plain = folder.load(mesh("ply", "t.ply")).shapes[0].mesh;
  const auto flipped =
      folder.load(mesh("ply", "t.ply", "<boolean name=\"flip_normals\" value=\"true\"/>")).shapes[0].mesh;
  CHECK(topology(*plain).volume == Approx(1.0 / 6));
  CHECK(topology(*flipped).volume == Approx(-1.0 / 6));
  CHECK(flipped->normal[0][0] == -plain->normal[0][0]);
}

TEST_CASE("OBJ texture coordinates are flipped unless the scene says otherwise, PLY's are not") {
  SceneFolder folder;
  folder.write("t.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.25 0.125\nf 1/1 2/1 3/1\n");
  CHECK(folder.load(mesh("obj", "t.obj")).shapes[0].mesh->texcoord[0] == std::array<float, 2>{0.25f, 0.875f});
  CHECK(folder.load(mesh("obj", "t.obj", "<boolean name=\"flip_tex_coords\" value=\"false\"/>"))
            .shapes[0]
            .mesh->texcoord[0] == std::array<float, 2>{0.25f, 0.125f});
  CHECK(folder.load(mesh("mesh", "t.obj")).shapes[0].mesh->texcoord[0] == std::array<float, 2>{0.25f, 0.125f});
}

TEST_CASE("a shape without a bsdf is diffuse, reflectance one half") {
  const Scene scene = SceneFolder().load("<shape type=\"sphere\"/>");
  const Bsdf& b = scene.bsdfs.at(static_cast<std::size_t>(scene.shapes[0].bsdf));
  CHECK(b.type() == "diffuse");
  CHECK(b.value("reflectance").value == Rgb{0.5, 0.5, 0.5});
}

TEST_CASE("media inside and outside arrive") {
  const Scene scene = SceneFolder().load(
      "<shape type=\"sphere\"><medium type=\"homogeneous\" name=\"interior\"/>"
      "<medium type=\"homogeneous\" name=\"exterior\"/></shape>");
  CHECK(scene.media.at(static_cast<std::size_t>(scene.shapes[0].interior)).id == "homogeneous0");
  CHECK(scene.media.at(static_cast<std::size_t>(scene.shapes[0].exterior)).id == "homogeneous1");
}

TEST_CASE("a shape that shines is black where it has no BSDF of its own, and names its light") {
  const Scene scene = SceneFolder().load(
      "<shape type=\"sphere\"/><shape type=\"sphere\"><emitter type=\"area\" id=\"bulb\"><rgb name=\"radiance\" "
      "value=\"1 2 3\"/></emitter></shape><emitter type=\"point\"><point name=\"position\" value=\"4 0 "
      "0\"/></emitter>");
  REQUIRE(scene.lights.size() == 2);
  CHECK(scene.shapes[0].light == -1);
  const Shape& bulb = scene.shapes[1];
  REQUIRE(bulb.light >= 0);
  const Light& light = scene.lights[static_cast<std::size_t>(bulb.light)];
  CHECK(light.id == "bulb");
  CHECK(light.value("radiance").value == Rgb{1, 2, 3});
  CHECK(scene.lights[static_cast<std::size_t>(1 - bulb.light)].value("position").value == Rgb{4, 0, 0});
  CHECK(scene.bsdfs[static_cast<std::size_t>(bulb.bsdf)].number("reflectance") == 0);
  CHECK(scene.bsdfs[static_cast<std::size_t>(scene.shapes[0].bsdf)].number("reflectance") == 0.5);
}

TEST_CASE("a shape shines as a texture shows, which has a factor") {
  const auto shining = [](const std::string& shape) {
    return shape +
           "<emitter type=\"area\" id=\"screen\">\n<texture type=\"checkerboard\" name=\"radiance\"><rgb "
           "name=\"color0\" "
           "value=\"0, 0.5, 1\"/></texture></emitter></shape>";
  };
  const Scene scene = SceneFolder().load(shining("<shape type=\"rectangle\">"));
  REQUIRE(scene.lights.size() == 1);
  const Light& light = scene.lights[0];
  CHECK(light.type() == "area");
  CHECK(light.value("radiance").model != nullptr);
  for (std::size_t c = 0; c < 3; ++c)  // the mean of both colours
    CHECK(light.value("radiance").value[c] == Approx((0.2 + 0.5 * static_cast<double>(c)) / 2));
  const Parameter scale = find_parameter(list_parameters(scene), "screen.scale");
  CHECK(scale.value == 1);
  CHECK(scale.not_differentiable.empty());
  SceneFolder folder;
  folder.write_tetrahedron("t.ply");
  const std::string ply = "<shape type=\"ply\"><string name=\"filename\" value=\"t.ply\"/>";
  folder.check_error(shining(ply), 2, {"texture coordinates"});
  folder.check_error(ply +
                         "<emitter type=\"area\">\n<texture type=\"mesh_attribute\" name=\"radiance\"><string "
                         "name=\"name\" value=\"vertex_a\"/></texture></emitter></shape>",
                     3, {"attribute of a mesh"});
}

TEST_CASE("a beam takes the place of its rectangle or disk, which does not shine itself") {
  SceneFolder folder;
  const std::string beam =
      "<emitter type=\"directionalarea\" id=\"laser\">\n<rgb name=\"radiance\" value=\"1, 2, 3\"/></emitter>";
  const std::string place =
      "<transform name=\"to_world\"><scale x=\"2\"/><rotate x=\"1\" angle=\"180\"/><translate x=\"5\" "
      "z=\"4\"/></transform>";
  for (const std::string type : {"rectangle", "disk"}) {
    const Scene scene = folder.load("<shape type=\"" + type + "\">" + place + beam + "</shape>");
    REQUIRE(scene.lights.size() == 1);
    const Light& light = scene.lights[0];
    const auto near = [&](const char* name, const Vec3& expected) {
      for (std::size_t a = 0; a < 3; ++a) CHECK(light.value(name).value[a] == Approx(expected[a]).margin(1e-6));
    };
    near("center", {5, 0, 4});
    near("normal", {0, 0, -1});
    near("to_u", {0.5, 0, 0});
    CHECK(std::abs(light.value("to_v").value[1]) == Approx(1));
    CHECK(light.number("round") == (type == "disk" ? 1 : 0));
    CHECK(scene.shapes.at(0).light == -1);
    CHECK(scene.bsdfs[static_cast<std::size_t>(scene.shapes[0].bsdf)].number("reflectance") == 0);
    CHECK(find_parameter(list_parameters(scene), "laser.radiance.R").not_differentiable.empty());
  }
  // One that two shapes refer to is a light for each, and one parameter.
  const std::string ref = "<ref id=\"laser\"/>";
  Scene two = folder.load(beam + "<shape type=\"rectangle\">" + ref + "</shape><shape type=\"disk\">" + place + ref +
                          "</shape>");
  REQUIRE(two.lights.size() == 2);
  CHECK(two.lights[0].value("center").value == Vec3{0, 0, 0});
  CHECK(two.lights[1].value("center").value[2] == Approx(4));
  set_parameter(two, find_parameter(list_parameters(two), "laser.radiance.G"), 7);
  CHECK((two.lights[0].value("radiance").value[1] == 7 && two.lights[1].value("radiance").value[1] == 7));
  folder.check_error("<shape type=\"sphere\">" + beam + "</shape>", 2, {"directionalarea", "rectangle or a disk"});
  folder.check_error(beam, 2, {"directionalarea", "belongs into a <shape>"});
}

TEST_CASE("faulty shapes are refused") {
  SceneFolder folder;
  folder.check_error("<shape type=\"sphere\">\n<float name=\"radius\" value=\"0\"/></shape>", 3, {"radius = 0"});
  folder.check_error("<shape type=\"sphere\">\n<medium type=\"homogeneous\"/></shape>", 3, {"name=\"interior\""});
  folder.check_error("<shape type=\"sphere\">\n<bsdf type=\"null\"/><bsdf type=\"null\"/></shape>", 3,
                     {"more than one <bsdf>"});
  folder.check_error("<shape type=\"sphere\">\n<emitter type=\"point\"/></shape>", 3, {"\"point\"", "\"area\""});
  folder.check_error("<emitter type=\"area\"/>", 2, {"\"area\"", "belongs into a <shape>"});
  folder.check_error(
      "<shape type=\"cube\">\n" + to_world("<scale value=\"1e30\"/><scale value=\"1e30\"/>") + "</shape>", 3,
      {"single precision"});
  for (const std::string type : {"sphere", "disk"})
    folder.check_error(
        "<shape type=\"" + type + "\">\n" + to_world("<scale value=\"1e30\"/><scale value=\"1e30\"/>") + "</shape>", 3,
        {"single precision"});
  folder.check_error("<shape type=\"cylinder\">\n<float name=\"radius\" value=\"-1\"/></shape>", 3, {"radius = -1"});
  folder.check_error("<shape type=\"cylinder\">\n<point name=\"p1\" value=\"0 0 0\"/></shape>", 3, {"same point"});
  folder.check_error("<shape type=\"ply\"/>", 2, {"no \"filename\""});
  folder.check_error(mesh("ply", "gone.ply"), 3, {"no such file", "gone.ply", "looked in"});
}

TEST_CASE("a mesh with holes cannot bound a medium: how many open edges, and where one is") {
  SceneFolder folder;
  folder.write_ply("open.ply", {"0 0 0", "1 0 0", "0 1 0", "0 0 1"}, {"3 0 2 1", "3 0 1 3", "3 0 3 2"});
  folder.check_error(mesh("ply", "open.ply", medium), 2, {"bounds a medium", "3 open edges", "0.5", "closed mesh"});
  CHECK(folder.load(mesh("ply", "open.ply")).warnings.empty());
  const Scene glass = folder.load(mesh("ply", "open.ply", "<bsdf type=\"dielectric\"/>"));
  REQUIRE(glass.warnings.size() == 1);
  CHECK_THAT(glass.warnings[0], Catch::Contains("dielectric") && Catch::Contains("3 open edges"));
  folder.check_error("<shape type=\"rectangle\">" + medium + "</shape>", 2, {"4 open edges"});
  folder.check_error("<shape type=\"cylinder\">" + medium + "</shape>", 2, {"not closed", "(open)"});
  folder.check_error("<shape type=\"disk\">" + medium + "</shape>", 2, {"not closed"});
}

TEST_CASE("vertices at the same position are one when holes are looked for") {
  SceneFolder folder;
  folder.write_ply("split.ply", {"0 0 0", "1 0 0", "0 1 0", "0 0 1", "0 0 0", "1 0 0", "0 0 1"},
                   {"3 0 2 1", "3 4 5 6", "3 1 2 3", "3 0 3 2"});
  CHECK(folder.load(mesh("ply", "split.ply", medium)).warnings.empty());
}

TEST_CASE("a shape turned inside out around a medium is turned, and told; one turned in part is refused") {
  SceneFolder folder;
  const auto turned = [&](const std::string& text) {
    const Scene scene = folder.load(text);
    INFO(text);
    CHECK(scene.warnings.size() == 1);
    if (!scene.warnings.empty()) CHECK_THAT(scene.warnings[0], Catch::Contains("turned to point out"));
    return scene.shapes[0];
  };
  const std::string flipped = "<boolean name=\"flip_normals\" value=\"true\"/>";
  folder.write_ply("out.ply", {"0 0 0", "1 0 0", "0 1 0", "0 0 1"}, {"3 0 1 2", "3 0 3 1", "3 1 3 2", "3 0 2 3"});
  const Mesh outward = *turned(mesh("ply", "out.ply", medium)).mesh;
  CHECK(topology(outward).volume == Approx(1.0 / 6));
  CHECK(dot(area_normal(outward, outward.triangle[0]),
            Vec3{outward.normal[outward.triangle[0][0]][0], outward.normal[outward.triangle[0][0]][1],
                 outward.normal[outward.triangle[0][0]][2]}) > 0);
  CHECK(folder.load(mesh("ply", "out.ply", medium + flipped)).warnings.empty());
  folder.write_ply("part.ply", {"0 0 0", "1 0 0", "0 1 0", "0 0 1"}, {"3 0 2 1", "3 0 1 3", "3 1 3 2", "3 0 3 2"});
  folder.check_error(mesh("ply", "part.ply", medium), 2, {"wind against each other", "3 edges"});
  CHECK(!turned("<shape type=\"sphere\">" + medium + flipped + "</shape>").flip_normals);
  folder.write_tetrahedron("t.ply");
  turned(mesh("ply", "t.ply", medium + to_world("<scale x=\"-1\"/>")));
  // Normals of the file that point out already stay as they are.
  folder.write("n.obj",
               "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 -1\nvn 0 -1 0\nvn 1 1 1\nvn -1 0 0\n"
               "f 1//1 2//1 3//1\nf 1//2 4//2 2//2\nf 2//3 4//3 3//3\nf 1//4 3//4 4//4\n");
  const Mesh kept = *turned(mesh("obj", "n.obj", medium)).mesh;
  CHECK(topology(kept).volume == Approx(1.0 / 6));
  CHECK(kept.normal[0][2] == -1);
}

TEST_CASE("what is opaque may name the medium around it, closed or not") {
  SceneFolder folder;
  const std::string fog = "<medium type=\"homogeneous\" id=\"fog\"/>",
                    around = "<ref id=\"fog\" name=\"exterior\"/></shape>";
  const std::string opaque[] = {"", "<bsdf type=\"twosided\"><bsdf type=\"diffuse\"/></bsdf>",
                                "<emitter type=\"area\"/>"};
  folder.write_ply("open.ply", {"0 0 0", "1 0 0", "0 1 0", "0 0 1"}, {"3 0 2 1", "3 0 1 3", "3 0 3 2"});
  for (const std::string& surface : opaque)
    for (const std::string shape :
         {"rectangle\">", "disk\">", "cylinder\">", "ply\"><string name=\"filename\" value=\"open.ply\"/>",
          "sphere\"><boolean name=\"flip_normals\" value=\"true\"/>"}) {
      INFO(shape << surface);
      const Scene scene =
          folder.load(fog + "<shape type=\"" + shape + surface + around + "<emitter type=\"constant\"/>");
      CHECK(scene.warnings.empty());
      CHECK((scene.shapes[0].exterior == 0 && scene.shapes[0].interior == -1));
    }
  // Light that passes a surface must know what is behind it.
  folder.check_error(fog + "<shape type=\"rectangle\"><bsdf type=\"null\"/>" + around, 2, {"4 open edges"});
}

TEST_CASE("to_world makes no ellipsoid of a sphere, as in Mitsuba, and a mesh of a cylinder that it bends") {
  SceneFolder folder;
  const Scene ball = folder.load("<shape type=\"sphere\"><float name=\"radius\" value=\"2\"/>" +
                                 to_world("<scale x=\"1.5\" z=\"4\"/>") + "</shape>");
  CHECK(ball.shapes[0].radius == Approx(3));  // Mitsuba 3.9.1: along x
  REQUIRE(ball.warnings.size() == 1);
  CHECK_THAT(ball.warnings[0], Catch::Contains("stays a sphere"));
  const Scene bent =
      folder.load("<shape type=\"cylinder\">" + to_world("<scale x=\"3\" y=\"0.5\" z=\"2\"/>") + "</shape>");
  REQUIRE(bent.shapes[0].kind == Shape::Kind::mesh);
  REQUIRE(bent.warnings.size() == 1);
  for (const auto& p : bent.shapes[0].mesh->position) {
    CHECK(std::hypot(p[0] / 3, p[1] / 0.5) == Approx(1).epsilon(2e-4));
    CHECK((p[2] == 0 || p[2] == 2));
  }
}

TEST_CASE("a mesh with normals of its own keeps its outside under a reflection") {
  SceneFolder folder;
  folder.write("t.obj",
               "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 -1\nvn 0 -1 0\nvn 1 1 1\nvn -1 0 0\n"
               "f 1//1 3//1 2//1\nf 1//2 2//2 4//2\nf 2//3 3//3 4//3\nf 1//4 4//4 3//4\n");
  const Scene scene = folder.load(mesh("obj", "t.obj", medium + to_world("<scale x=\"-1\"/>")));
  const Mesh& m = *scene.shapes[0].mesh;
  CHECK(topology(m).volume == Approx(1.0 / 6));
  CHECK(m.normal[6][0] == Approx(-1 / std::sqrt(3.0)));
}

TEST_CASE("a mesh with an edge of three triangles cannot bound a medium") {
  SceneFolder folder;
  folder.write_ply("fin.ply", {"0 0 0", "1 0 0", "0 1 0", "0 0 1", "-1 -1 -1"},
                   {"3 0 2 1", "3 0 1 3", "3 1 2 3", "3 0 3 2", "3 0 1 4"});
  folder.check_error(mesh("ply", "fin.ply", medium), 2, {"2 open edges", "(open)"});
  folder.write_ply("wall.ply", {"0 0 0", "1 0 0", "0 1 0", "0 0 1", "-1 -1 -1"},
                   {"3 0 2 1", "3 0 1 3", "3 1 2 3", "3 0 3 2", "3 0 1 4", "3 0 4 1"});
  const Scene scene = folder.load(mesh("ply", "wall.ply", medium));
  CHECK(scene.shapes[0].mesh->triangle.size() == 4);
  REQUIRE(scene.warnings.size() == 1);
  CHECK_THAT(scene.warnings[0], Catch::Contains("dropped 2 triangles that others cover or cancel"));
}

TEST_CASE("two separate closed parts are one closed mesh") {
  SceneFolder folder;
  folder.write_ply("two.ply", {"0 0 0", "1 0 0", "0 1 0", "0 0 1", "5 0 0", "6 0 0", "5 1 0", "5 0 1"},
                   {"3 0 2 1", "3 0 1 3", "3 1 2 3", "3 0 3 2", "3 4 6 5", "3 4 5 7", "3 5 6 7", "3 4 7 6"});
  CHECK(folder.load(mesh("ply", "two.ply", medium)).warnings.empty());
}

TEST_CASE("triangles without area are dropped with a warning, and open no holes") {
  SceneFolder folder;
  folder.write_ply("flat.ply", {"0 0 0", "1 0 0", "0 1 0", "0 0 1"},
                   {"3 0 2 1", "3 0 1 3", "3 1 2 3", "3 0 3 2", "3 0 0 1", "3 2 2 2"});
  const Scene scene = folder.load(mesh("ply", "flat.ply", medium));
  CHECK(scene.shapes[0].mesh->triangle.size() == 4);
  REQUIRE(scene.warnings.size() == 1);
  CHECK_THAT(scene.warnings[0], Catch::Contains("scene.xml:2:1") && Catch::Contains("2 of 6 triangles"));
  folder.write_ply("line.ply", {"0 0 0", "1 0 0", "2 0 0"}, {"3 0 1 2"});
  folder.check_error(mesh("ply", "line.ply"), 3, {"no triangle of the mesh has an area"});
}

TEST_CASE("a sliver whose corners lie on a line closes the surface though it has no area") {
  SceneFolder folder;
  // The edge from (0, 0, 0) to (1, 0, 0) is split at its middle on one side only; a sliver joins the sides.
  folder.write_ply("sliver.ply", {"0 0 0", "1 0 0", "0 1 0", "0 0 1", "0.5 0 0"},
                   {"3 0 2 4", "3 4 2 1", "3 0 1 3", "3 1 2 3", "3 0 3 2", "3 0 4 1"});
  const Scene scene = folder.load(mesh("ply", "sliver.ply", medium));
  CHECK(scene.shapes[0].mesh->triangle.size() == 5);
}

TEST_CASE("a texture shows an attribute of the mesh, which must be there and fit") {
  SceneFolder folder;
  folder.write("painted.ply",
               "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
               "property float r\nproperty float g\nproperty float b\nelement face 1\n"
               "property list uchar int vertex_indices\nproperty float weight_0\nend_header\n"
               "0 0 0 0 .5 1\n1 0 0 0 .5 1\n0 1 0 0 .5 2\n3 0 1 2 .25\n");
  const auto shape = [&](const std::string& type, const std::string& parameter, const std::string& attribute,
                         const std::string& more) {
    return mesh("ply", "painted.ply",
                "<bsdf type=\"" + type + "\"><texture type=\"mesh_attribute\" name=\"" + parameter +
                    "\"><string name=\"name\" value=\"" + attribute + "\"/>" + more + "</texture></bsdf>");
  };
  const Scene scene =
      folder.load(shape("diffuse", "reflectance", "vertex_color", "<float name=\"scale\" value=\"0.5\"/>"));
  const Texture& texture = scene.bsdfs[0].value("reflectance");
  CHECK(texture.attribute == "vertex_color");
  CHECK(texture.scale == 0.5);
  CHECK(folder.load(shape("principled", "metallic", "face_weight", "")).warnings.size() < 2);
  const Scene bright = folder.load(shape("diffuse", "reflectance", "vertex_color", ""));  // as in Mitsuba
  REQUIRE(bright.warnings.size() == 1);
  CHECK_THAT(bright.warnings[0],
             Catch::Contains("the value 2") && Catch::Contains("goes to 1") && Catch::Contains("scale"));
  folder.check_error(shape("diffuse", "reflectance", "vertex_heat", ""), 2,
                     {"no attribute \"vertex_heat\"", "\"vertex_color\", \"face_weight\""});
  folder.check_error(shape("diffuse", "reflectance", "heat", ""), 3, {"begins with vertex_ or face_"});
  folder.check_error(shape("roughconductor", "alpha", "vertex_color", "<float name=\"scale\" value=\"0.5\"/>"), 2,
                     {"3 channels", "one number"});
  folder.check_error(
      "<shape type=\"sphere\"><bsdf type=\"diffuse\"><texture type=\"mesh_attribute\" "
      "name=\"reflectance\"><string name=\"name\" value=\"vertex_color\"/></texture></bsdf></shape>",
      2, {"no attribute \"vertex_color\"", "PLY mesh"});
}
