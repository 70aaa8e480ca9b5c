// Scenes that others wrote: earlier versions, files in several folders, and everything that is wrong said at once.
#include <filesystem>

#include "itn/exr.h"
#include "tests/scene/scene_folder.h"

using namespace itn;

namespace {

Scene load_version(SceneFolder& folder, const std::string& version, const std::string& body) {
  folder.write("v.xml", "<scene version=\"" + version + "\">" + body + "<sensor type=\"perspective\"/></scene>");
  return load_scene(folder.path("v.xml"));
}

void make_folder(const SceneFolder& folder, const std::string& name) {
  std::filesystem::create_directories(folder.path(name));
}

const std::string grey_bsdf =
    "<bsdf version=\"3.0.0\" type=\"diffuse\"><float name=\"reflectance\" value=\"0.25\"/></bsdf>";
const std::string sphere_t = "<shape type=\"ply\"><string name=\"filename\" value=\"t.ply\"/></shape>";

}  // namespace

TEST_CASE("a scene of version 0.6 gets the names of version 3") {
  SceneFolder folder;
  const Scene scene =
      load_version(folder, "0.6.0",
                   "<integrator type=\"volpath\"><integer name=\"maxDepth\" value=\"7\"/></integrator>"
                   "<bsdf type=\"dielectric\" id=\"g\"><float name=\"intIOR\" value=\"1.25\"/></bsdf>"
                   "<bsdf type=\"diffuse\" id=\"d\"><rgb name=\"diffuseReflectance\" value=\"0.2\"/></bsdf>"
                   "<shape type=\"sphere\"><transform name=\"toWorld\">"
                   "<lookAt origin=\"0,0,1\" target=\"0,0,2\" up=\"0,1,0\"/></transform></shape>");
  CHECK(scene.integrator.max_depth == 7);
  CHECK(scene.bsdfs[0].number("int_ior") == 1.25);
  CHECK(scene.bsdfs[1].value("reflectance").value == Rgb{0.2, 0.2, 0.2});
  CHECK(scene.shapes[0].center[2] == 1);
}

TEST_CASE("uoffset, voffset, uscale and vscale of version 0.6 shift and then scale") {
  SceneFolder folder;
  write_exr(folder.path("t.exr"), {1, 1, {"Y"}, {0.5F}, {}});
  const Scene scene = load_version(
      folder, "0.5.0",
      "<bsdf type=\"diffuse\"><texture name=\"reflectance\" type=\"bitmap\"><string name=\"filename\" value=\"t.exr\"/>"
      "<float name=\"uscale\" value=\"4\"/><float name=\"uoffset\" value=\"0.5\"/>"
      "<float name=\"voffset\" value=\"0.25\"/></texture></bsdf>");
  // Mitsuba: scale(4, 1, 1) @ translate(0.5, 0.25, 0).
  CHECK(scene.bsdfs[0].value("reflectance").to_uv == std::array<double, 6>{4, 0, 2, 0, 1, 0.25});
}

TEST_CASE("a scene of version 2 means what it says") {
  SceneFolder folder;
  CHECK(load_version(folder, "2.1.0", "").sensors.size() == 1);
  CHECK_THROWS_WITH(
      load_version(folder, "2.0.0", "<integrator type=\"path\"><integer name=\"maxDepth\" value=\"7\"/></integrator>"),
      Catch::Contains("unknown parameter \"maxDepth\"") && Catch::Contains("did you mean \"max_depth\""));
}

TEST_CASE("a scene has a version; one later than 3 is read as 3, and told") {
  SceneFolder folder;
  CHECK(load_version(folder, "4.0.0", "").warnings.size() == load_version(folder, "3.0.0", "").warnings.size() + 1);
  for (const std::string version : {"three", "3.", "-1", "3.0.0.0"})
    CHECK_THROWS_WITH(load_version(folder, version, ""), Catch::Contains("v.xml:1:1: ") && Catch::Contains(version));
  folder.write("v.xml", "<scene/>");
  CHECK_THROWS_WITH(load_scene(folder.path("v.xml")), Catch::Contains("has no version"));
}

TEST_CASE("an included file may be an object, and has a version of its own") {
  SceneFolder folder;
  folder.write("grey.xml", grey_bsdf);
  const Scene scene = folder.load("<shape type=\"sphere\"><include filename=\"grey.xml\"/></shape>");
  CHECK(scene.bsdfs.at(0).value("reflectance").value == Rgb{0.25, 0.25, 0.25});
  folder.write("old.xml",
               "<integrator version=\"0.6.0\" type=\"path\"><integer name=\"maxDepth\" value=\"3\"/></integrator>");
  CHECK(folder.load("<include filename=\"old.xml\"/>").integrator.max_depth == 3);
  folder.write("none.xml", "<bsdf type=\"diffuse\"/>");
  CHECK_THAT(folder.error_of("<include filename=\"none.xml\"/>"),
             Catch::Contains("none.xml:1:1: <bsdf> has no version"));
}

