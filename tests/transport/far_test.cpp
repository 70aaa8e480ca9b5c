// Only size over distance counts: the same scene far from the origin, or in another unit, has the same image and the
// same derivatives.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <sstream>

#include "../support/temporary_folder.h"
#include "../support/z_test.h"
#include "itn/file.h"
#include "transport.h"

using namespace itn;
using namespace itn::test;

namespace {

constexpr double significance = 1e-4;

std::string text_of(double value) {
  std::ostringstream out;
  out.precision(17);
  out << value;
  return out.str();
}

// x: where the scene stands; unit: what a length of 1 is there; distance, fov: of the camera.
Scene load(const TemporaryFolder& folder, const std::string& content, double x, double unit, double distance = 8,
           double fov = 30) {
  std::string text = R"(<scene version="3.0.0"><integrator type="volpath"/>
<sensor type="perspective"><float name="fov" value="$fov"/><float name="near_clip" value="$near"/><float name="far_clip" value="$far"/>
  <transform name="to_world"><lookat origin="0,0,-$distance" target="0,0,0" up="0,1,0"/><translate x="$x"/></transform>
  <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/><rfilter type="box"/></film></sensor>
)" + content + "</scene>";
  write_file(folder / "scene.xml", text);
  Definitions definitions{{"x", text_of(x)},
                          {"distance", text_of(distance * unit)},
                          {"fov", text_of(fov)},
                          {"near", text_of(1e-3 * unit)},
                          {"far", text_of(100 * distance * unit)}};
  for (const auto& [name, value] : Definitions{{"unit", text_of(unit)}, {"sigma_t", text_of(2 / unit)}})
    if (content.find('$' + name) != std::string::npos) definitions[name] = value;
  return load_scene(folder / "scene.xml", definitions);
}

const std::string furnace = R"(<emitter type="constant"/>
<shape type="sphere"><transform name="to_world"><translate x="-1.2"/><scale value="$unit"/><translate x="$x"/></transform>
  <bsdf type="dielectric"/></shape>
<shape type="cube"><transform name="to_world"><rotate y="1" angle="30"/><translate x="1.4"/><scale value="$unit"/><translate x="$x"/></transform>
  <bsdf type="null"/><medium type="homogeneous" name="interior"><float name="sigma_t" value="$sigma_t"/>
  <float name="albedo" value="1"/></medium></shape>)";

const std::string lit = R"(
<shape type="sphere"><transform name="to_world"><translate x="-1.2"/><scale value="$unit"/><translate x="$x"/></transform>
  <bsdf type="roughdielectric"><float name="alpha" value="0.3"/></bsdf>
  <medium type="homogeneous" id="m" name="interior"><float name="sigma_t" value="$sigma_t"/><float name="albedo" value="0.8"/></medium></shape>
<shape type="cube"><transform name="to_world"><rotate y="1" angle="30"/><translate x="1.4"/><scale value="$unit"/><translate x="$x"/></transform>
  <bsdf type="roughdielectric"><float name="alpha" value="0.3"/></bsdf><ref id="m" name="interior"/></shape>
<shape type="rectangle"><transform name="to_world"><scale value="4"/><rotate x="1" angle="90"/><translate y="5"/><scale value="$unit"/><translate x="$x"/></transform>
  <emitter type="area"/></shape>
<shape type="rectangle"><transform name="to_world"><scale value="9"/><rotate x="1" angle="-90"/><translate y="-1.5"/><scale value="$unit"/><translate x="$x"/></transform></shape>)";

RenderOptions options_of(int spp, std::uint64_t seed) {
  RenderOptions options = one_lane();
  options.spp = spp;
  options.seed = seed;
  return options;
}

Estimate mean_of(const Image& image) { return {image.mean_of_image[0], image.stderr_of_mean[0]}; }

void check_same(const Estimate& a, const Estimate& b, std::size_t tests) {
  INFO(a.value << " +- " << a.stderr_ << ", " << b.value << " +- " << b.stderr_);
  CHECK(a.stderr_ > 0);
  CHECK(std::abs(a.value - b.value) < largest_z_bound(tests, significance) * std::hypot(a.stderr_, b.stderr_));
}

}  // namespace

TEST_CASE("a white furnace of glass and a medium is white wherever it stands, in any unit", "[transport][stat]") {
  const TemporaryFolder folder;
  for (const auto& [x, unit] :
       {std::pair{0.0, 1.0}, {1e3, 1.0}, {-1e6, 1.0}, {1e9, 1.0}, {0.0, 1e-6}, {0.0, 1e6}, {1.0, 1e-6}, {9e11, 1e6}}) {
    INFO("at " << x << " in units of " << unit);
    const Scene scene = load(folder, furnace, x, unit);
    CHECK(scene.warnings.empty());
    const Rendering image = render(device(), scene, options_of(64, 3));
    for (const float pixel : image.mean) CHECK(pixel == Approx(1).margin(2e-5));
    CHECK(image.misplaced == 0);
  }
}

TEST_CASE("image and derivatives are the same wherever the scene stands, in any unit (z-test)", "[derivative][stat]") {
  const TemporaryFolder folder;
  const auto render_at = [&](double x, double unit, std::uint64_t seed) {
    RenderOptions options = options_of(1024, seed);
    options.derivatives = {"m.sigma_t", "m.albedo"};
    return render(device(), load(folder, lit, x, unit), options);
  };
  const Rendering here = render_at(0, 1, 11);
  constexpr std::size_t tests = 5 * 3;
  std::uint64_t seed = 12;
  for (const auto& [x, unit] : {std::pair{1e3, 1.0}, {1e6, 1.0}, {-1e9, 1.0}, {0.0, 1e-6}, {0.0, 1e6}}) {
    INFO("at " << x << " in units of " << unit);
    const Rendering there = render_at(x, unit, seed++);
    check_same(mean_of(here), mean_of(there), tests);
    Estimate by_sigma_t = mean_of(there.derivatives[0]);  // per unit: 1 / length
    by_sigma_t.value /= unit;
    by_sigma_t.stderr_ /= unit;
    check_same(mean_of(here.derivatives[0]), by_sigma_t, tests);
    check_same(mean_of(here.derivatives[1]), mean_of(there.derivatives[1]), tests);
  }
}

TEST_CASE("a camera far away sees as sharply as one that is near", "[transport][stat]") {
  const TemporaryFolder folder;
  const auto seen_from = [&](double distance, const std::string& content, int spp, std::uint64_t seed) {
    const double fov = 2 * std::atan(2.5 / distance) * 180 / 3.141592653589793;
    return render(device(), load(folder, content, 0, 1, distance, fov), options_of(spp, seed));
  };
  Scene parallel = load(folder, lit, 0, 1, 20);
  parallel.sensors[0].kind = Sensor::Kind::orthographic;
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t column = 0; column < 2; ++column) parallel.sensors[0].to_world.m[4 * row + column] *= 2.5;
  const Rendering near = render(device(), parallel, options_of(4096, 5)), far = seen_from(1e7, lit, 4096, 6);
  double largest = 0;
  for (std::size_t i = 0; i < near.mean.size(); ++i) {
    const double difference = std::abs(static_cast<double>(near.mean[i]) - static_cast<double>(far.mean[i])),
                 e = std::hypot(static_cast<double>(near.stderr_[i]), static_cast<double>(far.stderr_[i]));
    largest = std::max(largest, difference / std::max(e, 1e-6));
  }
  CHECK(largest < largest_z_bound(near.mean.size(), significance));
  for (const float pixel : seen_from(1e7, furnace, 64, 3).mean) CHECK(pixel == Approx(1).margin(2e-5));
}
