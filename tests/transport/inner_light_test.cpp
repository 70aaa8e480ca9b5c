// Lights inside of bodies that refract: in the medium, and in glass without one. The light that leaves a body
// that absorbs nothing is all of the lamp's, whatever the boundary and wherever the lamp stands.
#include <catch2/catch.hpp>
#include <numbers>

#include "../support/temporary_folder.h"
#include "../support/z_test.h"
#include "itn/file.h"
#include "transport.h"

using namespace itn;
using namespace itn::test;

namespace {

constexpr double pi = std::numbers::pi, radius = 1.1;  // radius: of what measures

struct Lamp {
  const char* element;
  double flux;  // at all wavelengths alike
};

const Lamp point{
    R"(<emitter type="point"><point name="position" value="0.2, -0.1, 0.5"/><float name="intensity" value="2"/></emitter>)",
    8 * pi};
const Lamp bulb{
    R"(<shape type="sphere"><point name="center" value="-0.2, 0.3, 0.1"/><float name="radius" value="0.25"/>EXTERIOR
    <bsdf type="diffuse"><float name="reflectance" value="1"/></bsdf>
    <emitter type="area"><float name="radiance" value="3"/></emitter></shape>)",
    3 * pi * 4 * pi * 0.0625};

// A ball with a lamp inside, and all around what measures the light that leaves it.
std::string body(const std::string& boundary, bool filled, std::string lamp) {
  const std::size_t at = lamp.find("EXTERIOR");
  if (at != std::string::npos) lamp.replace(at, 8, filled ? R"(<ref id="milk" name="exterior"/>)" : "");
  return R"(<scene version="3.0.0">
  <integrator type="volpath"/>
  <medium type="homogeneous" id="milk"><float name="sigma_t" value="2"/><float name="albedo" value="1"/>
    <phase type="hg"><float name="g" value="0.3"/></phase></medium>
  <shape type="sphere">)" +
         boundary + (filled ? R"(<ref id="milk" name="interior"/>)" : "") + "</shape>" + lamp + R"(
  <shape type="sphere"><float name="radius" value=")" +
         std::to_string(radius) + R"("/><boolean name="flip_normals" value="true"/>
    <bsdf type="diffuse"><float name="reflectance" value="0"/></bsdf>
    <sensor type="irradiancemeter"><film type="hdrfilm">
      <integer name="width" value="1"/><integer name="height" value="1"/>
      <string name="pixel_format" value="luminance"/><rfilter type="box"/></film></sensor></shape>
</scene>)";
}

// Rougher glass loses more of the light that its facets reflect twice.
constexpr const char* rough = R"(<bsdf type="roughdielectric"><float name="alpha" value="0.05"/></bsdf>)";
constexpr const char* smooth = R"(<bsdf type="dielectric"/>)";

// Is what leaves all that the lamp shines? error: the most that the standard error of the share may be
void check_all_leaves(const std::string& boundary, bool filled, const Lamp& lamp, double error,
                      const std::string& more = "") {
  const TemporaryFolder folder;
  write_file(folder / "scene.xml", body(boundary, filled, lamp.element + more));
  RenderOptions options;
  options.spp = 1 << 18;
  options.seed = 3;
  const Estimate irradiance = image_mean(render(device(), load_scene(folder / "scene.xml"), options));
  const double all = lamp.flux / (4 * pi * radius * radius);
  const Estimate share{irradiance.value / all, irradiance.stderr_ / all};
  INFO(boundary << (filled ? ", filled" : "") << lamp.element << ": " << share.value << " +- " << share.stderr_);
  CHECK(std::abs(z_score(share, 1.0)) < largest_z_bound(6, 0.0027));
  CHECK(share.stderr_ < error);
}

}  // namespace

TEST_CASE("all the light of a lamp inside a body that absorbs nothing leaves it (energy)", "[transport][stat]") {
  check_all_leaves(rough, true, bulb, 0.008);
  check_all_leaves(smooth, true, bulb, 0.008);
  check_all_leaves(rough, false, bulb, 0.008);
  // of a point, near which a medium is as bright as one likes, and which sharp glass shows in few directions
  check_all_leaves(rough, true, point, 0.1);
  check_all_leaves(rough, false, point, 0.1);
}

TEST_CASE("a lamp inside a body keeps its light where others are sampled through the boundary (energy)",
          "[transport][stat]") {
  check_all_leaves(rough, true, bulb, 0.008, R"(<emitter type="directional">
    <vector name="direction" value="0, 0, -1"/><float name="irradiance" value="1e-6"/></emitter>)");
}
