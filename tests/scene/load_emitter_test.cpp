#include "itn/exr.h"
#include "tests/scene/scene_folder.h"

using namespace itn;

namespace {

Environment load(const std::string& element) { return SceneFolder().load(element).environment.value(); }
std::string sunsky(const std::string& content) { return "<emitter type=\"sunsky\">\n" + content + "</emitter>"; }
std::string number(const std::string& name, const std::string& value) {
  return "<float name=\"" + name + "\" value=\"" + value + "\"/>";
}
const std::string zenith = "<vector name=\"sun_direction\" x=\"0\" y=\"0\" z=\"1\"/>";

void check_direction(const Vec3& got, const Vec3& expected, double margin) {
  for (std::size_t i = 0; i < 3; ++i) CHECK(got[i] == Approx(expected[i]).margin(margin));
}
void check_error(const std::string& scene, const std::vector<std::string>& words) {
  SceneFolder().check_error(scene, 3, words);
}

}  // namespace

TEST_CASE("a constant emitter has radiance 1 unless it says otherwise") {
  CHECK(load("<emitter type=\"constant\"/>").colour("radiance") == Rgb{1, 1, 1});
  CHECK(load("<emitter type=\"constant\" id=\"e\"><rgb name=\"radiance\" value=\"1 2 3\"/></emitter>")
            .colour("radiance") == Rgb{1, 2, 3});
}

TEST_CASE("an envmap brings its image, scale and rotation") {
  SceneFolder folder;
  write_exr(folder.path("e.exr"), {2, 1, {"R", "G", "B"}, {1, 2, 3, 4, 5, 6}, {}});
  const Environment e =
      folder
          .load("<emitter type=\"envmap\"><string name=\"filename\" value=\"e.exr\"/>" + number("scale", "2") +
                "<transform name=\"to_world\"><rotate x=\"1\" angle=\"90\"/></transform></emitter>")
          .environment.value();
  CHECK(e.type() == "envmap");
  REQUIRE(e.bitmap);
  // Mitsuba pads smaller ones to 2 x 3.
  CHECK((e.bitmap->width == 2 && e.bitmap->height == 3));
  CHECK(e.bitmap->data == std::vector<float>{1, 2, 3, 4, 5, 6, 1, 2, 3, 4, 5, 6, 1, 2, 3, 4, 5, 6});
  CHECK(e.number("scale") == 2);
  CHECK(e.to_world.m[6] == Approx(-1));
}

TEST_CASE("an envmap below 2 x 3 pixels repeats its last column and row, and is told") {
  SceneFolder folder;
  const auto load = [&](int width, int height, const std::vector<float>& values) {
    write_exr(folder.path("e.exr"), {width, height, {"Y"}, values, {}});
    return folder.load("<emitter type=\"envmap\"><string name=\"filename\" value=\"e.exr\"/></emitter>");
  };
  CHECK(load(1, 1, {7}).environment->bitmap->data == std::vector<float>(6, 7));
  CHECK(load(1, 2, {1, 2}).environment->bitmap->data == std::vector<float>{1, 1, 2, 2, 2, 2});
  CHECK(load(3, 1, {1, 2, 3}).environment->bitmap->data == std::vector<float>{1, 2, 3, 1, 2, 3, 1, 2, 3});
  CHECK_THAT(load(1, 1, {7}).warnings.at(0), Catch::Contains("1 x 1") && Catch::Contains("2 x 3"));
  CHECK(load(2, 3, {1, 2, 3, 4, 5, 6}).warnings.empty());
}

TEST_CASE("a sunsky that says nothing is Tokyo on 10 July 2010 at 15:00, as in Mitsuba") {
  const Environment e = load(sunsky(""));
  CHECK(e.type() == "sunsky");
  CHECK(e.number("turbidity") == 3);
  CHECK(e.colour("albedo") == Rgb{0.3, 0.3, 0.3});
  CHECK(e.number("sun_scale") == 1);
  CHECK(e.number("sky_scale") == 1);
  CHECK(e.sun.aperture == 0.5358);
  CHECK(!e.sun.complex);
  // Mitsuba 3.9.1 prints this direction; it computes days in float32, hence the margin.
  check_direction(e.sun.direction, {0.0513854, 0.691748, 0.720308}, 5e-4);
}

