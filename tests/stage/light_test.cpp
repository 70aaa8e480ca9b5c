// Light sampling and connections: they change the noise, never the mean. The same paths with light met by chance alone
// are the reference; the sun is wide, so that chance meets it.
#include <catch2/catch.hpp>

#include "host_model.h"
#include "path_bench.h"
#include "runtime/scene/sky/hosek_wilkie.h"
#include "scenes.h"
#include "stage_test.h"

using namespace itn;
using namespace itn::test;

namespace {

// Starts of paths: camera rays, or flights from places in the medium, where connections matter most.
enum class Start { camera, medium };

std::vector<Rgb> samples_of(const Scene& scene, Start start, bool light_sampling, int width, Operator op,
                            int samples_a_pixel) {
  PathBench bench(device(), scene, {.op = op, .width = width, .medium_events = 64, .light_sampling = light_sampling});
  std::vector<Path> paths = bench.generate(64, samples_a_pixel);
  if (start == Start::medium)
    for (std::size_t i = 0; i < paths.size(); ++i) {
      Path& p = paths[i];
      const double k = static_cast<double>(i), z = 2 * std::fmod(0.5 + k * 0.6180339887498949, 1) - 1;
      p.direction = {std::sqrt(1 - z * z) * std::cos(2.4 * k), std::sqrt(1 - z * z) * std::sin(2.4 * k), z};
      p.position =
          along({0, 0, 0}, std::fmod(k * 0.7548776662, 0.9), unit({std::sin(k), std::cos(1.3 * k), std::sin(2.7 * k)}));
      p.origin = p.position;
      p.medium = 0;
      p.queue = Queue::medium;
    }
  bench.run_all(paths);
  std::vector<Rgb> samples;
  samples.reserve(paths.size());
  for (const Path& p : paths) samples.push_back(p.sample_radiance);
  return samples;
}

struct Mean {
  double value = 0, stderr_ = 0;
};
template <class Member>
Mean mean_of(std::size_t count, const Member& member) {
  double sum = 0, square = 0;
  for (std::size_t i = 0; i < count; ++i) {
    sum += member(i);
    square += member(i) * member(i);
  }
  const double n = static_cast<double>(count), mean = sum / n;
  return {mean, std::sqrt((square / n - mean * mean) / n)};
}

// Both images use the same random numbers, so most of the noise is the same.
void check_equal_means(const Scene& scene, Start start, Operator op = Operator::full, int samples_a_pixel = 250) {
  const std::vector<Rgb> by_chance = samples_of(scene, start, false, widths().back(), op, samples_a_pixel);
  {
    const std::vector<Rgb> sampled = samples_of(scene, start, true, 1, op, samples_a_pixel);
    for (std::size_t c = 0; c < 3; ++c) {
      const Mean mean = mean_of(by_chance.size(), [&](std::size_t i) { return by_chance[i][c]; });
      const Mean gap = mean_of(by_chance.size(), [&](std::size_t i) { return sampled[i][c] - by_chance[i][c]; });
      CAPTURE(c, mean.value, mean.stderr_, gap.value, gap.stderr_);
      CHECK(std::abs(gap.value) < 4.7 * gap.stderr_);
      CHECK(gap.stderr_ < 0.2 * mean.value);  // or the comparison says little
    }
  }
}

Scene lit_scene(const Bsdf& bsdf, double sigma_t, double aperture, double sky_scale) {
  Scene scene = sphere_scene(bsdf, medium_of(sigma_t, 0.9, 0.5));
  // All scenes share their programs: each has the materials of all, used or not, and below it a small ball whose
  // boundary is of the other kind.
  Bsdf card = bsdf_of("diffuse");
  card.set("reflectance", Rgb{0.8, 0.5, 0.2});
  card.twosided = true;
  for (const Bsdf& other : {bsdf_of("null"), bsdf_of("roughdielectric", 1.4, 0.35), card,
                            bsdf_of("roughdielectric", 1.4, 0.35, "beckmann")})
    scene.bsdfs.push_back(other);
  Shape ball = scene.shapes[0];
  ball.center = {0, 0, -2};
  ball.radius = 0.1;
  ball.bsdf = bsdf.type() == "null" ? 2 : 1;
  scene.shapes.push_back(ball);
  Sensor& sensor = scene.sensors[0];
  sensor.width = sensor.height = sensor.crop_width = sensor.crop_height = 8;
  sensor.fov_x = 28;
  sensor.filter = FilterKind::box;
  // from (0, -4, 0) along +y
  sensor.to_world.m = {1, 0, 0, 0, 0, 0, 1, -4, 0, 1, 0, 0, 0, 0, 0, 1};
  scene.environment = wide_sun(aperture, unit({0.5, 0.6, 0.5}), sky_scale);
  scene.integrator.max_depth = 12;
  scene.integrator.rr_depth = 5;
  return scene;
}

}  // namespace

