// Files, ids, definitions and includes.
#include "tests/scene/scene_folder.h"

using namespace itn;

namespace {

const std::string medium_s = "<medium type=\"homogeneous\" id=\"s\"><float name=\"sigma_t\" value=\"$s\"/></medium>";

}  // namespace

TEST_CASE("$name is filled by <default>, and by a definition instead when there is one") {
  SceneFolder folder;
  const std::string body = "<default name=\"s\" value=\"2\"/>\n" + medium_s;
  CHECK(folder.load(body).media[0].colour("sigma_t") == Rgb{2, 2, 2});
  CHECK(folder.load(body, {{"s", "5"}}).media[0].colour("sigma_t") == Rgb{5, 5, 5});
}

TEST_CASE("the first <default> of a name holds, and one may use another") {
  SceneFolder folder;
  const Scene scene = folder.load(
      "<default name=\"a\" value=\"1\"/><default name=\"a\" value=\"3\"/>"
      "<default name=\"s\" value=\"$a.5\"/>" +
      medium_s);
  CHECK(scene.media[0].colour("sigma_t")[0] == 1.5);
}

TEST_CASE("a name that nothing defines is an error that says how to define it") {
  SceneFolder().check_error(medium_s, 2, {"$s", "-D s=", "<default"});
}

TEST_CASE("a definition that the scene never uses is a usage error that suggests the right name") {
  SceneFolder folder;
  const std::string body =
      "<default name=\"sigma\" value=\"1\"/>\n<medium type=\"homogeneous\"><float name=\"scale\" "
      "value=\"$sigma\"/></medium>";
  CHECK_THROWS_AS(folder.load(body, {{"sigmo", "1"}}), UsageError);
  CHECK_THROWS_WITH(folder.load(body, {{"sigmo", "1"}}), Catch::Contains("-D sigmo=1") && Catch::Contains("\"sigma\""));
}

TEST_CASE("an included scene's elements count as the including one's, and see its definitions") {
  SceneFolder folder;
  folder.write("part.xml", "<scene version=\"3.0.0\">" + medium_s + "</scene>");
  const Scene scene = folder.load("<default name=\"s\" value=\"7\"/><include filename=\"part.xml\"/>");
  REQUIRE(scene.media.size() == 1);
  CHECK(scene.media[0].colour("sigma_t")[0] == 7);
}

TEST_CASE("an error in an included file names that file") {
  SceneFolder folder;
  folder.write("part.xml", "<scene version=\"3.0.0\">\n\n  <shape type=\"spere\"/></scene>");
  CHECK_THAT(folder.error_of("<include filename=\"part.xml\"/>"), Catch::StartsWith(folder.path("part.xml") + ":3:3:"));
}

TEST_CASE("files that include each other are refused") {
  SceneFolder folder;
  folder.write("a.xml", "<scene version=\"3.0.0\"><include filename=\"b.xml\"/></scene>");
  folder.write("b.xml", "<scene version=\"3.0.0\">\n<include filename=\"a.xml\"/></scene>");
  const std::string message = folder.error_of("<include filename=\"a.xml\"/>");
  CHECK_THAT(message, Catch::StartsWith(folder.path("b.xml") + ":2:1:") && Catch::Contains("includes itself"));
}

TEST_CASE("missing scene and include files are named") {
  CHECK_THROWS_WITH(load_scene("/nowhere/x.xml"), Catch::Contains("/nowhere/x.xml") && Catch::Contains("no such file"));
  CHECK_THROWS_AS(load_scene("/nowhere/x.xml"), InputError);
  CHECK_THROWS_WITH(load_scene("/tmp"), Catch::Contains("folder"));
  SceneFolder().check_error("\n<include filename=\"gone.xml\"/>", 3, {"gone.xml", "no such file"});
}

