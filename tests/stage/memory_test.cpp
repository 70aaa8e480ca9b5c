// Device memory too small: smaller launches, fewer paths in flight, the image in bands; the same bits. What stages may
// read beyond the numbers of the last model.
#include <catch2/catch.hpp>

#include "itn/error.h"
#include "itn/renderer.h"
#include "runtime/render/compile/launch_data.h"
#include "runtime/render/wavefront/launch_buffers.h"
#include "scenes.h"
#include "stage_test.h"

using namespace itn;
using namespace itn::test;

namespace {

// The memory that cannot shrink [byte].
std::uint64_t scene_bytes(const Scene& scene) {
  LaunchData data;
  data.geometry.box_width = 16;
  append_scene(scene, 0, data);
  const auto bytes = [](const auto& v) { return v.size() * sizeof(v[0]); };
  const Geometry& g = data.geometry;
  return bytes(g.nodes) + bytes(g.leaves) + bytes(g.primitives) + bytes(g.grid) + bytes(g.records) +
         bytes(data.light_tables) + bytes(data.texels);
}

}  // namespace

TEST_CASE("an image that does not fit into the device's memory is rendered in parts, to the same bits") {
  Scene scene = sphere_scene(bsdf_of("roughdielectric", 1.4, 0.3), medium_of(2, 0.9, 0.5));
  Sensor& sensor = scene.sensors[0];
  sensor.width = sensor.crop_width = 120;  // 9,600 pixels of 48 bytes: several bands where 450,000 bytes are free
  sensor.height = sensor.crop_height = 80;
  sensor.to_world.m = {1, 0, 0, 0, 0, 0, 1, -4, 0, 1, 0, 0, 0, 0, 0, 1};
  scene.environment = wide_sun(40, {0.6, 0, 0.8}, 1);
  const std::uint64_t fixed = scene_bytes(scene);
  RenderOptions options;
  options.spp = 3;
  const Rendering roomy = render(device(), scene, options);
  for (const Schedule schedule : {Schedule::fused, Schedule::staged}) {
    CAPTURE(fixed, schedule == Schedule::fused);
    options.schedule = schedule;
    const Rendering tight = render(Device("", fixed + 450000), scene, options);
    CHECK((tight.mean == roomy.mean && tight.stderr_ == roomy.stderr_ && tight.mean_of_image == roomy.mean_of_image &&
           tight.stderr_of_mean == roomy.stderr_of_mean));
    for (const std::uint64_t limit : {fixed + 100000, fixed / 2, std::uint64_t{1000}}) {
      CAPTURE(limit);
      CHECK_THROWS_WITH(render(Device("", limit), scene, options), Catch::Contains("no room for"));
      CHECK_THROWS_AS(render(Device("", limit), scene, options), DeviceError);
    }
  }
}

TEST_CASE("derivatives in little memory have the same bits, their baselines too") {
  Scene scene = sphere_scene(bsdf_of("roughdielectric", 1.4, 0.3), medium_of(2, 0.9, 0.5));
  scene.media[0].id = "medium";
  Sensor& sensor = scene.sensors[0];
  sensor.width = sensor.crop_width = 60;
  sensor.height = sensor.crop_height = 40;
  sensor.to_world.m = {1, 0, 0, 0, 0, 0, 1, -4, 0, 1, 0, 0, 0, 0, 0, 1};
  RenderOptions options;
  options.spp = 3;
  options.derivatives = {"medium.sigma_t"};
  options.baselines = Baselines::on;
  const Rendering roomy = render(device(), scene, options);
  const Rendering tight = render(Device("", scene_bytes(scene) + 2000000), scene, options);  // pilots of 200 paths
  CHECK(tight.derivatives[0].mean == roomy.derivatives[0].mean);
}

TEST_CASE("behind the last model's numbers, where stages read a whole model's, no texture stands for any") {
  LaunchData data;
  data.geometry.box_width = 16;
  append_scene(sphere_scene(bsdf_of("roughdielectric", 1.4, 0.3), medium_of(2, 0.9, 0.5)), 0, data);
  LaunchBuffers buffers;
  buffers.upload_scenes(device(), data);
  const auto count = [](const cl::Buffer& buffer) { return buffer.getInfo<CL_MEM_SIZE>() / sizeof(int); };
  const std::size_t room = count(buffers.numbers);
  CHECK(room > data.numbers.size());
  REQUIRE(count(buffers.number_textures) >= room);
  std::vector<int> textures(room);
  device().download(buffers.number_textures, textures);
  for (std::size_t i = data.numbers.size(); i < room; ++i) CHECK(textures[i] == -1);
}
