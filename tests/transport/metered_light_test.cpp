// Lights without extent on a sensor that lies on a surface: straight through an index-matched slab, where what is not
// scattered falls off as exp(-optical depth), and together with what is scattered as in data/transport.json.
#include <catch2/catch.hpp>
#include <cmath>

#include "../support/temporary_folder.h"
#include "../support/z_test.h"
#include "itn/file.h"
#include "transport.h"

using namespace itn;
using namespace itn::test;

namespace {

// A slab of thickness 1 about z = 0, and a disk below it that measures.
std::string slab(const std::string& albedo, const std::string& lights, const std::string& integrator = "") {
  return R"(<scene version="3.0.0">
  <integrator type="volpath">)" +
         integrator + R"(</integrator>
  <shape type="cube"><transform name="to_world"><scale x="40" y="40" z="0.5"/></transform>
    <bsdf type="null"/>
    <medium type="homogeneous" name="interior" id="milk"><float name="sigma_t" value="2"/><float name="albedo" value=")" +
         albedo + R"("/><phase type="hg"><float name="g" value="0.75"/></phase></medium></shape>
  <shape type="disk"><transform name="to_world"><scale value="0.001"/><translate z="-0.6"/></transform>
    <bsdf type="diffuse"><float name="reflectance" value="0"/></bsdf>
    <sensor type="irradiancemeter"><film type="hdrfilm">
      <integer name="width" value="1"/><integer name="height" value="1"/>
      <string name="pixel_format" value="luminance"/><rfilter type="box"/></film></sensor></shape>)" +
         lights + "</scene>";
}

Rendering measure(const std::string& text, int spp, const std::vector<std::string>& derivatives = {}) {
  const TemporaryFolder folder;
  write_file(folder / "scene.xml", text);
  RenderOptions options = one_lane();
  options.spp = spp;
  options.seed = 5;
  options.derivatives = derivatives;
  return render(device(), load_scene(folder / "scene.xml"), options);
}

const std::string from_above =
    R"(<emitter type="directional"><vector name="direction" value="0, 0, -1"/><float name="irradiance" value="1"/></emitter>)";

}  // namespace

TEST_CASE("what a slab does not scatter of a beam falls on a detector behind it as exp(-optical depth) says",
          "[transport][stat]") {
  const Rendering image = measure(slab("0", from_above), 1024, {"milk.sigma_t"});
  // A surface is as sharp as 2^-21 of its largest coordinate (runtime/render/compile/geometry.cpp), which is 40: with
  // sigma_t 2 that is an optical depth of 3.8e-5.
  CHECK(image.mean_of_image[0] == Approx(std::exp(-2.0)).epsilon(4e-5));
  CHECK(image.derivatives[0].mean_of_image[0] == Approx(-std::exp(-2.0)).epsilon(4e-5));
  // A detector does not see light that is hidden, nor any where paths have no length.
  for (const char* hidden :
       {R"(<boolean name="hide_emitters" value="true"/>)", R"(<integer name="max_depth" value="0"/>)"})
    CHECK(measure(slab("0", from_above, hidden), 64).mean_of_image[0] == 0);
}

TEST_CASE("a detector behind a slab measures its transmittance of parallel light (van de Hulst: 0.66096)",
          "[transport][stat]") {
  const Estimate transmittance = image_mean(measure(slab("0.9", from_above), 1 << 18));
  INFO(transmittance.value << " +- " << transmittance.stderr_);
  CHECK(std::abs(z_score(transmittance, 0.6609577002)) < 4);
  CHECK(transmittance.stderr_ < 0.004);
}

TEST_CASE("lights without extent all shine on a detector, each from its place", "[transport][stat]") {
  // 60 degrees from the normal; a point, a spot and a beam above the detector
  const std::string lights =
      R"(<emitter type="directional"><vector name="direction" value="0.8660254, 0, -0.5"/><float name="irradiance" value="3"/></emitter>
  <emitter type="point"><point name="position" value="0, 0, 2"/><float name="intensity" value="5"/></emitter>
  <emitter type="spot"><transform name="to_world"><lookat origin="0, 0, 2.1" target="0, 0, 0" up="1, 0, 0"/></transform>
    <float name="intensity" value="7"/></emitter>
  <shape type="disk"><transform name="to_world"><rotate x="1" angle="180"/><translate z="2.2"/></transform>
    <emitter type="directionalarea"><float name="radiance" value="2"/></emitter></shape>)";
  const double straight = 5 / (2.6 * 2.6) + 7 / (2.7 * 2.7) + 2;
  const Estimate irradiance = image_mean(measure(slab("0", lights), 1 << 14));
  INFO(irradiance.value << " +- " << irradiance.stderr_);
  CHECK(std::abs(z_score(irradiance, 3 * 0.5 * std::exp(-4.0) + straight * std::exp(-2.0))) < 4);
  CHECK(irradiance.stderr_ < 0.01);
}
