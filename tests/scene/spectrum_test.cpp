// Spectra become the colours that Mitsuba 3.9.1 gives them in its variant scalar_rgb. The expected values are what
// mitsuba.traverse() prints for the same element, for instance
//   mi.traverse(mi.load_string('<bsdf version="3.0.0" type="diffuse"><spectrum name="reflectance" value="400:0.1,
//   500:0.8, 700:0.3"/></bsdf>'))['reflectance.value']
// and ['radiance.value'] of a constant emitter.
#include "runtime/scene/xml/spectrum.h"

#include "tests/scene/scene_folder.h"

using namespace itn;

namespace {

void check_close(const Rgb& got, const Rgb& expected, double tolerance = 1e-5) {
  for (std::size_t i = 0; i < 3; ++i) CHECK(got[i] == Approx(expected[i]).epsilon(tolerance).margin(1e-7));
}
Scene load(const std::string& body) { return SceneFolder().load(body); }
Rgb reflectance(const std::string& spectrum) {
  return load("<bsdf type=\"diffuse\">" + spectrum + "</bsdf>").bsdfs.at(0).value("reflectance").value;
}
Rgb radiance(const std::string& spectrum) {
  return load("<emitter type=\"constant\">" + spectrum + "</emitter>").environment.value().colour("radiance");
}
std::string pairs(const std::string& name, const std::string& value) {
  return "<spectrum name=\"" + name + "\" value=\"" + value + "\"/>";
}

}  // namespace

TEST_CASE("wavelength:value pairs of a reflectance are seen under daylight, as in Mitsuba") {
  check_close(reflectance(pairs("reflectance", "400:0.1, 500:0.8, 700:0.3")), {0.4149859, 0.7290166, 0.4530662});
  check_close(reflectance(pairs("reflectance", "360:1 830:1")), {0.9989853, 0.9988737, 0.9988016});
}

TEST_CASE("wavelength:value pairs of a light are seen as they are, as in Mitsuba") {
  check_close(radiance(pairs("radiance", "400:0.1, 500:0.8, 700:0.3")), {0.5251424, 0.6930032, 0.3995266});
  check_close(radiance(pairs("radiance", "380:2.0, 780:0.5")), {1.256436, 1.31444, 1.621618});
}

TEST_CASE("colours beyond linear sRGB are clamped as in Mitsuba, with a warning") {
  const Scene scene = load("<bsdf type=\"diffuse\">\n" + pairs("reflectance", "600:0.9 650:0.9 700:0.2") + "</bsdf>");
  check_close(scene.bsdfs[0].value("reflectance").value, {0.7395717, 0, 0});
  REQUIRE(scene.warnings.size() == 1);
  CHECK_THAT(scene.warnings[0], Catch::Contains(":3:1: ") && Catch::Contains("clamped"));
  check_close(reflectance(pairs("reflectance", "380:2.0, 780:0.5")), {1, 1, 1});
  check_close(radiance(pairs("radiance", "500:3 520:3.5")), {0, 0.5876932, 0.0407954});
}

TEST_CASE("one value is a grey reflectance, and light of equal energy, which is not white") {
  CHECK(reflectance(pairs("reflectance", "0.25")) == Rgb{0.25, 0.25, 0.25});
  check_close(radiance(pairs("radiance", "2")), {2.409588, 1.896582, 1.817832});
}

TEST_CASE("a spectrum is read from a file of wavelengths and values") {
  SceneFolder folder;
  folder.write("s.spd", "# nm value\n400 0.1\n\n500 0.8 # peak\n700\t0.3\r\n");
  const std::string body = "<bsdf type=\"diffuse\"><spectrum name=\"reflectance\" filename=\"s.spd\"/></bsdf>";
  check_close(folder.load(body).bsdfs[0].value("reflectance").value, {0.4149859, 0.7290166, 0.4530662});
  folder.write("s.spd", "400 0.1\n500 0.8 0.9\n");
  CHECK_THAT(folder.error_of(body), Catch::Contains("s.spd:2:1: ") && Catch::Contains("3 numbers"));
  folder.write("s.spd", "500 0.1\n400 0.8\n");
  CHECK_THAT(folder.error_of(body), Catch::Contains("increasing"));
}

