// Shapes that shine: the points that are drawn are uniform over their area (chi-square), and the mean of 1 / pdf over
// the points that are seen is the solid angle under which the shape is seen (z-test).
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <random>

#include "../support/chi_square.h"
#include "../support/z_test.h"
#include "itn/device.h"
#include "kernels/model/models.h"
#include "runtime/render/compile/launch_data.h"
#include "runtime/render/compile/surfaces.h"
#include "runtime/scene/mesh/shape_meshes.h"
#include "runtime/scene/transform.h"
#include "tests/support/plain_program.h"

using namespace itn;
using namespace itn::test;

namespace {

constexpr double pi = std::numbers::pi, significance = 1e-4;
constexpr std::size_t samples = 1 << 16, claims = 9;

struct Sample {
  Vec3 on;
  double pdf, radiance;
};

Scene scene_of(const Shape& shape) {
  Scene scene;
  scene.shapes = {shape};
  scene.shapes[0].light = scene.shapes[0].bsdf = 0;
  scene.bsdfs = {make_bsdf("diffuse")};
  Light light;
  light.become(*find_model(light_models(), "area"));
  light.set("radiance", 3);
  scene.lights = {light};
  scene.sensors.resize(1);
  return scene;
}

std::vector<Sample> sample(const Scene& scene, const Vec3& from, int width) {
  const Device device;
  LaunchData data;
  data.geometry.box_width = 4;
  const JobRecord job = append_scene(scene, 0, data);
  setenv("ITN_KERNEL_DIR", ITN_SOURCE_DIR "/tests/kernel", 1);
  const cl::Program program =
      device.build("light_test.cl", test::plain_program(data, width), {{"program/surfaces.h", surfaces_text(data)}});
  unsetenv("ITN_KERNEL_DIR");
  std::mt19937 engine(7);
  std::vector<float> u(4 * samples), out(6 * samples);
  for (float& v : u) v = static_cast<float>(engine() >> 8) * 0x1p-24F;
  std::vector<float> numbers = data.numbers;
  numbers.resize(numbers.size() + MOST_SLOTS);
  const cl::Buffer jobs = device.upload(std::vector<JobRecord>{job}, "job"),
                   lights = device.upload(data.lights, "lights"), tables = device.upload(data.light_tables, "tables"),
                   values = device.upload(numbers, "numbers"), in = device.upload(u, "u"),
                   to = device.upload(out, "out");
  cl::Kernel kernel(program, "sample");
  cl_uint at = 0;
  for (const cl::Buffer& buffer : {jobs, lights, tables, values}) kernel.setArg(at++, buffer);
  for (const double x : from) kernel.setArg(at++, static_cast<cl_float>(x));
  kernel.setArg(at++, in);
  kernel.setArg(at, to);
  device.launch(kernel, samples / static_cast<std::size_t>(width), 1);
  device.finish();
  device.download(to, out);
  std::vector<Sample> result;
  for (std::size_t i = 0; i < samples; ++i) {
    const auto component = [&](std::size_t c) { return static_cast<double>(out[c * samples + i]); };
    const Vec3 direction{component(0), component(1), component(2)};
    result.push_back({from + component(3) * direction, component(4), component(5)});
  }
  return result;
}

// Maps a point of the shape to [0, 1)^2, in proportion to area.
using Chart = Point (*)(const Vec3&);

double turn(double y, double x) {
  const double t = std::atan2(y, x) / (2 * pi);
  return t < 0 ? t + 1 : t;
}

struct Shining {
  const char* name;
  Shape shape;
  Vec3 from;
  double solid_angle;
  Chart chart;
};

Shape round_shape(Shape::Kind kind) {
  Shape shape;
  shape.kind = kind;
  return shape;
}

// The solid angle of a rectangle of half sizes a and b, from the distance d over its middle.
double solid_angle_of_rectangle(double a, double b, double d) {
  return 4 * std::asin(a * b / std::sqrt((a * a + d * d) * (b * b + d * d)));
}

std::vector<Shining> shining() {
  Shape sphere = round_shape(Shape::Kind::sphere);
  sphere.radius = 0.5;
  Shape disk = round_shape(Shape::Kind::disk);
  Shape rectangle;
  rectangle.mesh = std::make_shared<const Mesh>(rectangle_mesh());
  Shape tube = round_shape(Shape::Kind::cylinder);  // seen from afar: its shadow over the distance squared
  return {{"sphere",
           sphere,
           {0, 0, 2},
           2 * pi * (1 - std::sqrt(1 - 0.25 * 0.25)),
           [](const Vec3& p) {
             return Point{0.5 + p[2], turn(p[1], p[0])};
           }},
          {"disk",
           disk,
           {0, 0, 1},
           2 * pi * (1 - std::sqrt(0.5)),
           [](const Vec3& p) {
             return Point{p[0] * p[0] + p[1] * p[1], turn(p[1], p[0])};
           }},
          {"rectangle",
           rectangle,
           {0, 0, 0.7},
           solid_angle_of_rectangle(1, 1, 0.7),
           [](const Vec3& p) {
             return Point{(p[0] + 1) / 2, (p[1] + 1) / 2};
           }},
          {"cylinder", tube, {300, 0, 0.5}, 2 / (300.0 * 300), [](const Vec3& p) {
             return Point{p[2], turn(p[1], p[0])};
           }}};
}

}  // namespace

TEST_CASE("points of shapes that shine are uniform over their area (chi-square)", "[kernel][stat]") {
  for (const Shining& s : shining()) {
    CAPTURE(s.name);
    std::vector<Point> points;
    for (const Sample& x : sample(scene_of(s.shape), s.from, 8)) points.push_back(s.chart(x.on));
    // connections end a little in front of the surface, from afar rounded: coordinates beyond [0, 1) by less than 1e-3
    for (Point& p : points)
      for (double& x : p) x = std::min(std::max(x, x > -1e-3 ? 0 : x), x < 1 + 1e-3 ? 0.9999999 : x);
    const ChiSquare test = chi_square(points, [](double, double) { return 1.0; }, {0, 1, 0, 1, 12, 12});
    CHECK(test.p_value > significance / claims);
  }
}

TEST_CASE("the mean of 1 / pdf of points that are seen is the solid angle of a shape that shines (z-test)",
          "[kernel][stat]") {
  for (const int width : {1, 8})
    for (const Shining& s : shining()) {
      CAPTURE(s.name, width);
      double sum = 0, square = 0;
      for (const Sample& x : sample(scene_of(s.shape), s.from, width)) {
        if (x.pdf > 0) CHECK(x.radiance == 3);
        const double v = x.pdf > 0 ? 1 / x.pdf : 0;
        sum += v;
        square += v * v;
      }
      const double n = samples, mean = sum / n, error = std::sqrt((square / n - mean * mean) / (n - 1));
      // far away rounding counts: the tube's share of error, and the shadow's approximation, are below 1 %
      const double allowed = s.solid_angle < 1e-3 ? 0.01 * s.solid_angle : 1e-5 * s.solid_angle;
      CHECK(std::abs(mean - s.solid_angle) < largest_z_bound(claims, significance) * error + allowed);
    }
}
