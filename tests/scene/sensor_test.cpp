#include <cmath>

#include "tests/scene/scene_folder.h"

using namespace itn;

namespace {

std::string perspective(const std::string& content) {
  return "<sensor type=\"perspective\">\n" + content + "</sensor>";
}
std::string film(const std::string& content) { return perspective("<film type=\"hdrfilm\">" + content + "</film>"); }
std::string integer(const std::string& name, const std::string& value) {
  return "<integer name=\"" + name + "\" value=\"" + value + "\"/>";
}
std::string number(const std::string& name, const std::string& value) {
  return "<float name=\"" + name + "\" value=\"" + value + "\"/>";
}
std::string text(const std::string& name, const std::string& value) {
  return "<string name=\"" + name + "\" value=\"" + value + "\"/>";
}
Sensor load(const std::string& scene) { return SceneFolder().load(scene).sensors.at(0); }
void check_error(const std::string& scene, const std::vector<std::string>& words) {
  SceneFolder().check_error(scene, 3, words);
}

}  // namespace

TEST_CASE("a sensor that says nothing is Mitsuba's default") {
  const Sensor s = load(perspective(""));
  CHECK(s.kind == Sensor::Kind::perspective);
  CHECK(s.width == 768);
  CHECK(s.height == 576);
  CHECK(s.fov_x == Approx(38.1848).epsilon(1e-5));  // 50 mm
  CHECK(s.near_clip == 0.01);
  CHECK(std::isinf(s.far_clip));
  CHECK(s.filter == FilterKind::gaussian);
  CHECK(s.filter_stddev == 0.5);
  CHECK(s.spp == 4);
  CHECK(!s.luminance);
  CHECK(s.medium == -1);
  CHECK(s.crop_width == 768);
  CHECK(s.crop_height == 576);
}

TEST_CASE("fov counts along fov_axis") {
  // tan(fov_y / 2) = tan(fov_x / 2) / aspect; the diagonal of an image of aspect a has length sqrt(1 + 1/a^2) of its
  // width. The expected values are those of Mitsuba 3.9.1.
  const std::string wide = "<film type=\"hdrfilm\">" + integer("width", "640") + integer("height", "480") + "</film>";
  const std::string tall = "<film type=\"hdrfilm\">" + integer("width", "480") + integer("height", "640") + "</film>";
  const struct {
    const char* axis;
    double wide, tall;
  } cases[] = {{"x", 40, 40},
               {"y", 51.774010, 30.536943},
               {"diagonal", 32.468605, 24.637943},
               {"smaller", 51.774010, 40},
               {"larger", 40, 30.536943}};
  for (const auto& c : cases) {
    INFO(c.axis);
    const std::string lens = number("fov", "40") + text("fov_axis", c.axis);
    CHECK(load(perspective(wide + lens)).fov_x == Approx(c.wide).epsilon(1e-6));
    CHECK(load(perspective(tall + lens)).fov_x == Approx(c.tall).epsilon(1e-6));
  }
}

TEST_CASE("focal_length is that of a 35 mm film's diagonal") {
  const std::string size = "<film type=\"hdrfilm\">" + integer("width", "640") + integer("height", "480") + "</film>";
  CHECK(load(perspective(size + text("focal_length", "35mm"))).fov_x == Approx(52.622544).epsilon(1e-6));
  CHECK(load(perspective(size + text("focal_length", "85"))).fov_x == Approx(23.017088).epsilon(1e-6));
}

