// Gradients by the pixels of an environment map (kernels/light/emission.h) against differences of single pixels with
// common random numbers, and against the derivative by its scale.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "../support/temporary_folder.h"
#include "itn/exr.h"
#include "itn/file.h"
#include "itn/parameters.h"
#include "runtime/scene/volume/volume_file.h"
#include "weighed.h"

using namespace itn;
using namespace itn::test;

namespace {

constexpr std::size_t width = 5, height = 4;

// Between the pixels of columns 2 and 3 and rows 1 and 2 lies a cell that no light is sampled from.
float sky(std::size_t i) {
  const std::size_t column = i / 3 % width, row = i / (3 * width);
  const bool black = (column == 2 || column == 3) && (row == 1 || row == 2);
  return black ? 0.0F : 0.2F + 0.15F * static_cast<float>(i * 7 % 11);
}

// Seen by 16 x 8 pixels, which see the sky itself, too. No path ends by chance.
Scene under_a_sky(const TemporaryFolder& folder, const std::string& shapes) {
  std::vector<float> pixels(3 * width * height);
  for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = sky(i);
  write_exr(folder / "sky.exr", {static_cast<int>(width), static_cast<int>(height), {"R", "G", "B"}, pixels, {}});
  write_file(folder / "scene.xml", R"(<scene version="3.0.0">
  <integrator type="volpath"><integer name="max_depth" value="5"/><integer name="rr_depth" value="100"/></integrator>
  <sensor type="perspective">
    <float name="fov" value="60"/>
    <transform name="to_world"><lookat origin="0.5, -3.5, 1" target="0, 0, 0" up="0, 0, 1"/></transform>
    <film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="8"/>
      <rfilter type="box"/></film>
  </sensor>
  <emitter type="envmap" id="sky"><string name="filename" value="sky.exr"/><float name="scale" value="0.8"/>
    <transform name="to_world"><rotate x="1" angle="80"/><rotate z="1" angle="33"/></transform></emitter>)" +
                                       shapes + "</scene>");
  return load_scene(folder / "scene.xml");
}

// A cloud, half of which is empty, onto which the same picture is thrown.
Scene cloud(const TemporaryFolder& folder) {
  VoxelGrid grid;
  grid.width = 2;
  grid.height = grid.depth = 1;
  grid.data = {0, 3};
  write_volume_file(folder / "cloud.vol", grid);
  return under_a_sky(folder, R"(<emitter type="projector" id="slide"><float name="fov" value="50"/>
      <transform name="to_world"><lookat origin="0.5, -0.5, 3.5" target="0, 0, 0" up="0, 1, 0"/></transform>
      <texture type="bitmap" name="irradiance"><boolean name="raw" value="true"/>
        <string name="filename" value="sky.exr"/></texture></emitter>
    <shape type="cube"><bsdf type="null"/>
    <medium type="heterogeneous" name="interior" id="smoke"><rgb name="albedo" value="0.9, 0.8, 0.7"/>
      <volume type="gridvolume" name="sigma_t"><string name="filename" value="cloud.vol"/>
        <transform name="to_world"><scale value="2"/><translate x="-1" y="-1" z="-1"/></transform></volume>
      <phase type="hg"><float name="g" value="0.3"/></phase></medium></shape>)");
}

// A matt floor, and a ball of rough metal.
Scene ball(const TemporaryFolder& folder) {
  return under_a_sky(folder, R"(<shape type="rectangle"><transform name="to_world"><translate z="-1"/></transform>
      <bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="0.3, 0.5, 0.6"/></bsdf></bsdf></shape>
    <shape type="sphere"><bsdf type="roughconductor"><string name="material" value="Cu"/>
      <string name="distribution" value="ggx"/><float name="alpha" value="0.3"/></bsdf></shape>)");
}

RenderOptions by(const std::vector<std::string>& parameters) {
  RenderOptions options = one_lane();
  options.seed = 5;
  options.derivatives = parameters;
  return options;
}

// One value raised, and light sampled as before: what is drawn has no part in the derivative.
Scene raised(const Scene& scene, const std::string& name, std::size_t value, double by) {
  const Parameter p = find_parameter(list_parameters(scene), name);
  Bitmap pixels = texels_of(scene, p);
  pixels.data[value] += static_cast<float>(by);
  Scene result = scene;
  set_texels(result, p, pixels);
  result.environment->sampled_as = std::make_shared<Environment>(*scene.environment);
  return result;
}

// The contribution of all pixels of the picture, which is linear in them.
double brought(const VoxelGrid& by_pixels) {
  double sum = 0;
  for (std::size_t i = 0; i < by_pixels.data.size(); ++i)
    sum += static_cast<double>(by_pixels.data[i]) * static_cast<double>(sky(i));
  return sum;
}

}  // namespace

