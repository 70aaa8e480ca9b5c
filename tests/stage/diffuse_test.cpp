// Stage diffuse: every path against the same formulas in double precision, textures and sampled light included.
#include "kernels/model/bsdf/diffuse.h"

#include <catch2/catch.hpp>

#include "host_model.h"
#include "kernels/model/shading_frame.h"
#include "path_bench.h"
#include "runtime/scene/sky/hosek_wilkie.h"
#include "scenes.h"
#include "stage_test.h"

using namespace itn;
using namespace itn::test;

namespace {

constexpr double half = 2;  // of the floors' edges

// A texel's index brought back into [0, size).
int wrapped(int i, int size, Texture::Wrap wrap) {
  if (wrap == Texture::Wrap::clamp) return std::min(std::max(i, 0), size - 1);
  while (i < 0 || i >= size)
    if (wrap == Texture::Wrap::mirror)
      i = i < 0 ? -1 - i : 2 * size - 1 - i;
    else
      i += i < 0 ? size : -size;
  return i;
}

// Mitsuba's `bitmap`: texel (i, j) has its centre at ((i + 1/2) / width, (j + 1/2) / height).
Rgb reflectance(const Texture& t, double u, double v, double* to_border) {
  *to_border = 1;
  if (!t.bitmap) return t.value;
  const Bitmap& b = *t.bitmap;
  const double x = (t.to_uv[0] * u + t.to_uv[1] * v + t.to_uv[2]) * b.width,
               y = (t.to_uv[3] * u + t.to_uv[4] * v + t.to_uv[5]) * b.height;
  const auto at = [&](double i, double j, std::size_t c) {
    const int column = wrapped(static_cast<int>(i), b.width, t.wrap),
              row = wrapped(static_cast<int>(j), b.height, t.wrap);
    return static_cast<double>(b.data[static_cast<std::size_t>(row * b.width + column) * 3 + c]);
  };
  Rgb rgb{};
  if (t.nearest) *to_border = std::min(std::abs(x - std::round(x)), std::abs(y - std::round(y)));
  for (std::size_t c = 0; c < 3; ++c) {
    if (t.nearest) {
      rgb[c] = at(std::floor(x), std::floor(y), c);
      continue;
    }
    // tents of width 2 about the centres: the four nearest count
    for (double i = std::floor(x) - 1; i <= std::floor(x) + 1; ++i)
      for (double j = std::floor(y) - 1; j <= std::floor(y) + 1; ++j)
        rgb[c] += std::max(0.0, 1 - std::abs(x - i - 0.5)) * std::max(0.0, 1 - std::abs(y - j - 0.5)) * at(i, j, c);
  }
  return rgb;
}

// Seven floors above each other, none seen through another: a constant, and every wrap and filter mode.
Scene floors() {
  Scene scene = sphere_scene(bsdf_of("diffuse"), medium_of(1, 0.5, 0));
  scene.shapes.clear();
  scene.bsdfs.clear();
  auto bitmap = std::make_shared<Bitmap>();
  *bitmap = {5, 3, 3, {}};
  Rays random(11);
  for (int k = 0; k < 45; ++k) bitmap->data.push_back(static_cast<float>(random.number(0.05, 1)));
  for (int k = 0; k < 7; ++k) {
    Bsdf bsdf = bsdf_of("diffuse");
    bsdf.twosided = k % 2;
    bsdf.value("reflectance").value = {0.8, 0.5, 0.2};
    if (k > 0) {
      bsdf.value("reflectance") = make_bitmap(bitmap);
      bsdf.value("reflectance").wrap = k % 3 == 0   ? Texture::Wrap::repeat
                                       : k % 3 == 1 ? Texture::Wrap::mirror
                                                    : Texture::Wrap::clamp;
      bsdf.value("reflectance").nearest = k > 3;
      bsdf.value("reflectance").to_uv = {3, 0.5, -1.7, -0.4, 2.5, -0.8};
    }
    add_floor(scene, bsdf, half, static_cast<float>(k));
  }
  scene.integrator.max_depth = 611;
  scene.integrator.rr_depth = 5;
  return scene;
}

// Paths that stage ray has brought to the floors, from both sides.
std::vector<Path> arrivals(PathBench& bench, std::size_t n) {
  Rays rays(7);
  std::vector<Path> paths(n);
  for (std::size_t i = 0; i < n; ++i) {
    Path& p = paths[i];
    p.pixel = static_cast<int>(i);
    const double side = rays.number(0, 1) < 0.3 ? -1 : 1;
    p.position = {rays.number(-1.4, 1.4), rays.number(-1.4, 1.4), static_cast<double>(i % 7) + 0.5 * side};
    do p.direction = rays.direction();
    while (p.direction[2] * side > -0.66);
    p.queue = Queue::ray;
  }
  bench.run(Queue::ray, paths);
  for (std::size_t i = 0; i < n; ++i) {
    Path& p = paths[i];
    p.event = 3 + static_cast<int>(i % 4);
    p.depth = static_cast<int>(i % 12);
    p.medium = i % 5 == 0 ? 0 : -1;
    p.throughput = {rays.number(0.1, 1), rays.number(0.1, 1), rays.number(0.1, 1)};
    if (i % 5 == 4) p.depth += 600;  // where roulette also ends what loses nothing
    if (i % 10 == 9)
      for (double& t : p.throughput) t *= 100;  // but what is heavy
    p.radiance = {0.25, 0.5, 0.75};
    p.refraction_scale = rays.number(0.5, 2);
    p.last_pdf = 0.125;
  }
  return paths;
}

// The light's sampling in double precision, from the record and its tables.
struct HostLight {
  const EnvironmentRecord& record;
  const std::vector<float>& tables;
  ClearSky sky;

