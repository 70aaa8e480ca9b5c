// A scene that is saved is the scene that was seen, wherever it is put.
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>

#include "itn/error.h"
#include "itn/save_scene.h"
#include "tests/scene/scene_folder.h"

using namespace itn;

namespace {

std::vector<double> values_of(const std::vector<Parameter>& parameters) {
  std::vector<double> values;
  for (const Parameter& p : parameters) values.push_back(p.value);
  return values;
}

// Another value in the parameter's range.
double other_value(const Parameter& p) {
  if (!std::isfinite(p.high)) return p.value + 0.3;
  return p.value + (p.value < (p.low + p.high) / 2 ? 1 : -1) * std::min(0.01 * (p.high - p.low), 0.1);
}

// All parameters moved, saved, and read from another folder.
void check_saved(const std::string& file, const std::map<std::string, std::string>& definitions = {}) {
  INFO(file);
  const Scene scene = load_scene(file, definitions);
  const std::vector<Parameter> parameters = list_parameters(scene);
  std::vector<double> values = values_of(parameters);
  for (std::size_t i = 0; i < values.size(); ++i)
    if (!std::isnan(values[i])) values[i] = other_value(parameters[i]);
  SceneFolder elsewhere;
  elsewhere.write("saved.xml", scene_text(file, definitions, {}, parameters, values));
  const Scene saved = load_scene(elsewhere.path("saved.xml"));
  const std::vector<Parameter> there = list_parameters(saved);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (std::isnan(values[i])) continue;
    INFO(parameters[i].name);
    CHECK(find_parameter(there, parameters[i].name).value == Approx(values[i]).epsilon(1e-9));
  }
  CHECK(saved.shapes.size() == scene.shapes.size());
  CHECK(saved.sensors[0].to_world.m == scene.sensors[0].to_world.m);
  CHECK(saved.warnings.size() == scene.warnings.size());
}

}  // namespace

TEST_CASE("every scene of the gallery can be saved with other values and read from another folder") {
  for (const auto& entry : std::filesystem::directory_iterator(ITN_SOURCE_DIR "/scenes/gallery"))
    if (entry.path().extension() == ".xml") check_saved(entry.path().string());
}

TEST_CASE("definitions, defaults and includes are written out") {
  SceneFolder folder;
  folder.write("part.xml",
               "<scene version=\"3.0.0\"><bsdf type=\"diffuse\" id=\"paint\"><rgb name=\"reflectance\" "
               "value=\"$colour\"/></bsdf></scene>");
  folder.write("scene.xml",
               "<scene version=\"3.0.0\"><default name=\"colour\" value=\"0.1, 0.2, 0.3\"/>\n"
               "<include filename=\"part.xml\"/><!-- a note --><sensor type=\"perspective\"/>\n"
               "<emitter type=\"constant\" id=\"a &lt;&quot;\\$b\"/>\n"
               "<shape type=\"sphere\"><ref id=\"paint\"/></shape></scene>");
  check_saved(folder.path("scene.xml"));
  check_saved(folder.path("scene.xml"), {{"colour", "0.7, 0.6, 0.5"}});
}

TEST_CASE("a metal keeps its name until its numbers change") {
  SceneFolder folder;
  const Scene scene = folder.load(
      "<shape type=\"sphere\"><bsdf type=\"roughconductor\" id=\"metal\"><string name=\"material\" value=\"Au\"/>"
      "</bsdf></shape>");
  const std::vector<Parameter> parameters = list_parameters(scene);
  const std::string same = scene_text(scene.file, {}, {}, parameters, values_of(parameters));
  CHECK_THAT(same, Catch::Contains("value=\"Au\""));
  check_saved(scene.file);
}

TEST_CASE("values of tables and weights that stand in one text are found there") {
  SceneFolder folder;
  folder.load(
      "<medium type=\"homogeneous\" id=\"fog\"><phase type=\"tabphase\" id=\"table\"><string name=\"values\" "
      "value=\"0.5, 1, 2\"/></phase></medium><shape type=\"sphere\"><bsdf type=\"null\"/><ref name=\"interior\" "
      "id=\"fog\"/></shape>");
  check_saved(folder.path("scene.xml"));
}

TEST_CASE("constants inside of volumes are changed there") {
  SceneFolder folder;
  folder.load(
      "<shape type=\"cube\"><bsdf type=\"null\"/><medium name=\"interior\" type=\"heterogeneous\" id=\"fog\">"
      "<volume name=\"sigma_t\" type=\"constvolume\"><float name=\"value\" value=\"2\"/></volume>"
      "<volume name=\"albedo\" type=\"constvolume\"><rgb name=\"value\" value=\"0.3, 0.6, 0.9\"/></volume>"
      "</medium></shape>");
  check_saved(folder.path("scene.xml"));
}

TEST_CASE("a scene that has been changed so that it cannot be read again is not saved") {
  SceneFolder folder;
  const Scene scene = folder.load("<shape type=\"sphere\"><bsdf type=\"diffuse\" id=\"paint\"/></shape>");
  std::vector<Parameter> parameters = list_parameters(scene);
  std::vector<double> values = values_of(parameters);
  REQUIRE(parameters[0].name == "paint.reflectance");
  parameters[0].id = "other";
  values[0] = 0.25;
  CHECK_THROWS_AS(scene_text(scene.file, {}, {}, parameters, values), UsageError);
}