TEST_CASE("the gradient by a pixel of an environment map, or of a lamp, is its difference beside voxels, too",
          "[derivative]") {
  const TemporaryFolder folder;
  const Scene scene = cloud(folder);
  const RenderOptions options = by({"smoke.sigma_t", "sky.data", "slide.irradiance"});
  constexpr int spp = 32;
  const WeighedDerivatives result = gradient(scene, options, spp);
  const VoxelGrid& pixels = result.values[1];
  REQUIRE(pixels.width == width);
  REQUIRE(pixels.height == height);
  REQUIRE(pixels.data.size() == 3 * width * height);
  CHECK(sum_of(pixels) == Approx(result.value[1]).epsilon(1e-5));
  const double before = weighed(scene, options, spp);
  CHECK(brought(pixels) + brought(result.values[2]) == Approx(before).epsilon(1e-5));
  // the first and the last column meet; those of black pixels
  for (const std::size_t pixel : {0U, 4U, 7U, 9U, 12U, 13U, 16U, 19U}) {
    const std::size_t value = 3 * pixel + pixel % 3;
    INFO("pixel " << pixel);
    CHECK(static_cast<double>(pixels.data[value]) ==
          Approx(weighed(raised(scene, "sky.data", value, 1), options, spp) - before)
              .epsilon(1e-3)
              .margin(1e-5 * before));
  }
  const double of_lamp = weighed(raised(scene, "slide.irradiance", 21, 1), options, spp) - before;
  CHECK(static_cast<double>(result.values[2].data[21]) == Approx(of_lamp).epsilon(1e-3));
  CHECK(of_lamp > 1e-5 * before);
}

TEST_CASE("pixels of an environment map times their gradients are the derivative by its scale", "[derivative]") {
  const TemporaryFolder folder;
  const Scene scene = ball(folder);
  const RenderOptions options = by({"sky.scale", "sky.data"});
  const WeighedDerivatives result = gradient(scene, options, 16);
  CHECK(brought(result.values[1]) == Approx(0.8 * result.value[0]).epsilon(1e-5));
  CHECK(brought(result.values[1]) == Approx(weighed(scene, options, 16)).epsilon(1e-5));
  CHECK(sum_of(result.values[1]) == Approx(result.value[1]).epsilon(1e-5));
  // launches and schedules change no bit
  RenderOptions small = options, staged = options;
  small.paths_a_launch = 777;
  staged.schedule = Schedule::staged;
  for (const RenderOptions& way : {options, small, staged})
    CHECK(gradient(scene, way, 16).values[1].data == result.values[1].data);
}

TEST_CASE("so they are of a bright window that shines into wax through a rough boundary", "[derivative]") {
  const TemporaryFolder folder;
  Scene scene = under_a_sky(folder, R"(<shape type="sphere"><bsdf type="roughdielectric">
      <string name="distribution" value="ggx"/><float name="alpha" value="0.4"/></bsdf>
    <medium type="homogeneous" name="interior"><rgb name="sigma_t" value="3, 4, 5"/><rgb name="albedo" value="0.9, 0.8, 0.7"/>
      <phase type="hg"><float name="g" value="0.3"/></phase></medium></shape>)");
  constexpr std::size_t window = 3 * 6;  // red of pixel 6
  for (std::size_t c = 0; c < 3; ++c) scene = raised(scene, "sky.data", window + c, 40);
  scene.environment->sampled_as = nullptr;
  const RenderOptions options = by({"sky.scale", "sky.data"});
  const WeighedDerivatives result = gradient(scene, options, 16);
  const double before = weighed(scene, options, 16);
  double brought = 0;
  for (std::size_t i = 0; i < result.values[1].data.size(); ++i)
    brought += static_cast<double>(result.values[1].data[i]) * static_cast<double>(scene.environment->bitmap->data[i]);
  CHECK(brought == Approx(0.8 * result.value[0]).epsilon(1e-5));
  CHECK(brought == Approx(before).epsilon(1e-5));
  for (const std::size_t value : {window, window + 1, std::size_t{0}, std::size_t{29}})
    CHECK(
        static_cast<double>(result.values[1].data[value]) ==
        Approx(weighed(raised(scene, "sky.data", value, 1), options, 16) - before).epsilon(1e-3).margin(1e-5 * before));
  RenderOptions staged = options;
  staged.schedule = Schedule::staged;
  CHECK(gradient(scene, staged, 16).values[1].data == result.values[1].data);
}

// The choice of the direction that is connected depends on what the directions bring, and so on the pixels, beyond the
// densities: the two agree on average.
TEST_CASE("the gradient by a pixel of an environment map has the mean of differences at surfaces", "[.texels]") {
  const TemporaryFolder folder;
  const Scene scene = ball(folder);
  constexpr int seeds = 32, spp = 256;
  const std::vector<std::size_t> values{1, 13, 23, 29, 38, 40, 46, 58};
  std::vector<double> mean(values.size()), lack(values.size()), square(values.size());
  for (int seed = 1; seed <= seeds; ++seed) {
    RenderOptions options = by({"sky.data"});
    options.width = 0;
    options.seed = static_cast<std::uint64_t>(seed);
    const std::vector<float> pixels = gradient(scene, options, spp).values[0].data;
    const double before = weighed(scene, options, spp);
    for (std::size_t k = 0; k < values.size(); ++k) {
      const auto value = static_cast<double>(pixels[values[k]]);
      const double difference = value - (weighed(raised(scene, "sky.data", values[k], 1), options, spp) - before);
      mean[k] += value / seeds;
      lack[k] += difference / seeds;
      square[k] += difference * difference / seeds;
    }
  }
  const double largest = *std::max_element(mean.begin(), mean.end());
  for (std::size_t k = 0; k < values.size(); ++k) {
    const double error = std::sqrt((square[k] - lack[k] * lack[k]) / (seeds - 1));
    INFO("value " << values[k] << ": " << mean[k] << " lacks " << lack[k] << " +- " << error);
    CHECK(std::abs(lack[k]) < 3.5 * error);
    CHECK(error < 0.01 * largest);
  }
}