TEST_CASE("text between elements is left out, and told but for spaces") {
  SceneFolder folder;
  CHECK(folder.load("<![CDATA[ \n ]]><!-- a comment -->").warnings.empty());
  const Scene scene = folder.load("<shape type=\"cube\">0.5</shape>\n<![CDATA[words]]>");
  REQUIRE(scene.warnings.size() == 2);
  CHECK_THAT(scene.warnings[0], Catch::Contains("scene.xml:2:20: <shape>") && Catch::Contains("\"0.5\" is left out"));
  CHECK_THAT(scene.warnings[1], Catch::Contains("scene.xml:3:") && Catch::Contains("\"words\" is left out"));
}

TEST_CASE("malformed XML is reported where it breaks") {
  SceneFolder folder;
  folder.check_error("<shape type=\"sphere\">\n</shap>", 3, {"malformed XML"});
  folder.check_error("<shape type=\"sphere\" type=\"cube\"/>", 2, {"\"type\" given twice"});
  folder.write("empty.xml", "");
  CHECK_THROWS_WITH(load_scene(folder.path("empty.xml")), Catch::Contains("malformed XML"));
  folder.write("other.xml", "\n<html></html>");
  CHECK_THROWS_WITH(load_scene(folder.path("other.xml")),
                    Catch::Contains("other.xml:2:1: ") && Catch::Contains("<html>"));
}

TEST_CASE("elements that nest without end are refused") {
  std::string body;
  for (int i = 0; i < 10000; ++i) body += "<bsdf type=\"twosided\">";
  for (int i = 0; i < 10000; ++i) body += "</bsdf>";
  SceneFolder().check_error(body, 2, {"deep"});
}

TEST_CASE("a ref stands for the element with its id, wherever that comes in the file") {
  SceneFolder folder;
  const Scene scene = folder.load(
      "<shape type=\"sphere\"><ref name=\"interior\" id=\"m\"/><ref id=\"b\"/></shape>"
      "<shape type=\"cube\"><ref name=\"interior\" id=\"m\"/><ref id=\"b\"/></shape>"
      "<medium type=\"homogeneous\" id=\"m\"/><bsdf type=\"null\" id=\"b\"/>");
  CHECK(scene.media.size() == 1);
  CHECK(scene.bsdfs.size() == 1);
  CHECK(scene.shapes[0].interior == 0);
  CHECK(scene.shapes[1].interior == 0);
  CHECK(scene.shapes[1].exterior == -1);
}

TEST_CASE("an alias is a second id") {
  const Scene scene = SceneFolder().load(
      "<bsdf type=\"null\" id=\"a\"/><alias id=\"a\" as=\"b\"/>"
      "<shape type=\"sphere\"><ref id=\"b\"/></shape>");
  CHECK(scene.bsdfs[static_cast<std::size_t>(scene.shapes[0].bsdf)].id == "a");
}

TEST_CASE("faulty ids and refs are refused") {
  SceneFolder folder;
  folder.check_error("<bsdf type=\"null\" id=\"a\"/>\n<bsdf type=\"null\" id=\"a\"/>", 3, {"\"a\" is taken", ":2:1"});
  folder.check_error("<bsdf type=\"null\" id=\"glass\"/>\n<shape type=\"sphere\"><ref id=\"glas\"/></shape>", 3,
                     {"no element has the id \"glas\"", "did you mean \"glass\""});
  folder.check_error(
      "<bsdf type=\"null\" id=\"a\"/>\n<shape type=\"sphere\">\n<ref name=\"interior\" id=\"a\"/></shape>", 4,
      {"\"interior\" refers to the bsdf \"a\"", "need a medium"});
  folder.check_error("<medium type=\"homogeneous\" id=\"a\"/>\n<shape type=\"sphere\">\n<ref id=\"a\"/></shape>", 4,
                     {"does not belong here", "name=\"interior\""});
  folder.check_error("<shape type=\"sphere\"><ref/></shape>", 2, {"<ref> has no id"});
  folder.check_error("<bsdf type=\"null\" id=\"\"/>", 2, {"empty id"});
  folder.check_error("<alias id=\"a\" as=\"b\"/>", 2, {"\"a\""});
}

