// Images against Mitsuba 3: scenes/test/mitsuba/*.xml, references (mean and standard error) beside them, rendered by
// make_references.py. Per scene and channel: the z-scores of the pixels are standard normal, none is too large, and the
// image's mean agrees. Where both standard errors vanish (the plain background) the values must be equal.
// Where few samples carry most of a pixel's light (edges), a sample may miss them and with them its own variance: the
// test of the largest score takes the reference's variance a sample, known from many more, where that is larger.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdio>
#include <filesystem>
#include <vector>

#include "../support/z_test.h"
#include "itn/exr.h"
#include "transport.h"

using namespace itn;
using namespace itn::test;

namespace {

struct MitsubaScene {
  const char* name;
  int spp;
};

// Samples enough for a pixel's mean to be near normal; more where few paths carry most of the light.
const std::vector<MitsubaScene> scenes = {
    {"anisotropic", 4096},
    {"beams", 2048},
    {"bent_normals", 2048},
    {"blends", 1024},
    {"camera_inside", 1024},
    {"cylinder_instances", 1024},
    {"dielectric_constant", 1024},
    {"distant", 65536},
    {"fog_open", 4096},
    {"glass", 1024},
    {"grid_null", 1024},
    {"grid_phase", 4096},
    {"grid_rgb", 2048},
    {"grid_rough", 2048},
    {"irradiancemeter", 65536},
    {"lights_inside", 4096},
    {"lights_medium", 4096},
    {"lights_rough", 2048},
    {"lights_textured", 1024},
    {"masks", 2048},
    {"max_depth_null", 1024},
    {"mesh_attribute", 1024},
    {"metal_textures", 1024},
    {"mirrors", 1024},
    {"mixtures", 4096},
    {"null_constant", 1024},
    {"opaque_neighbours", 1024},
    {"orthographic", 1024},
    {"plastics", 1024},
    {"principled_lights", 4096},
    {"rayleigh", 1024},
    {"rgb_sigma_t_null", 2048},
    {"rough_conductor", 1024},
    {"rough_ggx", 1024},
    {"rough_shading_normals", 1024},
    {"rough_textures", 1024},
    {"sunsky_rough_floor", 2048},
    {"tabulated", 4096},
    {"thinlens", 1024},
    {"volume_textures", 1024},
};

// Other scenes above have the features of these, too, in other company.
const std::vector<MitsubaScene> more_scenes = {
    {"checkerboard", 1024}, {"grid_inside", 1024}, {"hide_emitters", 1024},  {"lights_surfaces", 1024},
    {"max_depth", 1024},    {"nested", 1024},      {"null_envmap", 1024},    {"principled", 2048},
    {"rgb_albedo", 1024},   {"rgb_sigma_t", 1024}, {"rough_beckmann", 1024}, {"sunsky_null_floor", 2048},
};

const std::size_t tests_of_means = 3 * (scenes.size() + more_scenes.size());
// The significance of the whole file, for each of the three kinds of test.
constexpr double significance = 0.0027;  // that of three standard errors

void save_z(const std::string& name, const Rendering& ours, const ExrImage& reference, const std::vector<float>& z) {
  ExrImage image;
  image.width = ours.width;
  image.height = ours.height;
  image.channels = {"B", "G", "R", "mitsuba.B", "mitsuba.G", "mitsuba.R", "z.B", "z.G", "z.R"};
  const int reference_channel[] = {reference.channel("B"), reference.channel("G"), reference.channel("R")};
  for (int pixel = 0; pixel < ours.width * ours.height; ++pixel) {
    for (int c = 2; c >= 0; --c) image.data.push_back(ours.mean[static_cast<std::size_t>(3 * pixel + c)]);
    for (const int c : reference_channel)
      image.data.push_back(
          reference.data[static_cast<std::size_t>(pixel) * reference.channels.size() + static_cast<std::size_t>(c)]);
    for (int c = 2; c >= 0; --c) image.data.push_back(z[static_cast<std::size_t>(3 * pixel + c)]);
  }
  const std::string path = (std::filesystem::current_path() / ("z_" + name + ".exr")).string();
  write_exr(path, image);
  WARN("images and z-scores of the failed scene are in " << path);
}

void compare(const MitsubaScene& entry) {
  const std::string name = entry.name;
  const Scene scene = load_scene(test_scene("mitsuba/" + name + ".xml"));
  RenderOptions options;
  options.spp = entry.spp;
  options.seed = 1;
  const Rendering ours = render(device(), scene, options);
  const ExrImage reference = read_exr(test_scene("mitsuba/" + name + ".exr"));
  REQUIRE(ours.width == reference.width);
  REQUIRE(ours.height == reference.height);
  REQUIRE(ours.channels == 3);

  int passes = 0, reference_spp = 0;
  REQUIRE(std::sscanf(reference.header.at("comments").c_str(), "%*[^,], %*[^,], %d passes of %d spp", &passes,
                      &reference_spp) == 2);
  const double sample_ratio = static_cast<double>(passes) * reference_spp / entry.spp;

  const auto pixels = static_cast<std::size_t>(ours.width) * static_cast<std::size_t>(ours.height);
  std::vector<float> z_image(3 * pixels, 0.0F);
  bool passed = true;
  for (std::size_t c = 0; c < 3; ++c) {
    const std::string letter(1, "RGB"[c]);
    INFO("channel " << letter);
    const auto mean_channel = static_cast<std::size_t>(reference.channel(letter));
    const auto stderr_channel = static_cast<std::size_t>(reference.channel("stderr." + letter));
    std::vector<double> z;
    double our_sum = 0, reference_sum = 0, reference_variance = 0, our_variance = 0, largest = 0;
    std::size_t unequal = 0;
    for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
      const double value = ours.mean[3 * pixel + c], error = ours.stderr_[3 * pixel + c];
      const double expected = reference.data[pixel * reference.channels.size() + mean_channel];
      const double expected_error = reference.data[pixel * reference.channels.size() + stderr_channel];
      our_sum += value;
      our_variance += error * error;
      reference_sum += expected;
      reference_variance += expected_error * expected_error;
      const double spread = std::sqrt(error * error + expected_error * expected_error);
      if (spread < 1e-5 * std::abs(expected) || (expected == 0 && spread == 0)) {
        if (std::abs(value - expected) > 1e-4 * std::abs(expected)) ++unequal;
        continue;
      }
      z.push_back((value - expected) / spread);
      z_image[3 * pixel + c] = static_cast<float>(z.back());
      const double known_error = std::max(error, expected_error * std::sqrt(sample_ratio));
      largest = std::max(largest, std::abs(value - expected) / std::hypot(known_error, expected_error));
    }
    const ZHistogram histogram = z_histogram(z);
    const double z_mean = (our_sum - reference_sum) / std::sqrt(our_variance + reference_variance);
    const auto count = static_cast<double>(pixels);
    std::printf("%-24s %6d %3s %10.6f %10.6f %7.2f %9.2f %9.2g\n", name.c_str(), entry.spp, letter.c_str(),
                our_sum / count, reference_sum / count, z_mean, largest, histogram.p_value);
    const double mean_bound = largest_z_bound(tests_of_means, significance);
    const double pixel_bound = largest_z_bound(tests_of_means * pixels, significance);
    CHECK(unequal == 0);
    CHECK(std::abs(z_mean) < mean_bound);
    CHECK(largest < pixel_bound);
    CHECK(histogram.p_value > significance / static_cast<double>(tests_of_means));
    passed = passed && unequal == 0 && std::abs(z_mean) < mean_bound && largest < pixel_bound &&
             histogram.p_value > significance / static_cast<double>(tests_of_means);
  }
  if (!passed) save_z(name, ours, reference, z_image);
}

void print_header() {
  static bool printed = false;
  if (!printed)
    std::printf("%-24s %6s %3s %10s %10s %7s %9s %9s\n", "scene", "spp", "", "mean", "Mitsuba", "z mean", "max |z|",
                "p chi2");
  printed = true;
}

}  // namespace

// One section a scene: test_transport "pixels*" -c glass
TEST_CASE("pixels and image means agree with Mitsuba 3 within their standard errors (z-test)", "[transport][stat]") {
  print_header();
  for (const MitsubaScene& entry : scenes) SECTION(entry.name) {
      compare(entry);
    }
}

TEST_CASE("pixels and image means of more scenes agree with Mitsuba 3 (z-test)", "[.mitsuba]") {
  print_header();
  for (const MitsubaScene& entry : more_scenes) SECTION(entry.name) {
      compare(entry);
    }
}