TEST_CASE("files are looked for in the paths of the scene, the last first, then in its folder") {
  SceneFolder folder;
  make_folder(folder, "a");
  make_folder(folder, "b");
  folder.write_tetrahedron("t.ply");
  folder.write_ply("b/t.ply", {"0 0 0", "2 0 0", "0 2 0", "0 0 2"}, {"3 0 2 1", "3 0 1 3", "3 1 2 3", "3 0 3 2"});
  const auto size = [&](const std::string& paths) {
    return folder.load(paths + sphere_t).shapes.at(0).mesh->position.at(1)[0];
  };
  CHECK(size("") == 1);
  CHECK(size("<path value=\"a\"/>") == 1);
  CHECK(size("<path value=\"a\"/><path value=\"b\"/>") == 2);
}

TEST_CASE("an included file finds files beside itself, beside the scene, and in the folders of both") {
  SceneFolder folder;
  make_folder(folder, "parts/more");
  make_folder(folder, "common");
  folder.write("parts/more/deep.xml", grey_bsdf);
  folder.write(
      "parts/part.xml",
      "<scene version=\"3.0.0\"><path value=\"common\"/><include filename=\"more/deep.xml\"/>" + sphere_t + "</scene>");
  const std::string body = "<include filename=\"parts/part.xml\"/>";
  for (const std::string place : {"t.ply", "parts/t.ply", "common/t.ply"}) {
    folder.write_tetrahedron(place);
    CHECK(folder.load(body).shapes.size() == 1);
    std::filesystem::remove(folder.path(place));
  }
  CHECK_THAT(folder.error_of(body), Catch::Contains("no such file \"t.ply\"; looked in") && Catch::Contains("common"));
}

TEST_CASE("includes that multiply each other end in an error, soon") {
  SceneFolder folder;
  for (int i = 0; i < 14; ++i) {
    const std::string next = "<include filename=\"" + std::to_string(i + 1) + ".xml\"/>";
    folder.write(std::to_string(i) + ".xml", "<scene version=\"3.0.0\">" + next + next + next + "</scene>");
  }
  folder.write("14.xml", "<scene version=\"3.0.0\"/>");
  CHECK_THAT(folder.error_of("<include filename=\"0.xml\"/>"), Catch::Contains("more than 1000 files included"));
}

TEST_CASE("files that repeat each other's elements without end are given up soon") {
  SceneFolder folder;
  std::string many;
  for (int i = 0; i < 20000; ++i) many += "<alias/>";
  folder.write("many.xml", "<scene version=\"3.0.0\">" + many + "</scene>");
  std::string body;
  for (int i = 0; i < 900; ++i) body += "<include filename=\"many.xml\"/>";
  CHECK_THAT(folder.error_of(body), Catch::Contains("more than 1000000 elements"));
}