TEST_CASE("an element that contains a reference to itself is refused") {
  SceneFolder folder;
  folder.check_error(
      "<bsdf type=\"twosided\" id=\"a\">\n<bsdf type=\"twosided\" id=\"b\"><ref id=\"a\"/></bsdf></bsdf>", 2,
      {"\"a\"", "reference to itself"});
  folder.check_error("<bsdf type=\"twosided\" id=\"a\"><ref id=\"a\"/></bsdf>", 2, {"reference to itself"});
}

TEST_CASE("objects without an id are numbered by type, past the ids that are taken") {
  const Scene scene = SceneFolder().load(
      "<medium type=\"homogeneous\"/><medium type=\"homogeneous\" id=\"homogeneous1\"/>"
      "<medium type=\"homogeneous\"><phase type=\"hg\"/></medium>");
  CHECK(scene.media[0].id == "homogeneous0");
  CHECK(scene.media[1].id == "homogeneous1");
  CHECK(scene.media[2].id == "homogeneous2");
  CHECK(scene.media[2].phase.id == "hg0");
}

TEST_CASE("unknown elements, attributes and types are named with what is allowed") {
  SceneFolder folder;
  folder.check_error("<shap type=\"sphere\"/>", 2, {"<shap>", "did you mean \"shape\""});
  folder.check_error("<shape typ=\"sphere\"/>", 2, {"\"typ\"", "did you mean \"type\""});
  folder.check_error("<shape/>", 2, {"<shape> has no type"});
  folder.check_error("\n <shape type=\"spere\"/>", 3, {":2:", "\"spere\"", "\"rectangle\"", "did you mean \"sphere\""});
  folder.check_error("<bsdf type=\"rougdielectric\"/>", 2, {"\"null\"", "did you mean \"roughdielectric\""});
  folder.check_error("<bsdf type=\"hair\"/>", 2, {"unknown type"});
  folder.check_error("<medium type=\"heterogenous\"/>", 2, {"need \"homogeneous\""});
  folder.check_error("<emitter type=\"lamp\"/>", 2, {"\"lamp\"", "\"sunsky\"", "\"point\""});
  folder.check_error("<integrator type=\"bdpt\"/>", 2, {"\"volpath\""});
  folder.check_error("<sensor type=\"fisheye\"/>", 2, {"\"perspective\""});
  folder.check_error("<shape type=\"sphere\">\n<film type=\"hdrfilm\"/></shape>", 3,
                     {"does not belong here", "<bsdf>"});
}

TEST_CASE("unknown parameters are named with what is allowed, in every kind of element") {
  SceneFolder folder;
  const std::string x = "\n<float name=\"albdo\" value=\"1\"/>";
  for (const std::string open :
       {"medium type=\"homogeneous\"", "bsdf type=\"null\"", "bsdf type=\"diffuse\"", "bsdf type=\"dielectric\"",
        "bsdf type=\"roughdielectric\"", "shape type=\"sphere\"", "shape type=\"disk\"", "shape type=\"cube\"",
        "shape type=\"rectangle\"", "emitter type=\"constant\"", "emitter type=\"sunsky\"", "integrator type=\"path\"",
        "sensor type=\"perspective\"", "sensor type=\"orthographic\"", "phase type=\"hg\"", "phase type=\"isotropic\""})
    folder.check_error("<" + open + ">" + x + "</" + open.substr(0, open.find(' ')) + ">", 3, {"\"albdo\""});
  folder.check_error("<bsdf type=\"twosided\"><bsdf type=\"diffuse\"/>" + x + "</bsdf>", 3, {"\"albdo\""});
  folder.check_error("<medium type=\"homogeneous\">" + x + "</medium>", 3, {"did you mean \"albedo\"", "\"sigma_t\""});
  for (const std::string open : {"film type=\"hdrfilm\"", "sampler type=\"independent\""})
    folder.check_error(
        "<sensor type=\"perspective\"><" + open + ">" + x + "</" + open.substr(0, open.find(' ')) + "></sensor>", 3,
        {"\"albdo\""});
  folder.check_error("<float name=\"albdo\" value=\"1\"/>", 2, {"scene", "\"albdo\""});
}

