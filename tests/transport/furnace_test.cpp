// White furnaces: nothing absorbs, the light is 1 everywhere, so every pixel is 1 (scenes/test/furnace_*.xml).
#include <catch2/catch.hpp>

#include "../support/temporary_folder.h"
#include "../support/z_test.h"
#include "itn/file.h"
#include "transport.h"

using namespace itn;
using namespace itn::test;

namespace {

void check_furnace(const std::string& scene_name, const char* sigma_t, const char* g) {
  INFO(scene_name << ", sigma_t " << sigma_t << ", g " << g);
  // Roulette would only add noise where no light is lost.
  const Scene scene = load_scene(test_scene(scene_name), {{"sigma_t", sigma_t}, {"g", g}, {"rr_depth", "1000000"}});
  RenderOptions options;
  options.spp = 64;
  options.seed = 2;
  const Rendering image = render(device(), scene, options);
  double largest = 0;
  for (std::size_t i = 0; i < image.mean.size(); ++i)
    largest = std::max(largest, std::abs(z_score({image.mean[i], image.stderr_[i]}, 1.0)));
  // Four standard errors, shared over the pixels of all scenes; RGB channels are alike.
  CHECK(largest < largest_z_bound(18 * 16 * 16, 6.3e-5 * 16));
  CHECK(image.mean_of_image[0] == Approx(1.0).epsilon(0.0005));
}

}  // namespace

TEST_CASE("an albedo-1 medium in unit light has radiance 1 in every pixel (white furnace)", "[transport][stat]") {
  for (const char* scene : {"furnace_matched.xml", "furnace_dielectric.xml"})
    for (const char* sigma_t : {"0.1", "10", "1000"})
      for (const char* g : {"-0.5", "0", "0.9"}) check_furnace(scene, sigma_t, g);
}

TEST_CASE("200 mean free paths deep the white furnace is white, and the standard error says how well that is known",
          "[transport][stat]") {
  const TemporaryFolder folder;
  write_file(folder / "deep.xml", R"(<scene version="3.0.0">
  <integrator type="volpath"/>
  <medium type="homogeneous" id="milk">
    <float name="sigma_t" value="200"/><float name="albedo" value="1"/><phase type="isotropic"/>
  </medium>
  <sensor type="perspective">
    <film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="4"/><rfilter type="box"/></film>
    <ref id="milk"/>
  </sensor>
  <emitter type="constant"/>
  <shape type="sphere"><bsdf type="null"/><ref id="milk" name="interior"/></shape>
</scene>)");
  RenderOptions options = one_lane();
  options.spp = 64;
  options.seed = 4;
  const Rendering image = render(device(), load_scene(folder / "deep.xml"), options);
  CHECK(image.endless == 0);
  CHECK(std::abs(z_score(image_mean(image), 1.0)) < 4);
  // One path in 16 or so comes out of 20,000 scatterings, with a throughput of 16.
  CHECK(image_mean(image).stderr_ > 0.08);
  CHECK(image_mean(image).stderr_ < 0.2);
}

TEST_CASE("in a medium too dense for flights to move, paths are counted as endless and none is lost without a word",
          "[transport]") {
  RenderOptions options = one_lane();
  options.spp = 4;
  options.seed = 4;
  const Scene scene = load_scene(test_scene("furnace_matched.xml"), {{"sigma_t", "1e10"}});
  const Rendering image = render(device(), scene, options);
  const auto paths = static_cast<double>(image.paths);
  CHECK(image.endless > 0);
  CHECK(image.endless < image.paths);
  CHECK(image.mean_of_image[0] * paths + static_cast<double>(image.endless) == Approx(paths).epsilon(1e-6));
}

TEST_CASE("Russian roulette leaves the white furnace white", "[transport][stat]") {
  for (const char* name : {"furnace_matched.xml", "furnace_dielectric.xml"}) {
    INFO(name);
    const Scene scene = load_scene(test_scene(name), {{"sigma_t", "2"}, {"g", "0"}, {"rr_depth", "2"}});
    RenderOptions options;
    options.spp = 1024;
    options.seed = 3;
    CHECK(std::abs(z_score(image_mean(render(device(), scene, options)), 1.0)) < 4);
  }
}
