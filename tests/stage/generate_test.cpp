// Stage generate: camera rays, one by one, and the filters' distributions.
#include <algorithm>
#include <catch2/catch.hpp>

#include "host_model.h"
#include "path_bench.h"
#include "scenes.h"
#include "stage_test.h"

using namespace itn;
using namespace itn::test;

namespace {

Scene camera_scene(FilterKind filter, bool orthographic) {
  Scene scene = sphere_scene(bsdf_of("null"), medium_of(1, 0.5, 0));
  Sensor& sensor = scene.sensors[0];
  sensor.kind = orthographic ? Sensor::Kind::orthographic : Sensor::Kind::perspective;
  sensor.fov_x = 50;
  sensor.width = 20;
  sensor.height = 14;
  sensor.crop_x = 3;
  sensor.crop_y = 2;
  sensor.crop_width = 7;
  sensor.crop_height = 5;
  sensor.near_clip = 0.25;
  sensor.filter = filter;
  sensor.filter_radius = 1.5;
  sensor.filter_stddev = 0.7;
  sensor.sample_border = true;
  // columns: +x of the camera (left on the film), +y (up), +z (the view), where it stands; scaled by 2
  sensor.to_world.m = {0, 2, 0, 5, 0, 0, 2, 6, 2, 0, 0, 7, 0, 0, 0, 1};
  return scene;
}

// The film position that a ray in camera space passed through.
Vec2 film_position(const Sensor& s, const Path& p) {
  const Vec3 o{(p.position[2] - 7) / 2, (p.position[0] - 5) / 2, (p.position[1] - 6) / 2};
  const Vec3 d{p.direction[2], p.direction[0], p.direction[1]};
  const double aspect = static_cast<double>(s.height) / s.width;
  double left = o[0], up = o[1];
  if (s.kind == Sensor::Kind::perspective) {
    const double scale = std::tan(s.fov_x / 2 * pi / 180);
    left = d[0] / d[2] / scale;
    up = d[1] / d[2] / scale;
  }
  return {(1 - left) / 2 * s.width, (1 - up / aspect) / 2 * s.height};
}

// Probability of an offset below x.
double filter_cdf(FilterKind filter, double x) {
  if (filter == FilterKind::box) return std::clamp(x + 0.5, 0.0, 1.0);
  if (filter == FilterKind::tent) {
    const double t = std::clamp(x / 1.5, -1.0, 1.0);
    return t < 0 ? (1 + t) * (1 + t) / 2 : 1 - (1 - t) * (1 - t) / 2;
  }
  return 0.5 * std::erfc(-x / 0.7 / std::sqrt(2));
}

}  // namespace

TEST_CASE("camera rays pass through their pixel's part of the film") {
  for (const int width : widths())
    for (const bool orthographic : {false, true})
      for (const FilterKind filter : {FilterKind::box, FilterKind::tent, FilterKind::gaussian}) {
        const Scene scene = camera_scene(filter, orthographic);
        const Sensor& sensor = scene.sensors[0];
        PathBench bench(device(), scene, {.width = width});
        constexpr int samples = 300;
        const std::vector<Path> paths = bench.generate(35, samples);
        std::vector<double> across, down;
        double outside = 0, direction_error = 0, place_error = 0;
        std::size_t wrong = 0;
        std::vector<int> count(35 * samples, 0);
        for (const Path& p : paths) {
          if (p.pixel < 0 || p.pixel >= 35 || p.sample < 0 || p.sample >= samples) {
            ++wrong;
            continue;
          }
          ++count[static_cast<std::size_t>(p.pixel * samples + p.sample)];
          wrong += p.queue != Queue::ray || p.event != 1 || p.depth != 0 || p.medium != -1 || p.skip != -1 ||
                   p.refraction_scale != 1 || p.throughput != Rgb{1, 1, 1} || p.radiance != Rgb{} || p.last_pdf != 0;
          const Vec2 film = film_position(sensor, p);
          const double dx = film[0] - (3 + p.pixel % 7 + 0.5), dy = film[1] - (2 + p.pixel / 7 + 0.5);
          across.push_back(dx);
          down.push_back(dy);
          const double reach = filter == FilterKind::box ? 0.5 : filter == FilterKind::tent ? 1.5 : 4 * 0.7;
          outside = std::max({outside, std::abs(dx) - reach, std::abs(dy) - reach});
          direction_error = std::max(direction_error, std::abs(length(p.direction) - 1));
          // rays start on the near plane
          place_error = std::max(place_error, std::abs((p.position[1] - 6) / 2 - 0.25));
          if (!orthographic)
            place_error =
                std::max(place_error, std::abs((p.position[0] - 5) / 2 - 0.25 * p.direction[0] / p.direction[1]));
          if (orthographic) place_error = std::max(place_error, distance(p.direction, {0, 1, 0}));
        }
        CAPTURE(width, orthographic, filter);
        CHECK(wrong == 0);
        CHECK(std::all_of(count.begin(), count.end(), [](int c) { return c == 1; }));
        CHECK(outside < 2e-4);
        CHECK(direction_error < 2e-7);
        CHECK(place_error < 1e-6);
        for (const std::vector<double>* offsets : {&across, &down}) {
          const double d = largest_gap(*offsets, [&](double x) { return filter_cdf(filter, x); });
          CHECK(d < kolmogorov_bound(offsets->size()));
        }
        // independent: no correlation between the two offsets
        double product = 0, square_x = 0, square_y = 0;
        for (std::size_t i = 0; i < across.size(); ++i) {
          product += across[i] * down[i];
          square_x += across[i] * across[i];
          square_y += down[i] * down[i];
        }
        CHECK(std::abs(product) / std::sqrt(square_x * square_y) < 4.9 / std::sqrt(double(across.size())));
      }
}