TEST_CASE("the sun stands where Mitsuba puts it for a place and time") {
  const auto integer = [](const std::string& name, const std::string& value) {
    return "<integer name=\"" + name + "\" value=\"" + value + "\"/>";
  };
  const Environment munich =
      load(sunsky(number("latitude", "48") + number("longitude", "11") + number("timezone", "1") +
                  integer("year", "2024") + integer("month", "6") + integer("day", "21") + number("hour", "12") +
                  number("minute", "30") + number("second", "10")));
  check_direction(munich.sun.direction, {0.414749, 0.0490092, 0.908615}, 5e-4);
  const Environment chile =
      load(sunsky(number("latitude", "-30") + number("longitude", "-70") + number("timezone", "-4") +
                  integer("year", "1999") + integer("month", "1") + integer("day", "2") + number("hour", "10") +
                  number("minute", "5") + number("second", "7")));
  check_direction(chile.sun.direction, {-0.0169774, -0.588217, 0.808525}, 5e-4);
}

TEST_CASE("sun_direction is given in world space and kept in the sky's own") {
  const Environment e = load(sunsky("<vector name=\"sun_direction\" value=\"0 0.6 0.8\"/>"));
  check_direction(e.sun.direction, {0, 0.6, 0.8}, 1e-12);
  // The sky's zenith (0, 0, 1) becomes (0, 1, 0) in the world: world (0, 0.6, 0.8) is local (0, -0.8, 0.6).
  const Environment turned =
      load(sunsky("<vector name=\"sun_direction\" value=\"0 1.2 1.6\"/>"
                  "<transform name=\"to_world\"><rotate x=\"1\" angle=\"-90\"/></transform>"));
  check_direction(turned.sun.direction, {0, -0.8, 0.6}, 1e-12);
}

TEST_CASE("every parameter of a sunsky arrives") {
  const Environment e = load(sunsky(zenith + number("turbidity", "5") + number("albedo", "0.1") +
                                    number("sun_scale", "2") + number("sky_scale", "0") + number("sun_aperture", "4") +
                                    "<boolean name=\"complex_sun\" value=\"true\"/>"));
  CHECK(e.number("turbidity") == 5);
  CHECK(e.colour("albedo") == Rgb{0.1, 0.1, 0.1});
  CHECK(e.number("sun_scale") == 2);
  CHECK(e.number("sky_scale") == 0);
  CHECK(e.sun.aperture == 4);
  CHECK(e.sun.complex);
}

TEST_CASE("a sun below the horizon gives a warning") {
  const Scene scene = SceneFolder().load(sunsky("<vector name=\"sun_direction\" value=\"0 1 -0.1\"/>"));
  REQUIRE(scene.warnings.size() == 1);
  CHECK_THAT(scene.warnings[0], Catch::Contains("horizon"));
}

TEST_CASE("faulty emitters are refused") {
  check_error("<emitter type=\"constant\">\n<rgb name=\"radiance\" value=\"1 1 -1\"/></emitter>", {"radiance = -1"});
  check_error("<emitter type=\"constant\"/>\n<emitter type=\"sunsky\"/>", {"second environment", ":2:1"});
  check_error("<emitter type=\"envmap\">\n<string name=\"filename\" value=\"gone.exr\"/></emitter>", {"no such file"});
  SceneFolder().check_error("<emitter type=\"envmap\"/>", 2, {"no \"filename\""});
  check_error(sunsky(zenith + number("turbidity", "11")), {"turbidity = 11", "[1, 10]"});
  check_error(sunsky(zenith + number("albedo", "2")), {"albedo = 2"});
  check_error(sunsky(zenith + number("sun_scale", "-1")), {"sun_scale = -1"});
  check_error(sunsky(zenith + number("sun_aperture", "0")), {"sun_aperture = 0"});
  check_error(sunsky(zenith + number("hour", "12")), {"both sun_direction and hour"});
  check_error(sunsky(number("hour", "25")), {"hour = 25", "[0, 24]"});
  check_error(sunsky("<vector name=\"sun_direction\" value=\"0 0 0\"/>"), {"(0, 0, 0)"});
  check_error(sunsky("<transform name=\"to_world\"><scale x=\"2\"/></transform>"), {"scales"});
}