TEST_CASE("every parameter of a sensor and its film arrives") {
  const Scene scene = SceneFolder().load(
      "<medium type=\"homogeneous\" id=\"fog\"/>"
      "<sensor type=\"perspective\" id=\"front\"><float name=\"near_clip\" value=\"0.5\"/><float name=\"far_clip\" "
      "value=\"50\"/>"
      "<float name=\"principal_point_offset_x\" value=\"0.1\"/><float name=\"principal_point_offset_y\" "
      "value=\"-0.2\"/>"
      "<ref id=\"fog\"/><sampler type=\"multijitter\"><integer name=\"sample_count\" value=\"64\"/></sampler>"
      "<film type=\"hdrfilm\"><integer name=\"width\" value=\"100\"/><integer name=\"height\" value=\"50\"/>"
      "<integer name=\"crop_offset_x\" value=\"10\"/><integer name=\"crop_offset_y\" value=\"20\"/>"
      "<integer name=\"crop_width\" value=\"30\"/><integer name=\"crop_height\" value=\"5\"/>"
      "<string name=\"pixel_format\" value=\"luminance\"/><string name=\"file_format\" value=\"OpenEXR\"/>"
      "<string name=\"component_format\" value=\"float32\"/><boolean name=\"sample_border\" value=\"true\"/>"
      "<rfilter type=\"tent\"><float name=\"radius\" value=\"1.5\"/></rfilter></film></sensor>"
      "<sensor type=\"orthographic\"><film type=\"hdrfilm\"><rfilter type=\"box\"/></film></sensor>");
  REQUIRE(scene.sensors.size() == 2);
  const Sensor& s = scene.sensors[0];
  CHECK(s.id == "front");
  CHECK(s.near_clip == 0.5);
  CHECK(s.far_clip == 50);
  CHECK(s.principal_x == 0.1);
  CHECK(s.principal_y == -0.2);
  CHECK(s.medium == 0);
  CHECK(s.spp == 64);
  CHECK(s.width == 100);
  CHECK(s.height == 50);
  CHECK(s.crop_x == 10);
  CHECK(s.crop_y == 20);
  CHECK(s.crop_width == 30);
  CHECK(s.crop_height == 5);
  CHECK(s.luminance);
  CHECK(s.filter == FilterKind::tent);
  CHECK(s.filter_radius == 1.5);
  CHECK(s.sample_border);
  CHECK(!scene.sensors[1].sample_border);
  CHECK(scene.sensors[1].kind == Sensor::Kind::orthographic);
  CHECK(scene.sensors[1].id == "orthographic0");
  CHECK(scene.sensors[1].filter == FilterKind::box);
}

TEST_CASE("every sampler gives the number of samples") {
  for (const std::string type : {"independent", "stratified", "multijitter", "orthogonal", "ldsampler"})
    CHECK(load(perspective("<sampler type=\"" + type + "\">" + integer("sample_count", "9") + "</sampler>")).spp == 9);
}

TEST_CASE("faulty sensors are refused") {
  check_error(film(integer("width", "0")), {"width = 0", "need 1"});
  check_error(film(integer("height", "-4")), {"height = -4"});
  check_error(film(integer("width", "99999999999")), {"width = 99999999999"});
  check_error(film(number("width", "64")), {"<float>", "<integer>"});
  check_error(film(integer("width", "64") + integer("crop_offset_x", "64")), {"crop_offset_x = 64", "0 to 63"});
  check_error(film(integer("width", "64") + integer("crop_width", "65")), {"crop_width = 65"});
  check_error(film(text("pixel_format", "cmyk")), {"\"cmyk\"", "\"luminance\""});
  check_error(film("<rfilter type=\"sinc\"/>"), {"\"sinc\"", "\"gaussian\""});
  check_error(film("<rfilter type=\"tent\">" + number("radius", "0") + "</rfilter>"), {"radius = 0"});
  check_error(film("<rfilter type=\"gaussian\">" + number("stddev", "-1") + "</rfilter>"), {"stddev = -1"});
  check_error(film("<rfilter type=\"box\">" + number("radius", "1") + "</rfilter>"), {"unknown parameter \"radius\""});
  check_error(perspective("<film type=\"specfilm\"/>"), {"\"specfilm\"", "\"hdrfilm\""});
  check_error(perspective("<sampler type=\"independent\">" + integer("sample_count", "-1") + "</sampler>"),
              {"sample_count = -1", "need 0"});
  CHECK(load(perspective("<sampler type=\"independent\">" + integer("sample_count", "0") + "</sampler>")).spp == 1);
  check_error(perspective("<sampler type=\"halton\"/>"), {"\"halton\"", "\"independent\""});
  check_error(perspective(number("fov", "0")), {"fov = 0", "(0, 180)"});
  check_error(perspective(number("fov", "180")), {"fov = 180"});
  check_error(perspective(number("fov", "40") + text("focal_length", "50mm")), {"both fov and focal_length"});
  check_error(perspective(text("focal_length", "wide")), {"focal_length", "need a number"});
  check_error(perspective(text("focal_length", "-1mm")), {"focal_length", "above 0"});
  check_error(perspective(text("fov_axis", "z")), {"\"z\"", "\"diagonal\""});
  check_error(perspective(number("near_clip", "0")), {"near_clip = 0"});
  check_error(perspective(number("near_clip", "1") + number("far_clip", "0.5")), {"far_clip = 0.5"});
  check_error(perspective("<transform name=\"to_world\"><scale value=\"2\"/></transform>"), {"scales"});
  check_error("<sensor type=\"orthographic\">\n" + number("fov", "30") + "</sensor>", {"\"fov\""});
}

TEST_CASE("filters with negative lobes are rendered as gaussian, with a warning") {
  for (const std::string type : {"mitchell", "catmullrom", "lanczos"}) {
    const Scene scene = SceneFolder().load(film("<rfilter type=\"" + type + "\"/>"));
    CHECK(scene.sensors[0].filter == FilterKind::gaussian);
    CHECK(scene.sensors[0].filter_stddev == 0.5);
    REQUIRE(scene.warnings.size() == 1);
    CHECK_THAT(scene.warnings[0], Catch::Contains(type) && Catch::Contains("gaussian"));
  }
}