TEST_CASE("rays of an opencv camera go to points that it shows in their pixels") {
  for (const int width : widths()) {
    Scene scene = camera_scene(FilterKind::box, false);
    Sensor& sensor = scene.sensors[0];
    // fx 21, fy 19, cx 8.7, cy 7.1 pixels
    sensor.fov_x = 2 * std::atan(10 / 21.0) * 180 / pi;
    sensor.pixel_aspect = 21 / 19.0;
    sensor.principal_x = 0.5 - 9.2 / 20;
    sensor.principal_y = 0.5 - 7.6 / 14;
    const double k1 = -0.3, k2 = 0.08, k3 = 0.02, k4 = 0.05, k5 = -0.02, k6 = 0.01, p1 = 0.004, p2 = -0.006;
    sensor.distortion = {k1, k2, k3, k4, k5, k6, p1, p2};
    std::vector<double> across, down;
    for (const Path& p : PathBench(device(), scene, {.width = width}).generate(35, 300)) {
      const double x = -p.direction[2] / p.direction[1], y = -p.direction[0] / p.direction[1], r2 = x * x + y * y;
      const double radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)));
      const double film_x = 21 * (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + 8.7;
      const double film_y = 19 * (y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y) + 7.1;
      across.push_back(film_x - (3 + p.pixel % 7));
      down.push_back(film_y - (2 + p.pixel / 7));
    }
    CAPTURE(width);
    for (const std::vector<double>* offsets : {&across, &down}) {
      CHECK(*std::max_element(offsets->begin(), offsets->end()) < 0.5002);
      CHECK(*std::min_element(offsets->begin(), offsets->end()) > -0.5002);
      const double d = largest_gap(*offsets, [](double x) { return filter_cdf(FilterKind::box, x); });
      CHECK(d < kolmogorov_bound(offsets->size()));
    }
  }
}

TEST_CASE("positions of pixels at the film's edges stay on the film, spread as the filter that is cut there") {
  for (const int width : widths())
    for (const FilterKind filter : {FilterKind::tent, FilterKind::gaussian}) {
      Scene scene = camera_scene(filter, true);
      scene.sensors[0].sample_border = false;
      PathBench bench(device(), scene, {.width = width});
      constexpr int samples = 2000;
      // columns and rows of the crop of 7 x 5 pixels, which begins at (3, 2)
      std::array<std::vector<double>, 7> across;
      std::array<std::vector<double>, 5> down;
      double outside = 0;
      for (const Path& p : bench.generate(35, samples)) {
        const Vec2 film = film_position(scene.sensors[0], p);
        outside = std::max({outside, 3 - film[0], film[0] - 10, 2 - film[1], film[1] - 7});
        const auto column = static_cast<std::size_t>(p.pixel % 7), row = static_cast<std::size_t>(p.pixel / 7);
        across[column].push_back(film[0] - (3.5 + static_cast<double>(column)));
        down[row].push_back(film[1] - (2.5 + static_cast<double>(row)));
      }
      CAPTURE(width, filter);
      CHECK(outside < 2e-5);
      const auto check = [&](const std::vector<double>& offsets, double low, double high) {
        const double least = filter_cdf(filter, low), all = filter_cdf(filter, high) - least;
        const double d = largest_gap(offsets, [&](double x) { return (filter_cdf(filter, x) - least) / all; });
        CHECK(d < kolmogorov_bound(offsets.size()));
      };
      for (std::size_t column = 0; column < 7; ++column)
        check(across[column], -0.5 - static_cast<double>(column), 6.5 - static_cast<double>(column));
      for (std::size_t row = 0; row < 5; ++row)
        check(down[row], -0.5 - static_cast<double>(row), 4.5 - static_cast<double>(row));
    }
}

TEST_CASE("a camera in a medium starts its paths there") {
  for (const int width : widths()) {
    Scene scene = camera_scene(FilterKind::box, false);
    scene.sensors[0].medium = 0;
    PathBench bench(device(), scene, {.width = width});
    for (const Path& p : bench.generate(35)) {
      REQUIRE(p.medium == 0);
      REQUIRE(p.queue == Queue::medium);
    }
  }
}

TEST_CASE("heroes are drawn uniformly from the channels where sigma_t has colours") {
  Scene scene = camera_scene(FilterKind::box, false);
  scene.media[0].set("sigma_t", Rgb{1, 2, 3});
  for (const int width : widths()) {
    PathBench bench(device(), scene, {.width = width});
    std::array<double, 3> count{};
    const std::vector<Path> paths = bench.generate(35, 100);
    for (const Path& p : paths) {
      REQUIRE(p.hero >= 0);
      REQUIRE(p.hero < 3);
      REQUIRE(p.spectral_weight == Rgb{1, 1, 1});
      REQUIRE(p.hero == static_cast<int>(bench.random(p, 0, -1)[2] * 3));
      ++count[static_cast<std::size_t>(p.hero)];
    }
    for (const double c : count) CHECK(std::abs(c - 3500.0 / 3) < 4.5 * std::sqrt(3500.0 * 2 / 9));
  }
}