TEST_CASE("values of the wrong type or shape are refused") {
  SceneFolder folder;
  const auto in_medium = [](const std::string& value) {
    return "<medium type=\"homogeneous\">\n" + value + "</medium>";
  };
  folder.check_error(in_medium("<float name=\"scale\" value=\"one\"/>"), 3,
                     {"\"scale\"", "got \"one\"", "need a number"});
  folder.check_error(in_medium("<float name=\"scale\" value=\"1 2\"/>"), 3, {"got \"1 2\""});
  folder.check_error(in_medium("<float name=\"scale\" value=\"\"/>"), 3, {"got \"\""});
  folder.check_error(in_medium("<float name=\"scale\" value=\"nan\"/>"), 3, {"finite"});
  folder.check_error(in_medium("<float name=\"scale\" value=\"1e999\"/>"), 3, {"1e999"});
  folder.check_error(in_medium("<float name=\"scale\" value=\"1e40\"/>"), 3, {"1e40", "single precision"});
  folder.check_error(in_medium("<float name=\"scale\"/>"), 3, {"no value"});
  folder.check_error(in_medium("<float value=\"1\"/>"), 3, {"no name"});
  folder.check_error(in_medium("<string name=\"scale\" value=\"1\"/>"), 3, {"<string>", "need <float>"});
  folder.check_error(in_medium("<rgb name=\"albedo\" value=\"1, 2\"/>"), 3, {"2 numbers", "3"});
  folder.check_error(in_medium("<rgb name=\"albedo\" value=\"#aabbcc\"/>"), 3, {"#aabbcc"});
  folder.check_error(in_medium("<float name=\"scale\" value=\"1\"/>\n<float name=\"scale\" value=\"2\"/>"), 4,
                     {"\"scale\" given twice", ":3:"});
  folder.check_error("<integrator type=\"path\">\n<integer name=\"max_depth\" value=\"2.5\"/></integrator>", 3,
                     {"integer"});
  folder.check_error("<integrator type=\"path\">\n<float name=\"max_depth\" value=\"2\"/></integrator>", 3,
                     {"<integer>"});
  folder.check_error("<integrator type=\"path\">\n<boolean name=\"hide_emitters\" value=\"1\"/></integrator>", 3,
                     {"\"true\" or \"false\""});
  folder.check_error("<shape type=\"sphere\">\n<point name=\"center\" value=\"1 2\"/></shape>", 3, {"2 numbers"});
  folder.check_error("<shape type=\"sphere\">\n<point name=\"center\" x=\"1\" y=\"2\"/></shape>", 3, {"no z"});
}

TEST_CASE("a scene without a sensor is seen from below its least z") {
  SceneFolder folder;
  folder.write("s.xml",
               "<scene version=\"3.0.0\"><emitter type=\"constant\"/><shape type=\"cube\"><transform name=\"to_world\">"
               "<scale x=\"2\" y=\"1\" z=\"3\"/><translate x=\"1\" y=\"2\" z=\"3\"/></transform></shape></scene>");
  const Scene scene = load_scene(folder.path("s.xml"));
  REQUIRE(scene.warnings.size() == 1);
  CHECK_THAT(scene.warnings[0], Catch::Contains("no sensor") && Catch::Contains("perspective"));
  REQUIRE(scene.sensors.size() == 1);
  const Sensor& sensor = scene.sensors[0];
  const double distance = 3 / std::tan(22.5 * M_PI / 180);  // the longest side, 6, fills the field of view
  CHECK(sensor.fov_x == 45);
  CHECK(sensor.to_world.m[3] == Approx(1));
  CHECK(sensor.to_world.m[7] == Approx(2));
  CHECK(sensor.to_world.m[11] == Approx(-distance));
  CHECK(sensor.near_clip == Approx(distance / 100));
  CHECK(sensor.far_clip == Approx(30 + distance));
  CHECK(sensor.width == 768);
  folder.write("s.xml", "<scene version=\"3.0.0\"><emitter type=\"constant\"/></scene>");
  CHECK(load_scene(folder.path("s.xml")).sensors.at(0).to_world.m[11] == 0);
}