TEST_CASE("connections through an index-matched boundary leave the mean") {
  for (const double sky_scale : {0.0, 1.0}) {
    CAPTURE(sky_scale);
    check_equal_means(lit_scene(bsdf_of("null"), 2, 60, sky_scale), Start::medium);
  }
}

TEST_CASE("connections through rough boundaries leave the mean") {
  for (const std::string distribution : {"ggx", "beckmann"})
    for (const double sigma_t : {distribution == "ggx" ? 5.0 : 0.3}) {
      CAPTURE(distribution, sigma_t);
      check_equal_means(lit_scene(bsdf_of("roughdielectric", 1.4, 0.35, distribution), sigma_t, 70, 0), Start::medium);
    }
}

TEST_CASE("connections through rough boundaries count for max_depth") {
  for (const int max_depth : {3}) {
    Scene scene = lit_scene(bsdf_of("roughdielectric", 1.4, 0.35), 5, 80, 0);
    scene.integrator.max_depth = max_depth;
    CAPTURE(max_depth);
    check_equal_means(scene, Start::medium);
  }
}

TEST_CASE("connections leave the mean of single scattering and of coloured sigma_t") {
  {
    INFO("single, rough");
    check_equal_means(lit_scene(bsdf_of("roughdielectric", 1.4, 0.35), 2, 80, 0), Start::medium, Operator::single);
  }
  Scene scene = lit_scene(bsdf_of("null"), 2, 80, 0.5);
  scene.media[0].set("sigma_t", Rgb{1, 2, 4});
  INFO("colours, index-matched");
  check_equal_means(scene, Start::medium);
}

TEST_CASE("light sampled at diffuse surfaces leaves the mean") {
  Scene scene = lit_scene(bsdf_of("null"), 1, 40, 0.5);
  Bsdf bsdf = bsdf_of("diffuse");
  bsdf.value("reflectance").value = {0.8, 0.5, 0.2};
  bsdf.twosided = true;
  add_floor(scene, bsdf, 3, -1.25f);
  check_equal_means(scene, Start::camera);
  scene.bsdfs[0] = bsdf_of("roughdielectric", 1.4, 0.35);
  INFO("rough sphere");
  check_equal_means(scene, Start::camera);
}

TEST_CASE("an environment map is met and sampled with weights that add up to one") {
  Scene scene = lit_scene(bsdf_of("null"), 2, 60, 0);
  Bsdf bsdf = bsdf_of("diffuse");
  add_floor(scene, bsdf, 3, -1.25f);
  auto bitmap = std::make_shared<Bitmap>();
  *bitmap = {8, 4, 3, std::vector<float>(96, 0.5f)};
  for (std::size_t c = 0; c < 3; ++c) bitmap->data[3 * 11 + c] = 4;
  Environment map = make_environment("envmap");
  map.bitmap = bitmap;
  scene.environment = map;
  check_equal_means(scene, Start::camera);
}

