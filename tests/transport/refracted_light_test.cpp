// Lights of little extent and bright regions of pictures through rough boundaries (kernels/stage/connect.h):
// connections from scattering vertices change no mean, nor that of a derivative.
#include <catch2/catch.hpp>
#include <cmath>

#include "../support/temporary_folder.h"
#include "itn/exr.h"
#include "itn/file.h"
#include "transport.h"

using namespace itn;
using namespace itn::test;

namespace {

// Light from two directions, in a narrow beam and from a point.
constexpr const char* parallel_lights = R"(
  <emitter type="directional" id="window"><vector name="direction" x="-0.3" y="0.6" z="-0.75"/>
    <float name="irradiance" value="2"/></emitter>
  <emitter type="directional"><vector name="direction" x="0.5" y="0.6" z="0.3"/>
    <float name="irradiance" value="0.7"/></emitter>
  <emitter type="point"><point name="position" x="1" y="-3" z="2"/><float name="intensity" value="3"/></emitter>
  <shape type="disk">
    <transform name="to_world"><scale value="0.5"/>
      <lookat origin="2, -0.8, 0.5" target="0, -0.2, 0.1" up="0, 0, 1"/></transform>
    <emitter type="directionalarea" id="beam"><float name="radiance" value="8"/></emitter>
  </shape>)";

// Shapes that shine, one of them with a picture, a spot and a projector.
constexpr const char* lamps = R"(
  <shape type="sphere" id="bulb"><point name="center" x="1" y="-1.8" z="1.6"/><float name="radius" value="0.25"/>
    <emitter type="area" id="warm"><float name="radiance" value="40"/></emitter></shape>
  <shape type="rectangle">
    <transform name="to_world"><scale value="0.3"/>
      <lookat origin="-1.5, -1, 0.8" target="0, 0, 0" up="0, 0, 1"/></transform>
    <emitter type="area"><texture type="checkerboard" name="radiance">
      <float name="color0" value="5"/><float name="color1" value="30"/></texture></emitter></shape>
  <emitter type="spot"><transform name="to_world"><lookat origin="0.5, -2.5, 1.5" target="0, 0, 0.2" up="0, 0, 1"/></transform>
    <float name="intensity" value="12"/><float name="cutoff_angle" value="25"/></emitter>
  <emitter type="projector" id="slide"><transform name="to_world"><lookat origin="-2, -2, 1" target="0, 0, 0" up="0, 0, 1"/></transform>
    <float name="fov" value="40"/><texture type="checkerboard" name="irradiance">
      <float name="color0" value="1"/><float name="color1" value="8"/></texture></emitter>)";

// A dim room with a window of 11 by 13 degrees.
constexpr const char* room = R"(
  <emitter type="envmap" id="room"><string name="filename" value="room.exr"/>
    <transform name="to_world"><rotate x="1" angle="90"/></transform></emitter>)";

void write_room(const TemporaryFolder& folder) {
  constexpr int width = 32, height = 17;
  ExrImage picture{width, height, {"Y"}, std::vector<float>(width * height, 0.1F), {}};
  for (const int row : {4, 5}) picture.data[static_cast<std::size_t>(width * row + 20)] = 60;
  write_exr(folder / "room.exr", picture);
}

// A ball of wax. more: of the scene
Scene ball(const TemporaryFolder& folder, const std::string& lights, const std::string& more) {
  write_file(folder / "scene.xml", R"(<scene version="3.0.0">
  <integrator type="volpath"><integer name="max_depth" value="16"/></integrator>
  <sensor type="perspective">
    <float name="fov" value="34"/>
    <transform name="to_world"><lookat origin="0, -4, 1" target="0, 0, 0" up="0, 0, 1"/></transform>
    <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/>
      <string name="pixel_format" value="luminance"/><rfilter type="box"/></film>
  </sensor>)" + lights + R"(
  <shape type="rectangle"><transform name="to_world"><scale value="3"/><translate z="-1.1"/></transform></shape>
  <medium type="homogeneous" id="wax"><float name="sigma_t" value="3"/><float name="albedo" value="0.95"/>
    <phase type="hg"><float name="g" value="0.4"/></phase></medium>
  <shape type="sphere"><ref id="wax" name="interior"/>
    <bsdf type="roughdielectric" id="glass"><float name="alpha" value="0.5"/>
      <string name="distribution" value="ggx"/></bsdf></shape>)" +
                                       more + "</scene>");
  return load_scene(folder / "scene.xml");
}