TEST_CASE("pixel formats with alpha or in XYZ are written as what they contain, with a warning") {
  const Scene rgba = SceneFolder().load(film(text("pixel_format", "rgba")));
  CHECK(!rgba.sensors[0].luminance);
  CHECK_THAT(rgba.warnings.at(0), Catch::Contains("\"rgba\"") && Catch::Contains("without alpha"));
  CHECK(load(film(text("pixel_format", "luminance_alpha"))).luminance);
}

TEST_CASE("a size given to the loader replaces the film's, and a crop keeps its fraction") {
  SceneFolder folder;
  const std::string scene =
      "<scene version=\"3.0.0\"><emitter type=\"constant\"/>" +
      perspective(number("fov", "40") + text("fov_axis", "y") + "<film type=\"hdrfilm\">" + integer("width", "400") +
                  integer("height", "200") + integer("crop_offset_x", "100") + integer("crop_width", "200") +
                  integer("crop_offset_y", "50") + integer("crop_height", "100") + "</film>") +
      "</scene>";
  folder.write("s.xml", scene);
  const Sensor s = load_scene(folder.path("s.xml"), {}, {.size = FilmSize{40, 40}}).sensors.at(0);
  CHECK(s.width == 40);
  CHECK(s.height == 40);
  CHECK(s.crop_x == 10);
  CHECK(s.crop_width == 20);
  CHECK(s.crop_y == 10);
  CHECK(s.crop_height == 20);
  CHECK(s.fov_x == Approx(40));  // along y, and the film is square now
  const Sensor tiny = load_scene(folder.path("s.xml"), {}, {.size = FilmSize{1, 1}}).sensors.at(0);
  CHECK(tiny.crop_x == 0);
  CHECK(tiny.crop_width == 1);
}

TEST_CASE("a radiancemeter is one ray") {
  const std::string one = "<film type=\"hdrfilm\">" + integer("width", "1") + integer("height", "1") + "</film>";
  const auto meter = [&](const std::string& content) {
    return "<sensor type=\"radiancemeter\">\n" + content + "</sensor>";
  };
  const Sensor s = load(meter(one + "<point name=\"origin\" value=\"1, 2, 3\"/><vector name=\"direction\" "
                                    "value=\"0, 2, 0\"/>"));
  CHECK(s.kind == Sensor::Kind::orthographic);
  CHECK(s.to_world.m == std::array<double, 16>{0, 0, 0, 1, 0, 0, 1, 2, 0, 0, 0, 3, 0, 0, 0, 1});
  const Sensor turned = load(meter(one + "<transform name=\"to_world\"><lookat origin=\"1, 2, 3\" target=\"1, 3, 3\" "
                                         "up=\"0, 0, 1\"/></transform>"));
  for (std::size_t i = 0; i < 16; ++i) CHECK(turned.to_world.m[i] == Approx(s.to_world.m[i]).margin(1e-12));
  SceneFolder().check_error(meter(""), 2, {"768 x 576", "need 1 x 1"});
  SceneFolder().check_error(meter(one + "<point name=\"origin\" value=\"1, 2, 3\"/>"), 3, {"need both"});
}

TEST_CASE("a thin lens needs its radius, and is sharp at far_clip unless it says otherwise") {
  const auto lens = [](const std::string& content) { return "<sensor type=\"thinlens\">\n" + content + "</sensor>"; };
  const Sensor s = load(lens(number("aperture_radius", "0.2") + number("focus_distance", "3")));
  CHECK(s.kind == Sensor::Kind::perspective);
  CHECK(s.aperture_radius == 0.2);
  CHECK(s.focus_distance == 3);
  CHECK(load(lens(number("aperture_radius", "0.2"))).focus_distance == 1e4);
  SceneFolder().check_error("\n" + lens(""), 3, {"aperture_radius"});
  check_error(lens(number("aperture_radius", "0")), {"aperture_radius = 0", "perspective"});
  check_error(lens(number("aperture_radius", "1") + number("focus_distance", "-1")), {"focus_distance = -1"});
}

