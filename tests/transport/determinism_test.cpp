// The schedule of paths must not change what they compute: bit-identical images on one device at one width; between
// widths, where float operations may round differently, equal within the standard error.
#include <algorithm>
#include <catch2/catch.hpp>

#include "../support/z_test.h"
#include "transport.h"

using namespace itn;
using namespace itn::test;

namespace {

// Every stage is used, the first scene alone uses nearly all: rough and smooth boundaries, media, diffuse surfaces,
// textures, sun and environment light.
const char* const scenes[] = {"sunsky_rough_floor", "rgb_sigma_t"};

Rendering image_of(const char* name, RenderOptions options) {
  options.spp = 24;
  if (options.seed == 0) options.seed = 6;
  return render(device(), load_scene(test_scene("mitsuba/" + std::string(name) + ".xml")), options);
}

bool identical(const Image& a, const Image& b) { return a.mean == b.mean && a.stderr_ == b.stderr_; }

// Media, boundaries, floors: what a path's score has a part from. Colours by component, sun through a rough boundary.
const std::map<std::string, std::vector<std::string>> differentiated{
    {"sunsky_rough_floor",
     {"jelly.sigma_t", "jelly.albedo.G", "hg0.g", "roughdielectric0.alpha", "roughdielectric0.int_ior"}},
    {"rgb_sigma_t", {"wax.sigma_t.R", "wax.albedo.B", "wax.scale", "hg0.g"}}};

Rendering derivatives_of(const std::string& name, RenderOptions options) {
  options.derivatives = differentiated.at(name);
  return image_of(name.c_str(), options);
}

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

// Widths: 0 is the device's own.
TEST_CASE("one lane and 4 and 16 and the device's number render the same image within the standard error",
          "[transport][stat]") {
  for (const char* name : scenes)
    for (const int width : {0, 4, 16}) {
      if (width > 0 && name != scenes[0]) continue;  // every stage is in the first scene: one program a width
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

TEST_CASE("one lane renders lights of the scene and surfaces as the device's number does", "[transport]") {
  for (const char* name : {"lights_surfaces", "anisotropic"}) {
    INFO(name);
    RenderOptions narrow, wide;
    narrow.width = 1;
    const Rendering a = image_of(name, narrow), same = image_of(name, wide);
    for (std::size_t c = 0; c < 3; ++c)
      CHECK(std::abs(a.mean_of_image[c] - same.mean_of_image[c]) < a.stderr_of_mean[c]);
  }
}

TEST_CASE("derivative images do not change a bit of the image", "[transport]") {
  for (const char* name : scenes) {
    INFO(name);
    CHECK(identical(image_of(name, {}), derivatives_of(name, {})));
  }
}

TEST_CASE("launch sizes and schedules do not change a bit of images with derivatives", "[transport]") {
  for (const char* name : scenes) {
    RenderOptions staged, small;
    staged.schedule = Schedule::staged;
    small.schedule = Schedule::fused;
    small.paths_a_launch = 1000;
    const Rendering whole = derivatives_of(name, {}), in_stages = derivatives_of(name, staged),
                    in_parts = derivatives_of(name, small);
    CHECK(identical(whole, in_stages));
    CHECK(identical(whole, in_parts));
    for (std::size_t i = 0; i < whole.derivatives.size(); ++i) {
      INFO(name << ", " << differentiated.at(name)[i]);
      CHECK(identical(whole.derivatives[i], in_stages.derivatives[i]));
      CHECK(identical(whole.derivatives[i], in_parts.derivatives[i]));
    }
  }
}

TEST_CASE("one lane and the device's number render the same derivatives within the standard error",
          "[transport][stat]") {
  for (const char* name : scenes) {
    RenderOptions narrow, wide;
    narrow.width = 1;
    const Rendering a = derivatives_of(name, narrow), same = derivatives_of(name, wide);
    wide.seed = 8;  // independent images, so that their standard errors add
    const Rendering b = derivatives_of(name, wide);
    for (std::size_t i = 0; i < a.derivatives.size(); ++i)
      for (std::size_t c = 0; c < 3; ++c) {
        INFO(name << ", " << differentiated.at(name)[i] << ", channel " << c);
        const Image &x = a.derivatives[i], &y = b.derivatives[i], &z = same.derivatives[i];
        // Channels that a component of a colour does not touch are exactly 0.
        CHECK(std::abs(x.mean_of_image[c] - y.mean_of_image[c]) <=
              4.5 * std::hypot(x.stderr_of_mean[c], y.stderr_of_mean[c]));
        CHECK(std::abs(x.mean_of_image[c] - z.mean_of_image[c]) <= x.stderr_of_mean[c]);
      }
  }
}

TEST_CASE("a derivative is the same alone and beside others, in any order", "[transport]") {
  RenderOptions all, one;
  const std::vector<std::string>& names = differentiated.at("sunsky_rough_floor");
  all.derivatives = {names.rbegin(), names.rend()};
  one.derivatives = {"hg0.g"};
  const Rendering together = image_of("sunsky_rough_floor", all), alone = image_of("sunsky_rough_floor", one);
  const auto at = static_cast<std::size_t>(std::find(names.rbegin(), names.rend(), "hg0.g") - names.rbegin());
  const Image &a = together.derivatives[at], &b = alone.derivatives[0];
  // Compilers may join the additions of one score and of several differently.
  for (std::size_t i = 0; i < a.mean.size(); ++i) CHECK(std::abs(a.mean[i] - b.mean[i]) <= 1e-3f * b.stderr_[i]);
}

TEST_CASE("the derivative of a luminance film is the luminance of the colour film's", "[transport]") {
  Scene scene = load_scene(test_scene("mitsuba/sunsky_rough_floor.xml"));
  RenderOptions options;
  options.spp = 24;
  options.derivatives = differentiated.at("sunsky_rough_floor");
  const Rendering colour = render(device(), scene, options);
  scene.sensors[0].luminance = true;
  const Rendering grey = render(device(), scene, options);
  REQUIRE(grey.channels == 1);
  for (std::size_t i = 0; i < grey.derivatives.size(); ++i) {
    const std::vector<double>& rgb = colour.derivatives[i].mean_of_image;
    const double luminance = 0.212671 * rgb[0] + 0.715160 * rgb[1] + 0.072169 * rgb[2];
    INFO(options.derivatives[i]);
    CHECK(std::abs(grey.derivatives[i].mean_of_image[0] - luminance) < 1e-4 * grey.derivatives[i].stderr_of_mean[0]);
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