  double pdf(const Vec3& d) const {
    const double one_minus_cos = double(record.sun_one_minus_cos);
    return dot(difference(d, sky.sun), difference(d, sky.sun)) < 2 * one_minus_cos ? 1 / (2 * pi * one_minus_cos) : 0;
  }
  Vec3 sample(std::array<double, 4> u) const {
    const double fall = u[0] * double(record.sun_one_minus_cos), r = std::sqrt(fall * (2 - fall));
    Vec3 d = along({0, 0, 0}, 1 - fall, sky.sun);
    for (std::size_t k = 0; k < 3; ++k)
      d[k] += r * (std::cos(2 * pi * u[1]) * double(record.sun_tangent[k]) +
                   std::sin(2 * pi * u[1]) * double(record.sun_bitangent[k]));
    return d;
  }
};

// Is the sun or sky seen from there? The only blockers are the floors above.
bool visible(const Vec3& from, const Vec3& d) {
  if (d[2] < 0) return false;
  for (int k = static_cast<int>(std::ceil(from[2] + 1e-3)); k < 7; ++k) {
    const Vec3 at = along(from, (k - from[2]) / d[2], d);
    if (std::abs(at[0]) <= half && std::abs(at[1]) <= half) return false;
  }
  return true;
}

struct Check {
  std::size_t wrong = 0, died = 0, lit = 0, compared = 0;
  double throughput = 0, direction = 0, radiance = 0, pdf = 0;
};

Check check(const Scene& scene, int width) {
  PathBench bench(device(), scene, {.width = width});
  const std::vector<Path> paths = arrivals(bench, 7001);
  std::vector<Path> after = paths;
  bench.run(Queue::diffuse, after);
  const bool lit = bench.has("LIGHT_SAMPLING");
  const HostLight light{bench.data().environments[0], bench.data().light_tables,
                        lit ? clear_sky(sunsky_of(*scene.environment)) : ClearSky{}};
  Check check;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const Path &p = paths[i], &q = after[i];
    check.wrong += p.queue != Queue::diffuse;
    const int floor = static_cast<int>(std::lround(p.position[2]));
    const Bsdf& bsdf = scene.bsdfs[static_cast<std::size_t>(scene.shapes[static_cast<std::size_t>(floor)].bsdf)];
    double to_border;
    const Rgb albedo = reflectance(bsdf.value("reflectance"), (p.position[0] + half) / (2 * half),
                                   (p.position[1] + half) / (2 * half), &to_border);
    if (to_border < 1e-4) continue;  // rounding decides between two texels
    const double side = p.direction[2] < 0 ? 1 : -1;
    if (side < 0 && !bsdf.twosided) {
      check.wrong += q.queue != Queue::free || q.sample_radiance != p.radiance;
      continue;
    }
    const auto u = bench.random(p, 0);
    const int depth = p.depth + 1;
    Rgb throughput;
    double largest = 0;
    for (std::size_t c = 0; c < 3; ++c) largest = std::max(largest, throughput[c] = p.throughput[c] * albedo[c]);
    const double survival = test::survival(depth, largest, 0.999);
    if (depth > 5 && std::abs(u[2] - survival) < 1e-4) continue;
    if (depth >= 611 || (depth > 5 && u[2] >= survival)) {
      ++check.died;
      check.wrong += q.queue != Queue::free || q.sample_radiance != p.radiance;
      continue;
    }
    if (depth > 5)
      for (double& t : throughput) t /= survival;

    ++check.compared;
    const Vector3<double> normal{0, 0, side}, in_frame = diffuse_sample(u[0], u[1]);
    Vector3<double> s, t;
    shading_frame(normal, &s, &t);
    const Vector3<double> expected = to_world(s, t, normal, in_frame);
    check.direction = std::max(check.direction, distance(q.direction, {expected.x, expected.y, expected.z}));
    for (std::size_t c = 0; c < 3; ++c)
      check.throughput = std::max(check.throughput, std::abs(q.throughput[c] / throughput[c] - 1));
    check.wrong += q.queue != (p.medium < 0 ? Queue::ray : Queue::medium) || q.medium != p.medium || q.skip != p.hit ||
                   q.depth != depth || q.event != p.event + 1 ||
                   std::abs(q.position[2] - floor - side * bench.offset(p.hit)) > 1e-6;
    check.pdf = std::max(check.pdf, std::abs(q.last_pdf - (lit ? -diffuse_pdf(in_frame) : 0)));

    Rgb radiance = p.radiance;
    if (lit) {
      const auto v = bench.random(p, 1);
      const Vec3 d = light.sample(v);
      const double cosine = d[2] * side / pi, pdf = light.pdf(d);
      if (p.medium < 0 && cosine > 0 && visible(p.position, d)) {
        const Rgb sky = sky_radiance(light.sky, d), sun = sun_radiance(light.sky, d);
        for (std::size_t c = 0; c < 3; ++c)
          radiance[c] += throughput[c] * p.refraction_scale * cosine / (cosine + pdf) * (sky[c] + sun[c]);
        ++check.lit;
      }
    }
    for (std::size_t c = 0; c < 3; ++c)
      check.radiance = std::max(check.radiance, std::abs(q.radiance[c] / radiance[c] - 1));
  }
  return check;
}

}  // namespace

TEST_CASE("stage diffuse reflects the texture's value into a cosine-distributed direction") {
  const Scene scene = floors();
  for (const int width : widths()) {
    const Check c = check(scene, width);
    CAPTURE(width);
    CHECK(c.wrong == 0);
    CHECK(c.died > 500);
    CHECK(c.compared > 2000);
    CHECK(c.throughput < 2e-5);
    CHECK(c.direction < 1e-6);
    CHECK(c.radiance < 1e-7);
    CHECK(c.pdf == 0);
  }
}

TEST_CASE("stage diffuse adds the sampled light, weighed against finding it by chance") {
  Scene scene = floors();
  scene.environment = wide_sun(20, {0.6, 0, 0.8}, 1);
  for (const int width : widths()) {
    const Check c = check(scene, width);
    CAPTURE(width);
    CHECK(c.wrong == 0);
    CHECK(c.lit > 200);
    CHECK(c.throughput < 2e-5);
    CHECK(c.radiance < 2e-4);
    CHECK(c.pdf < 1e-6);
  }
}