TEST_CASE("an opencv camera has the pixels of its calibration, at any size of the film") {
  const auto camera = [](const std::string& content) {
    return "<sensor type=\"opencv\">\n" + content + "<film type=\"hdrfilm\">" + integer("width", "640") +
           integer("height", "480") + "</film></sensor>";
  };
  const std::string calibration =
      number("fx", "600") + number("fy", "620") + number("cx", "300.5") + number("cy", "250");
  const Sensor s = load(camera(calibration + number("k1", "-0.2") + number("p2", "0.001")));
  CHECK(s.kind == Sensor::Kind::perspective);
  CHECK(std::tan(s.fov_x / 2 * M_PI / 180) == Approx(320 / 600.0));
  CHECK(s.pixel_aspect == Approx(600 / 620.0));
  CHECK(s.principal_x == Approx(0.5 - 301.0 / 640));
  CHECK(s.principal_y == Approx(0.5 - 250.5 / 480));
  CHECK(s.distortion == std::array<double, 8>{-0.2, 0, 0, 0, 0, 0, 0, 0.001});
  const Sensor square =
      load_scene_text("scene.xml", "<scene version=\"3.0.0\">" + camera(number("fx", "600")) + "</scene>",
                      {.size = FilmSize{96, 96}})
          .sensors.at(0);
  CHECK(square.principal_x == 0);
  CHECK(square.principal_y == 0);
  CHECK(std::tan(square.fov_x / 2 * M_PI / 180) * square.pixel_aspect == Approx(240 / 600.0));  // half the height

  SceneFolder().check_error("\n" + camera(""), 3, {"fx"});
  check_error(camera(number("fx", "0")), {"fx = 0", "need pixels above 0"});
  check_error(camera(number("fx", "600") + number("k1", "-2")), {"folds before pixel (0, 0)", "move outwards"});
}

TEST_CASE("an irradiancemeter lies on the shape that it is in, and needs one") {
  const std::string meter = "<sensor type=\"irradiancemeter\"/>";
  const Scene scene = SceneFolder().load("<shape type=\"sphere\">" + meter +
                                         "<medium type=\"homogeneous\" name=\"exterior\"/></shape>");
  const Sensor& s = scene.sensors.back();
  CHECK(s.kind == Sensor::Kind::irradiance);
  CHECK(s.zone->kind == Shape::Kind::sphere);
  CHECK(s.medium == scene.shapes.at(0).exterior);
  CHECK_THAT(scene.warnings.at(0), Catch::Contains("every pixel measures"));
  check_error("\n" + meter, {"belongs into the <shape>"});
  SceneFolder().check_error("<shape type=\"sphere\">\n<sensor type=\"perspective\"/></shape>", 3,
                            {"need irradiancemeter there"});
  SceneFolder().check_error(
      "<shape type=\"sphere\">\n<sensor type=\"irradiancemeter\"><transform name=\"to_world\"/>"
      "</sensor></shape>",
      3, {"to_world"});
}

TEST_CASE("a distant sensor looks along a direction at all, a point or a shape") {
  const auto distant = [](const std::string& content) {
    return "<sensor type=\"distant\"><film type=\"hdrfilm\">" + integer("width", "1") + integer("height", "1") +
           "</film>\n" + content + "</sensor>";
  };
  const std::string direction = "<vector name=\"direction\" value=\"0, 0, -2\"/>";
  const Sensor all = load(distant(direction));
  CHECK(all.kind == Sensor::Kind::distant);
  CHECK(all.direction == Vec3{0, 0, -1});
  CHECK((!all.zone && !all.target));
  CHECK(load(distant("<transform name=\"to_world\"><rotate x=\"1\" angle=\"90\"/></transform>")).direction[1] ==
        Approx(-1));
  CHECK(load(distant(direction + "<point name=\"target\" value=\"1, 2, 3\"/>")).target == Vec3{1, 2, 3});
  const Scene scene = SceneFolder().load(distant(direction + "<shape type=\"disk\" name=\"target\"/>"));
  CHECK(scene.sensors.back().zone->kind == Shape::Kind::disk);
  CHECK((scene.shapes.empty() && scene.bsdfs.empty()));  // nothing but where to look
  check_error(distant(direction + "<transform name=\"to_world\"/>"), {"both direction and to_world"});
  check_error(distant("<vector name=\"direction\" value=\"0, 0, 0\"/>"), {"need a direction"});
  SceneFolder().check_error("\n<sensor type=\"distant\"/>", 3, {"768 x 576", "need 1 x 1"});
}

TEST_CASE("a scene that goes beyond Mitsuba's far_clip is seen, with a line that says so, unless the file gives one") {
  const auto warnings = [](const std::string& clip, const std::string& radius) {
    const std::string far_ball = "<shape type=\"sphere\">" + number("radius", radius) + "</shape>";
    return SceneFolder().load(far_ball + "<sensor type=\"perspective\" id=\"eye\">" + clip + "</sensor>").warnings;
  };
  REQUIRE(warnings("", "20000").size() == 1);
  CHECK_THAT(warnings("", "20000")[0], Catch::Contains("the scene reaches 20000 from sensor \"eye\""));
  CHECK(warnings("", "9999").empty());
  CHECK(warnings(number("far_clip", "50"), "20000").empty());
}