TEST_CASE("a scene without a light gives a warning") {
  SceneFolder folder;
  folder.write("s.xml", "<scene version=\"3.0.0\"><sensor type=\"perspective\"/></scene>");
  const Scene scene = load_scene(folder.path("s.xml"));
  REQUIRE(scene.warnings.size() == 1);
  CHECK_THAT(scene.warnings[0], Catch::Contains("no emitter") && Catch::Contains("black"));
  CHECK(!scene.environment);
}

TEST_CASE("<path> adds a folder in which files are looked for") {
  SceneFolder folder;
  std::filesystem::create_directory(folder.path("meshes"));
  folder.write_tetrahedron("meshes/t.ply");
  const std::string shape = "<shape type=\"ply\"><string name=\"filename\" value=\"t.ply\"/></shape>";
  CHECK(folder.load("<path value=\"meshes\"/>" + shape).shapes.size() == 1);
  CHECK_THAT(folder.error_of(shape), Catch::Contains("no such file"));
  folder.check_error("<path value=\"gone\"/>", 2, {"no such folder"});
}

TEST_CASE("the integrator gives the depths, and every type selects this renderer") {
  for (const std::string type : {"volpath", "volpathmis", "path", "prbvolpath"}) {
    const Scene scene = SceneFolder().load("<integrator type=\"" + type +
                                           "\"><integer name=\"max_depth\" value=\"7\"/>"
                                           "<integer name=\"rr_depth\" value=\"3\"/>"
                                           "<boolean name=\"hide_emitters\" value=\"true\"/></integrator>");
    CHECK(scene.integrator.max_depth == 7);
    CHECK(scene.integrator.rr_depth == 3);
    CHECK(scene.integrator.hide_emitters);
  }
  const Scene scene = SceneFolder().load("");
  CHECK(scene.integrator.max_depth == -1);
  CHECK(scene.integrator.rr_depth == 5);
  CHECK(!scene.integrator.hide_emitters);
  SceneFolder().check_error("<integrator type=\"path\">\n<integer name=\"max_depth\" value=\"-2\"/></integrator>", 3,
                            {"-2"});
  SceneFolder().check_error("<integrator type=\"path\">\n<integer name=\"rr_depth\" value=\"0\"/></integrator>", 3,
                            {"rr_depth"});
  // Deeper than any path goes.
  const Scene deep = SceneFolder().load(
      "<integrator type=\"path\"><integer name=\"max_depth\" value=\"1000000000\"/>"
      "<integer name=\"rr_depth\" value=\"2000000000\"/></integrator>");
  CHECK(deep.integrator.max_depth == -1);
  CHECK(deep.integrator.rr_depth == 1'000'000);
  SceneFolder().check_error("<integrator type=\"path\"/>\n<integrator type=\"path\"/>", 3,
                            {"more than one <integrator>"});
}

TEST_CASE("definitions that multiply each other are stopped before they fill the memory") {
  std::string body = "<default name=\"a0\" value=\"0123456789\"/>";
  for (int i = 1; i < 40; ++i) {
    const std::string before = "$a" + std::to_string(i - 1);
    body += "<default name=\"a" + std::to_string(i) + "\" value=\"" + before + " " + before + "\"/>";
  }
  SceneFolder().check_error(body, 2, {"grows beyond"});
}