TEST_CASE("a truncated or empty environment image is refused") {
  SceneFolder folder;
  write_exr(folder.path("e.exr"), {64, 32, {"R", "G", "B"}, std::vector<float>(64 * 32 * 3, 0.5f), {}});
  std::ifstream file(folder.path("e.exr"), std::ios::binary);
  const std::string whole((std::istreambuf_iterator<char>(file)), {});
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{3}, std::size_t{100}, whole.size() / 2, whole.size() - 20}) {
    folder.write("cut.exr", whole.substr(0, size));
    folder.check_error("<emitter type=\"envmap\">\n<string name=\"filename\" value=\"cut.exr\"/></emitter>", 3,
                       {"cut.exr"});
  }
}

TEST_CASE("spherical harmonics have the order of their highest coefficient, and the others are 0") {
  const auto light = [](const std::string& content) {
    return "<emitter type=\"sphericalharmonics\" id=\"light\">\n" + content + "</emitter>";
  };
  const auto rgb = [](const std::string& name, const std::string& value) {
    return "<rgb name=\"" + name + "\" value=\"" + value + "\"/>";
  };
  const Environment e = load(light(rgb("c_0_0", "1 2 3") + rgb("c_2_-1", "-0.5 0 0.25")));
  CHECK(e.values.size() == 9);
  CHECK(e.colour("c_0_0") == Rgb{1, 2, 3});
  CHECK(e.colour("c_2_-1") == Rgb{-0.5, 0, 0.25});
  CHECK(e.colour("c_1_0") == Rgb{0, 0, 0});
  check_error("\n" + light(""), {"no coefficient", "c_0_0", "30"});
  check_error("\n" + light(rgb("c_31_0", "1 1 1")), {"no coefficient"});
  check_error(light(rgb("c_0_0", "1 1 1") + rgb("c_1_2", "1 1 1")), {"\"c_1_2\""});
}

TEST_CASE("sampling_weight 0 puts out lights without extent, whose line says so, and no others") {
  const std::string none = "<float name=\"sampling_weight\" value=\"0\"/>";
  const std::string point = "<emitter type=\"point\">" + none + "</emitter>\n";
  const std::string lamp = "<shape type=\"sphere\"><emitter type=\"area\">" + none + "</emitter></shape>\n";
  const std::string beam = "<shape type=\"disk\"><emitter type=\"directionalarea\">" + none + "</emitter></shape>\n";
  const std::string last = "<emitter type=\"spot\" id=\"kept\"/>\n";
  const Scene scene =
      SceneFolder().load(point + beam + lamp + last + "<emitter type=\"constant\">" + none + "</emitter>");
  REQUIRE(scene.lights.size() == 2);
  CHECK(scene.environment);
  CHECK(scene.lights[0].id == "kept");
  CHECK(scene.lights[1].type() == "area");
  CHECK(scene.shapes.at(0).light == -1);
  CHECK(scene.shapes.at(1).light == 1);
  REQUIRE(scene.warnings.size() == 2);
  for (const std::string& warning : scene.warnings)
    CHECK_THAT(warning, Catch::Contains("sampling_weight 0 puts it out"));
  SceneFolder().check_error("<emitter type=\"constant\"><float name=\"sampling_weight\" value=\"-1\"/></emitter>", 2,
                            {"sampling_weight = -1", "need 0 or more"});
}

TEST_CASE("a sensor on a surface says which light it cannot see behind smooth surfaces") {
  const std::string meter =
      "<shape type=\"disk\"><sensor type=\"irradiancemeter\"><film type=\"hdrfilm\"><integer name=\"width\" "
      "value=\"1\"/>"
      "<integer name=\"height\" value=\"1\"/></film></sensor></shape>\n";
  const std::string laser = "<emitter type=\"spot\" id=\"laser\"/>\n", lamp = "<emitter type=\"constant\"/>\n";
  const auto slab = [](const std::string& bsdf) {
    return "<shape type=\"cube\" id=\"slab\"><bsdf type=\"" + bsdf + "\"/></shape>\n";
  };
  const Scene scene = SceneFolder().load(meter + slab("dielectric") + laser);
  REQUIRE(scene.warnings.size() == 1);
  for (const char* word : {"\"spot\"", "\"slab\"", "is missing", "roughdielectric", "area lamp"})
    CHECK_THAT(scene.warnings[0], Catch::Contains(word));
  CHECK(SceneFolder().load(meter + slab("roughdielectric") + laser).warnings.empty());
  CHECK(SceneFolder().load(meter + slab("null") + laser).warnings.empty());
  CHECK(SceneFolder().load(meter + slab("dielectric") + lamp).warnings.empty());
  CHECK(SceneFolder().load(slab("dielectric") + laser).warnings.empty());
}
