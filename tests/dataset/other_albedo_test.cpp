// Images of the same paths with other albedos of the medium.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "itn/error.h"
#include "network/dataset/dataset_scene.h"
#include "runtime/render/batch_renderer.h"
#include "runtime/scene/shapes/polygonise.h"
#include "tests/support/z_test.h"

using namespace itn;
using namespace itn::test;

namespace {

const Device& device() {
  static const Device the_device;
  return the_device;
}

Manifest set_of(bool colours_and_rough) {
  Manifest set;
  set.size = 16;
  set.in_colours = set.boundary.rough = colours_and_rough;
  set.boundary.alpha = 0.3;
  set.boundary.int_ior = 1.4;
  return set;
}

Scene scene_of(const Manifest& set, const Rgb& albedo) {
  static const auto ring = std::make_shared<const Mesh>(shape_mesh(torus(1, 0.4), 800));
  DatasetMaterial material{40, albedo[0], 0.5, {}};
  if (set.in_colours) material.colours = {{10, 30, 90}, albedo};
  return dataset_scene(set, ring, sun_and_sky(sun_direction(30, 30)), material);
}

Rendering rendering_of(const Scene& scene, const std::vector<Rgb>& others, std::uint64_t seed, int spp,
                       const RenderOptions& options = {}) {
  BatchRenderer renderer(device(), options);
  const int geometry = renderer.add_geometry(renderer.geometry_of(scene));
  return renderer.render({{&scene, geometry, seed, 0, others}}, spp).front();
}

// The z-scores of all pixels that vary, and of the means over the image.
std::vector<double> z_scores(const Image& a, const Image& b) {
  std::vector<double> z;
  for (std::size_t i = 0; i < a.mean.size(); ++i)
    if (const double error = std::hypot(a.stderr_[i], b.stderr_[i]); error > 0)
      z.push_back((a.mean[i] - b.mean[i]) / error);
  for (std::size_t c = 0; c < a.mean_of_image.size(); ++c)
    z.push_back((a.mean_of_image[c] - b.mean_of_image[c]) / std::hypot(a.stderr_of_mean[c], b.stderr_of_mean[c]));
  return z;
}

}  // namespace

TEST_CASE("with another albedo the same paths show what paths of their own do") {
  const Manifest set = set_of(GENERATE(false, true));
  const Rgb own{0.95, 0.9, 0.8};
  std::vector<Rgb> others{{0.9, 0.9, 0.8}, {0.6, 0.3, 0.75}, {0.3, 0.5, 0.1}, {0, 0, 0}};
  if (set.in_colours)
    others.back() = {0.02, 0.1, 0.05};
  else
    for (Rgb& other : others) other = {other[0], other[0], other[0]};
  constexpr int spp = 256;
  const Rendering image = rendering_of(scene_of(set, own), others, 1, spp);
  REQUIRE(image.other_albedos.size() == others.size());
  constexpr double significance = 1e-4;
  for (std::size_t k = 0; k < others.size(); ++k) {
    CAPTURE(set.in_colours, k);
    // By the same program, where there is something that others can be times.
    const Image direct =
        rendering_of(scene_of(set, others[k]), others[k][0] > 0 ? others : std::vector<Rgb>{}, 2 + k, spp);
    const std::vector<double> z = z_scores(image.other_albedos[k], direct);
    const auto large = [](double a, double b) { return std::abs(a) < std::abs(b); };
    CHECK(std::abs(*std::max_element(z.begin(), z.end(), large)) < largest_z_bound(z.size(), significance));
    CHECK(z_histogram(z).p_value > significance);
    // As quiet as paths of their own.
    for (std::size_t c = 0; c < direct.stderr_of_mean.size(); ++c)
      CHECK(image.other_albedos[k].stderr_of_mean[c] < 1.1 * direct.stderr_of_mean[c]);
  }
}

TEST_CASE("with its own albedo it is the image, and near it the image and its derivative") {
  const Manifest set = set_of(false);
  const double albedo = 0.9, step = 1e-3;
  RenderOptions options;
  options.derivatives = {dataset_albedo};
  options.width = 1;  // as on GPUs
  const auto grey = [](double value) { return Rgb{value, value, value}; };
  const Rendering image = rendering_of(scene_of(set, grey(albedo)),
                                       {grey(albedo), grey(albedo - step), grey(albedo + step)}, 3, 16, options);
  CHECK(image.other_albedos[0].mean == image.mean);
  CHECK(image.other_albedos[0].stderr_ == image.stderr_);
  double error = 0, size = 0;
  for (std::size_t i = 0; i < image.mean.size(); ++i) {
    const double slope = (image.other_albedos[2].mean[i] - image.other_albedos[1].mean[i]) / (2 * step),
                 derivative = image.derivatives[0].mean[i];
    error = std::max(error, std::abs(slope - derivative));
    size = std::max(size, std::abs(derivative));
  }
  CHECK(error < 1e-3 * size);
}

TEST_CASE("other albedos need a medium that scatters, one, and as many in all scenes of a batch") {
  const Manifest set = set_of(false);
  const Scene black = scene_of(set, {0, 0, 0}), white = scene_of(set, {0.9, 0.9, 0.9});
  CHECK_THROWS_AS(rendering_of(black, {{0.5, 0.5, 0.5}}, 0, 2), UsageError);
  Scene without = white;
  without.media.clear();
  without.shapes[1].interior = -1;
  CHECK_THROWS_AS(rendering_of(without, {{0.5, 0.5, 0.5}}, 0, 2), UsageError);
  BatchRenderer renderer(device(), {});
  const int geometry = renderer.add_geometry(renderer.geometry_of(white));
  CHECK_THROWS_AS(renderer.render({{&white, geometry, 0, 0, {{0.5, 0.5, 0.5}}}, {&white, geometry, 1, 0, {}}}, 2),
                  UsageError);
}