TEST_CASE("spectrum plugins are the colours that they stand for") {
  const auto plugin = [](const std::string& type, const std::string& content) {
    return "<spectrum name=\"radiance\" type=\"" + type + "\">" + content + "</spectrum>";
  };
  const std::string scale = "<float name=\"scale\" value=\"3\"/>", rgb = "<rgb name=\"color\" value=\"1, 2, 3\"/>";
  CHECK(radiance(plugin("uniform", "<float name=\"value\" value=\"2\"/>")) == Rgb{2, 2, 2});
  CHECK(radiance(plugin("srgb", rgb)) == Rgb{1, 2, 3});
  CHECK(radiance(plugin("rawconstant", "<vector name=\"value\" value=\"1, 2, 3\"/>")) == Rgb{1, 2, 3});
  CHECK(radiance(plugin("d65", "")) == Rgb{1, 1, 1});
  CHECK(radiance(plugin("d65", scale + rgb)) == Rgb{3, 6, 9});
  check_close(radiance(plugin("irregular",
                              "<string name=\"wavelengths\" value=\"400, 500, 700\"/>"
                              "<string name=\"values\" value=\"0.1, 0.8, 0.3\"/>")),
              {0.5251424, 0.6930032, 0.3995266});
  check_close(radiance(plugin("regular",
                              "<float name=\"wavelength_min\" value=\"380\"/><float name=\"wavelength_max\" "
                              "value=\"780\"/><string name=\"values\" value=\"2.0, 1.25, 0.5\"/>")),
              {1.256436, 1.31444, 1.621618});
  // Planck's law times mitsuba.cie1931_xyz(), integrated with numpy.trapezoid at 2001 wavelengths, over 106.75026,
  // then mitsuba.xyz_to_srgb(); Mitsuba's own rgb variants refuse blackbodies.
  check_close(radiance(plugin("blackbody", "<float name=\"temperature\" value=\"5000\"/>")),
              {15278.3, 12094.6, 9602.13}, 2e-3);
}

TEST_CASE("a constvolume stands for its value") {
  const Scene scene = load(
      "<medium type=\"homogeneous\"><volume name=\"albedo\" type=\"constvolume\"><rgb name=\"value\" value=\"0.1, 0.2, "
      "0.3\"/></volume><volume name=\"sigma_t\" type=\"constvolume\"><float name=\"value\" value=\"7\"/></volume>"
      "</medium>");
  CHECK(scene.media.at(0).colour("albedo") == Rgb{0.1, 0.2, 0.3});
  CHECK(scene.media[0].colour("sigma_t") == Rgb{7, 7, 7});
}

TEST_CASE("a spectrum plugin may be defined once and referred to") {
  const Scene scene = load(
      "<spectrum type=\"uniform\" id=\"grey\"><float name=\"value\" value=\"0.25\"/></spectrum>"
      "<bsdf type=\"diffuse\"><ref name=\"reflectance\" id=\"grey\"/></bsdf>");
  CHECK(scene.bsdfs[0].value("reflectance").value == Rgb{0.25, 0.25, 0.25});
}

TEST_CASE("faulty spectra are refused") {
  SceneFolder folder;
  const auto refused = [&](const std::string& element, const std::vector<std::string>& words) {
    folder.check_error("<bsdf type=\"diffuse\">\n" + element + "</bsdf>", 3, words);
  };
  refused(pairs("reflectance", "400:0.1"), {"two wavelengths"});
  refused(pairs("reflectance", "400:0.1 300:0.2"), {"wavelength 300 follows 400"});
  refused(pairs("reflectance", "400:0.1 0.2"), {"got \"0.2\"", "pairs"});
  refused(pairs("reflectance", "400:0.1:3 500:1"), {"pairs"});
  refused(pairs("reflectance", "0.1 0.2"), {"2 numbers"});
  refused("<spectrum name=\"reflectance\"/>", {"value or a filename"});
  refused("<spectrum name=\"reflectance\" filename=\"gone.spd\"/>", {"no such file \"gone.spd\""});
  refused("<spectrum name=\"reflectance\" type=\"uniform\"/>", {"no \"value\""});
  refused("<spectrum name=\"reflectance\" type=\"regula\"/>", {"unknown type \"regula\""});
}