// A medium that has an index-matched boundary, too, if only behind the camera, connects straight only.
constexpr const char* straight_only = R"(<shape type="sphere">
    <point name="center" x="0" y="-9" z="1"/><float name="radius" value="0.1"/>
    <bsdf type="null"/><ref id="wax" name="interior"/></shape>)";

// Over the pixels.
Estimate mean_of(const Image& image) {
  const auto pixels = static_cast<double>(image.mean.size());
  Estimate result;
  double variance = 0;
  for (std::size_t i = 0; i < image.mean.size(); ++i) {
    result.value += static_cast<double>(image.mean[i]) / pixels;
    variance += std::pow(static_cast<double>(image.stderr_[i]) / pixels, 2);
  }
  result.stderr_ = std::sqrt(variance);
  return result;
}

// The means of the image and of derivatives.
std::vector<Estimate> means(const Scene& scene, const std::vector<std::string>& derivatives, std::uint64_t seed) {
  RenderOptions options;
  options.spp = 1 << 15;
  options.seed = seed;
  options.derivatives = derivatives;
  const Rendering image = render(device(), scene, options);
  std::vector<Estimate> result{mean_of(image)};
  for (const Image& derivative : image.derivatives) result.push_back(mean_of(derivative));
  return result;
}

// Returns the standard error of the image with connections over that without.
double check_same(const TemporaryFolder& folder, const std::string& lights,
                  const std::vector<std::string>& derivatives) {
  const std::vector<Estimate> connected = means(ball(folder, lights, ""), derivatives, 1),
                              at_boundary = means(ball(folder, lights, straight_only), derivatives, 2);
  REQUIRE(connected.size() == 1 + derivatives.size());
  for (std::size_t k = 0; k < connected.size(); ++k) {
    const double error = std::hypot(connected[k].stderr_, at_boundary[k].stderr_);
    INFO("image " << k << ": " << connected[k].value << " +- " << connected[k].stderr_ << ", at the boundary "
                  << at_boundary[k].value << " +- " << at_boundary[k].stderr_);
    CHECK(std::abs(connected[k].value - at_boundary[k].value) < 4 * error);
    if (k != 1) CHECK(error < 0.05 * std::abs(connected[k].value));  // by sigma_t it is nearly 0
  }
  return connected[0].stderr_ / at_boundary[0].stderr_;
}

}  // namespace

TEST_CASE("parallel light through a rough boundary has the mean of paths that find it at the boundary",
          "[transport][stat]") {
  const TemporaryFolder folder;
  check_same(folder, parallel_lights,
             {"wax.sigma_t", "wax.albedo", "glass.alpha", "window.irradiance", "beam.radiance"});
}

TEST_CASE(
    "lamps, spots and projectors shine through a rough boundary as they do on paths that find them at the boundary",
    "[transport][stat]") {
  const TemporaryFolder folder;
  CHECK(check_same(folder, lamps, {"wax.sigma_t", "wax.albedo", "glass.alpha", "warm.radiance"}) < 0.7);
}

TEST_CASE("a picture's bright window shines through a rough boundary as it does to paths that find it at the boundary",
          "[transport][stat]") {
  const TemporaryFolder folder;
  write_room(folder);
  CHECK(check_same(folder, room, {"wax.sigma_t", "wax.albedo", "glass.alpha", "room.scale"}) < 0.9);
}