TEST_CASE("lamps that are drawn by place leave the mean, at surfaces and in a medium") {
  Scene scene = lit_scene(bsdf_of("null"), 1, 60, 0.2);
  add_floor(scene, bsdf_of("diffuse"), 3, -1.25f);
  // discs of different brightness above the floor, some in front of others
  for (int k = 0; k < 7; ++k) {
    Light lamp;
    lamp.become(*find_model(light_models(), "area"));
    lamp.set("radiance", Rgb{1.0 + k % 3, 2, 5.0 - k % 4});
    Shape disk;
    disk.kind = Shape::Kind::disk;
    disk.center = {-2 + 0.7 * k, 1.1 * (k % 3) - 1, -0.6 + 0.2 * (k % 2)};
    disk.edge_u = {0.6, 0, 0};
    disk.edge_v = {0, -0.6, 0};
    disk.bsdf = static_cast<int>(scene.bsdfs.size()) - 1;
    disk.light = static_cast<int>(scene.lights.size());
    scene.lights.push_back(lamp);
    scene.shapes.push_back(disk);
  }
  check_equal_means(scene, Start::camera, Operator::full, 1500);
  check_equal_means(scene, Start::medium);
}

TEST_CASE("a diffuse floor under sun and sky has the radiance of the integral") {
  Scene scene = lit_scene(bsdf_of("diffuse"), 1, 20, 1);
  scene.shapes.erase(scene.shapes.begin());
  Bsdf bsdf = bsdf_of("diffuse");
  bsdf.value("reflectance").value = {0.8, 0.5, 0.2};
  add_floor(scene, bsdf, 3, 0);
  // rows of equal cosine, columns of equal azimuth
  const ClearSky sky = clear_sky(sunsky_of(*scene.environment));
  Rgb expected{};
  constexpr int rows = 800, columns = 1600;
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < columns; ++j) {
      const double z = (i + 0.5) / rows, r = std::sqrt(1 - z * z), phi = 2 * pi * (j + 0.5) / columns;
      const Vec3 d{r * std::cos(phi), r * std::sin(phi), z};
      const Rgb a = sky_radiance(sky, d), b = sun_radiance(sky, d);
      for (std::size_t c = 0; c < 3; ++c)
        expected[c] += (a[c] + b[c]) * z * 2 / (double(rows) * columns) * bsdf.value("reflectance").value[c];
    }
  for (const int width : widths()) {
    PathBench bench(device(), scene, {.width = width, .medium_events = 64});
    std::vector<Path> paths(20000);
    for (std::size_t i = 0; i < paths.size(); ++i) {
      paths[i].pixel = static_cast<int>(i);
      paths[i].position = {0.1, 0.2, 1};
      paths[i].direction = {0, 0, -1};
      paths[i].queue = Queue::ray;
    }
    bench.run_all(paths);
    for (std::size_t c = 0; c < 3; ++c) {
      const Mean m = mean_of(paths.size(), [&](std::size_t i) { return paths[i].sample_radiance[c]; });
      CAPTURE(width, c, m.value, expected[c], m.stderr_);
      CHECK(std::abs(m.value - expected[c]) < 4.7 * m.stderr_ + 1e-3 * expected[c]);
    }
  }
}

TEST_CASE("a flight from boundary to boundary competes with no connection") {
  Scene scene = lit_scene(bsdf_of("roughdielectric", 1.4, 0.35), 2, 80, 0);
  scene.integrator.max_depth = 2;
  const auto mean = [&](bool light_sampling) {
    PathBench bench(
        device(), scene,
        {.width = light_sampling ? 1 : widths().back(), .medium_events = 64, .light_sampling = light_sampling});
    std::vector<Path> paths(20000);
    const Vec3 sun = clear_sky(sunsky_of(*scene.environment)).sun;
    for (std::size_t i = 0; i < paths.size(); ++i) {
      Path& p = paths[i];
      p.pixel = static_cast<int>(i);
      p.position = p.direction = sun;
      p.arrival = along({0, 0, 0}, 0.5, sun);  // where the flight began
      p.last_pdf = 0.5;                        // of the boundary before
      p.skip = p.hit = 0;
      p.medium = 0;
      p.queue = Queue::rough_ggx;
    }
    bench.run_all(paths);
    return mean_of(paths.size(), [&](std::size_t i) { return paths[i].sample_radiance[1]; });
  };
  const Mean sampled = mean(true), by_chance = mean(false);
  CAPTURE(sampled.value, sampled.stderr_, by_chance.value, by_chance.stderr_);
  CHECK(std::abs(sampled.value - by_chance.value) < 4.7 * std::hypot(sampled.stderr_, by_chance.stderr_));
}