TEST_CASE("twenty thousand references to nothing are refused soon") {
  std::string body;
  for (int i = 0; i < 20000; ++i)
    body += "<bsdf type=\"null\" id=\"b" + std::to_string(i) + "\"/>\n<ref id=\"c" + std::to_string(i) + "\"/>\n";
  const std::string message = SceneFolder().error_of(body);
  CHECK_THAT(message, Catch::Contains("no element has the id \"c0\"") && Catch::Contains("others are there"));
  CHECK(message.size() < 100'000);
}

TEST_CASE("includes go at most 15 deep, as in Mitsuba") {
  SceneFolder folder;
  const auto write = [&](int deepest) {
    for (int i = 1; i < deepest; ++i)
      folder.write(std::to_string(i) + ".xml",
                   "<scene version=\"3.0.0\"><include filename=\"" + std::to_string(i + 1) + ".xml\"/></scene>");
    folder.write(std::to_string(deepest) + ".xml", "<scene version=\"3.0.0\"/>");
  };
  write(14);  // with the scene itself 15 files are open
  CHECK(folder.error_of("<include filename=\"1.xml\"/>").empty());
  write(15);
  CHECK_THAT(folder.error_of("<include filename=\"1.xml\"/>"), Catch::Contains("15 deep"));
}

TEST_CASE("$name takes the longest name that is defined, and \\$ is a dollar") {
  SceneFolder folder;
  const auto id = [&](const std::string& value) {
    return folder
        .load("<default name=\"a\" value=\"1\"/><default name=\"a-b\" value=\"2\"/><bsdf type=\"null\" id=\"" + value +
              "\"/>")
        .bsdfs.at(0)
        .id;
  };
  CHECK(id("$a$a-b") == "12");
  CHECK(id("$ab") == "1b");
  CHECK(id("\\$a") == "$a");
}

TEST_CASE("one run tells everything that is missing, in the order of the file") {
  SceneFolder folder;
  const std::string message = folder.error_of(
      "<bsdf type=\"velvet\" id=\"v\">\n<texture name=\"t\" type=\"marble\"/></bsdf>\n"
      "<shape type=\"torus\">\n<bsdf type=\"silk\"/></shape>\n"
      "<shape type=\"sphere\"><float name=\"radios\" value=\"1\"/>\n<float name=\"centre\" value=\"1\"/>\n"
      "<ref id=\"v\"/></shape>\n"
      "<sensor type=\"perspective\"><film type=\"paper\"/>\n<sampler type=\"dice\"/></sensor>");
  const std::vector<std::string> expected = {"2:1: unknown type \"velvet\"",
                                             "3:1: unknown type \"marble\"",
                                             "4:1: unknown type \"torus\"",
                                             "5:1: unknown type \"silk\"",
                                             "6:22: shape \"sphere\": unknown parameter \"radios\"",
                                             "7:1: shape \"sphere\": unknown parameter \"centre\"",
                                             "9:28: unknown type \"paper\"",
                                             "10:1: unknown type \"dice\""};
  std::istringstream lines(message);
  std::string line;
  for (const std::string& words : expected) {
    REQUIRE(std::getline(lines, line));
    CHECK_THAT(line, Catch::StartsWith(folder.path("scene.xml") + ":" + words));
  }
  CHECK(!std::getline(lines, line));
}

TEST_CASE("every fault of a file's structure is told at once") {
  const std::string message = SceneFolder().error_of("<shap/>\n<float name=\"$gone\" value=\"1\"/>\n<bsdf id=\"x\"/>");
  CHECK_THAT(message, Catch::Contains(":2:1: unknown element <shap>") &&
                          Catch::Contains(":3:1: $gone is not defined") && Catch::Contains(":4:1: <bsdf> has no type"));
}

TEST_CASE("objects and references that nest or go in circles are refused") {
  SceneFolder folder;
  folder.check_error(
      "<bsdf type=\"twosided\" id=\"a\"><ref id=\"b\"/></bsdf>\n<bsdf type=\"twosided\" id=\"b\">"
      "<ref id=\"a\"/></bsdf>",
      2, {"\"a\" contains a reference to itself"});
  std::string chain = "<bsdf type=\"diffuse\" id=\"b0\"/>";
  for (int i = 1; i < 200; ++i)
    chain +=
        "<bsdf type=\"twosided\" id=\"b" + std::to_string(i) + "\"><ref id=\"b" + std::to_string(i - 1) + "\"/></bsdf>";
  folder.check_error(chain, 2, {"more than 64 deep"});
}

TEST_CASE("integrators of radiance select this renderer, with Mitsuba's default of max_depth") {
  const auto depth = [](const std::string& type) {
    return SceneFolder().load("<integrator type=\"" + type + "\"/>").integrator.max_depth;
  };
  for (const std::string type : {"path", "volpath", "volpathmis", "ptracer"}) CHECK(depth(type) == -1);
  for (const std::string type : {"prb", "prb_basic", "prb_projective", "prbvolpath"}) CHECK(depth(type) == 6);
  for (const std::string type : {"direct", "direct_projective"}) CHECK(depth(type) == 2);
}

TEST_CASE("an integrator of something else renders its nested one, or radiance, with a warning") {
  for (const std::string type : {"aov", "moment", "stokes", "depth"}) {
    const std::string aovs = type == "aov" ? "<string name=\"aovs\" value=\"d:depth\"/>" : "";
    const Scene scene = SceneFolder().load("<integrator type=\"" + type + "\">" + aovs +
                                           "<integrator type=\"path\"><integer name=\"max_depth\" value=\"3\"/>"
                                           "</integrator></integrator>");
    CHECK(scene.integrator.max_depth == 3);
    REQUIRE(scene.warnings.size() == 1);
    CHECK_THAT(scene.warnings[0], Catch::Contains(type) && Catch::Contains("only its nested \"path\""));
    const Scene alone = SceneFolder().load("<integrator type=\"" + type + "\">" + aovs + "</integrator>");
    CHECK_THAT(alone.warnings.at(0), Catch::Contains("radiance is rendered instead"));
  }
}

TEST_CASE("samplers, films and filters may be defined once and referred to") {
  const Scene scene = SceneFolder().load(
      "<sampler type=\"independent\" id=\"s\"><integer name=\"sample_count\" value=\"9\"/></sampler>"
      "<rfilter type=\"box\" id=\"r\"/><film type=\"hdrfilm\" id=\"f\"><ref id=\"r\"/></film>"
      "<sensor type=\"perspective\"><ref id=\"s\"/><ref id=\"f\"/></sensor>");
  CHECK(scene.sensors[0].spp == 9);
  CHECK(scene.sensors[0].filter == FilterKind::box);
}
