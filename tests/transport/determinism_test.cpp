// What schedules paths must not change what they compute: bit-identical images on one device at one width; between
// widths, where float operations may round differently, equal within the standard error.
#include <catch2/catch.hpp>

#include "../support/z_test.h"
#include "transport.h"

using namespace itn;
using namespace itn::test;

namespace {

// Every stage is used: rough and smooth boundaries, media, diffuse surfaces, textures, sun and environment light.
const char* const scenes[] = {"sunsky_rough_floor", "camera_inside", "rgb_sigma_t"};

Rendering image_of(const char* name, RenderOptions options) {
  options.spp = 24;
  if (options.seed == 0) options.seed = 6;
  return render(device(), load_scene(test_scene("mitsuba/" + std::string(name) + ".xml")), options);
}

bool identical(const Rendering& a, const Rendering& b) { return a.mean == b.mean && a.stderr_ == b.stderr_; }

}  // namespace

TEST_CASE("the same seed renders the same bits, another seed does not", "[transport]") {
  for (const char* name : scenes) {
    INFO(name);
    const Rendering first = image_of(name, {});
    CHECK(identical(first, image_of(name, {})));
    RenderOptions other;
    other.seed = 7;
    CHECK_FALSE(first.mean == image_of(name, other).mean);
  }
}

TEST_CASE("launches of any size render the same bits", "[transport]") {
  for (const char* name : scenes) {
    INFO(name);
    const Rendering whole = image_of(name, {});
    // 24 x 24 pixels x 24 samples are 13,824 paths.
    for (const int paths : {1 << 20, 4096, 1000}) {
      INFO(paths << " paths a launch");
      RenderOptions options;
      options.paths_a_launch = paths;
      CHECK(identical(whole, image_of(name, options)));
    }
  }
}

TEST_CASE("fused and staged schedules render the same bits", "[transport]") {
  for (const char* name : scenes) {
    INFO(name);
    RenderOptions fused, staged;
    fused.schedule = Schedule::fused;
    staged.schedule = Schedule::staged;
    CHECK(identical(image_of(name, fused), image_of(name, staged)));
  }
}

TEST_CASE("one lane and 4, 8 and 16 render the same image within the standard error", "[transport][stat]") {
  for (const char* name : scenes)
    for (const int width : {4, 8, 16}) {
      INFO(name << ", width " << width);
      RenderOptions narrow, wide;
      narrow.width = 1;
      wide.width = width;
      wide.seed = 8;  // independent images, so that their standard errors add
      const Rendering a = image_of(name, narrow), b = image_of(name, wide);
      for (std::size_t c = 0; c < 3; ++c) {
        const double difference = a.mean_of_image[c] - b.mean_of_image[c];
        CHECK(std::abs(difference) < 4.5 * std::hypot(a.stderr_of_mean[c], b.stderr_of_mean[c]));
      }
      // With one seed the paths are the same but for rounding: far closer than the noise.
      wide.seed = 0;
      const Rendering same = image_of(name, wide);
      for (std::size_t c = 0; c < 3; ++c)
        CHECK(std::abs(a.mean_of_image[c] - same.mean_of_image[c]) < a.stderr_of_mean[c]);
    }
}

TEST_CASE("the standard error tells the spread of images of independent seeds", "[transport][stat]") {
  // The spread of 40 image means over the stated one: chi-square with 39 degrees of freedom.
  const Scene scene = load_scene(test_scene("mitsuba/rough_ggx.xml"));
  constexpr int images = 40;
  double sum = 0, square = 0, stated = 0;
  for (int k = 0; k < images; ++k) {
    RenderOptions options;
    options.spp = 16;
    options.seed = 100 + static_cast<std::uint64_t>(k);
    const Rendering image = render(device(), scene, options);
    sum += image.mean_of_image[0];
    square += image.mean_of_image[0] * image.mean_of_image[0];
    stated += image.stderr_of_mean[0] * image.stderr_of_mean[0] / images;
  }
  const double spread = square - sum * sum / images;
  const double p = chi_square_tail(spread / stated, images - 1);
  INFO("spread / stated variance " << spread / stated / (images - 1) << ", p " << p);
  CHECK(p > 1e-5);
  CHECK(p < 1 - 1e-5);
}
