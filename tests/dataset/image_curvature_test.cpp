// The curvature of an image's loss says what errors of its material are worth in the image.
#include "runtime/dataset/image_curvature.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <numeric>

#include "runtime/base/error.h"
#include "runtime/dataset/dataset_mesh.h"
#include "runtime/dataset/rendered_loss.h"
#include "runtime/dataset/shape_buffers.h"
#include "tests/support/egg_set.h"

using namespace itn;

namespace {

struct Egg : EggSet {
  Device device;
  std::vector<double> mask;
  const DatasetMaterial material{5, 0.8, 0.3};

  Egg() {
    set.images.resize(1);
    set.mm_per_unit = 2;
    mask = shape_buffers(dataset_scene(set, dataset_mesh(set.shapes[0], folder / "")), 0, 1).mask;
  }
  ImageCurvature curvature(RenderedLoss& renderer, std::uint64_t seed, int spp) const {
    const std::vector<Rendering> halves =
        renderer.render_derivatives({{&set.images[0], material, seed, nullptr}}, 2, spp);
    return image_curvature(halves[0], halves[1], material.sigma_t, mask);
  }
  RenderedLoss renderer() const { return {device, set, folder / "", Operator::full, nullptr}; }
};

double quadratic(const ImageCurvature& c, const std::array<double, 3>& u) {
  return c[0] * u[0] * u[0] + c[3] * u[1] * u[1] + c[5] * u[2] * u[2] +
         2 * (c[1] * u[0] * u[1] + c[2] * u[0] * u[2] + c[4] * u[1] * u[2]);
}

struct Mean {
  double value = 0, error = 0;
};

Mean mean_of(const std::vector<double>& values) {
  const auto n = static_cast<double>(values.size());
  Mean mean;
  for (const double v : values) mean.value += v / n;
  for (const double v : values) mean.error += std::pow(v - mean.value, 2);
  mean.error = std::sqrt(mean.error / (n * (n - 1)));
  return mean;
}

}  // namespace

TEST_CASE("the curvature is by how much images of neighbouring materials differ") {
  const Egg egg;
  RenderedLoss renderer = egg.renderer();
  constexpr int times = 16, spp = 512;
  std::vector<ImageCurvature> curvatures;
  for (std::uint64_t i = 0; i < times; ++i) curvatures.push_back(egg.curvature(renderer, 1 + i, spp));
  for (const std::array<double, 3>& u :
       {std::array{0.1, 0.0, 0.0}, {0.0, 0.02, 0.0}, {0.0, 0.0, 0.2}, {0.1, 0.02, -0.2}}) {
    DatasetMaterial more = egg.material, less = egg.material;
    for (auto* m : {&more, &less}) {
      const double sign = m == &more ? 1 : -1;
      m->sigma_t *= std::exp(sign * u[0]);
      m->albedo += sign * u[1];
      m->g += sign * u[2];
    }
    // Common random numbers make a difference; products are of different ones, so that their noise is not squared.
    std::vector<RerenderedImage> images;
    for (std::uint64_t seed = 100; seed < 100 + 2 * times; ++seed)
      for (const DatasetMaterial& material : {more, less})
        images.push_back({&egg.set.images[0], material, seed, nullptr});
    const std::vector<Rendering> renderings = renderer.render(images, spp);
    const auto difference = [&](std::size_t i, std::size_t pixel) {
      return (double{renderings[2 * i].mean[pixel]} - renderings[2 * i + 1].mean[pixel]) / 2;
    };
    std::vector<double> expected, found;
    for (std::size_t i = 0; i < times; ++i) {
      expected.push_back(quadratic(curvatures[i], u));
      double sum = 0, count = 0;
      for (std::size_t pixel = 0; pixel < egg.mask.size(); ++pixel) {
        sum += egg.mask[pixel] * difference(2 * i, pixel) * difference(2 * i + 1, pixel);
        count += egg.mask[pixel];
      }
      found.push_back(sum / count);
    }
    const Mean a = mean_of(expected), b = mean_of(found);
    CAPTURE(u, a.value, a.error, b.value, b.error);
    // 4 standard errors; what is of fourth order is some hundredths.
    CHECK(std::abs(a.value - b.value) < 4 * std::hypot(a.error, b.error) + 0.04 * a.value);
    CHECK(a.value > 8 * std::hypot(a.error, b.error));  // or nothing would have been checked
  }
}

TEST_CASE("few samples and many give a curvature of the same mean") {
  const Egg egg;
  RenderedLoss renderer = egg.renderer();
  constexpr int times = 64;
  std::vector<ImageCurvature> few(times), many(8);
  for (int i = 0; i < times; ++i) few[static_cast<std::size_t>(i)] = egg.curvature(renderer, 1000U + i, 16);
  for (int i = 0; i < 8; ++i) many[static_cast<std::size_t>(i)] = egg.curvature(renderer, 5000U + i, 1024);
  for (std::size_t entry = 0; entry < 6; ++entry) {
    const auto of_all = [&](const std::vector<ImageCurvature>& all) {
      std::vector<double> values;
      for (const ImageCurvature& c : all) values.push_back(c[entry]);
      return mean_of(values);
    };
    const Mean a = of_all(few), b = of_all(many);
    CAPTURE(entry, a.value, a.error, b.value, b.error);
    CHECK(std::abs(a.value - b.value) < 3.5 * std::hypot(a.error, b.error));
    CHECK(b.error < a.error / 2);
  }
}

TEST_CASE("a curvature is read as it was written; other texts are refused") {
  const ImageCurvature curvature{1.0 / 3, -2e-9, 5, 1e20, 0, -7};
  CHECK(read_curvature(to_text(curvature), "a.exr") == curvature);
  for (const char* text : {"", "[1,2,3,4,5]", "[1,2,3,4,5,null]", "{}", "[1,2,3,4,5,6", "[1,2,3,4,5,1e999]"})
    CHECK_THROWS_WITH(read_curvature(text, "a.exr"), Catch::Contains("a.exr: its attribute curvature is"));
}
