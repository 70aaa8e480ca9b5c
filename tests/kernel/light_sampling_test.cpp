// Light sampled at a vertex: what it brings divided by its density is finite, on the rim of the sun's disc too.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <random>

#include "itn/device.h"
#include "kernels/shared/scene_layout.h"
#include "runtime/render/compile/environment.h"
#include "runtime/render/compile/surfaces.h"
#include "tests/support/plain_program.h"

using namespace itn;

namespace {

struct Sample {
  float pdf;
  std::array<float, 3> rgb;
};

struct SunLight {
  EnvironmentRecord record{};
  std::vector<float> tables;
};

SunLight sun_of(double elevation, double azimuth, double aperture) {
  Environment emitter = make_environment("sunsky");
  emitter.sun.direction = {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                           std::sin(elevation)};
  emitter.sun.aperture = aperture;
  SunLight light;
  append_environment(emitter, light.record, light.tables);
  return light;
}

class Sampler {
 public:
  explicit Sampler(int width) : width_(width) {
    setenv("ITN_KERNEL_DIR", ITN_SOURCE_DIR "/tests/kernel", 1);
    LaunchData launch;
    launch.environments = {sun_of(0.5, 0, 1).record};
    program_ = device_.build(
        "light_sampling_test.cl",
        test::plain_program(launch, width,
                            {{"LIGHT_SAMPLING", "1"}, {"MEDIUM_LIGHT_SAMPLING", "1"}, {"RADIANCE_CHANNELS", "3"}}),
        {{"program/surfaces.h", surfaces_text(launch)}});
    unsetenv("ITN_KERNEL_DIR");
  }

  // To the sun. u: two numbers a sample, as the two columns that the kernel reads; as many samples as a multiple of the
  // width.
  std::vector<Sample> sample(const SunLight& light, bool at_surface, const std::vector<float>& u) const {
    const std::size_t n = u.size() / 2;
    std::vector<float> out(4 * n);
    const cl::Buffer job = device_.upload(std::vector<JobRecord>(1), "job"),
                     record = device_.upload(std::vector<EnvironmentRecord>{light.record}, "record"),
                     tables = device_.upload(light.tables, "tables"), in = device_.upload(u, "u"),
                     to = device_.upload(out, "out");
    cl::Kernel kernel(program_, "sample");
    kernel.setArg(0, job);
    kernel.setArg(1, record);
    kernel.setArg(2, tables);
    kernel.setArg(3, static_cast<cl_int>(at_surface));
    kernel.setArg(4, in);
    kernel.setArg(5, to);
    device_.launch(kernel, n / static_cast<std::size_t>(width_), 1);
    device_.finish();
    device_.download(to, out);
    std::vector<Sample> samples(n);
    for (std::size_t i = 0; i < n; ++i) samples[i] = {out[i], {out[n + i], out[2 * n + i], out[3 * n + i]}};
    return samples;
  }

 private:
  Device device_;
  int width_;
  cl::Program program_;
};

}  // namespace

TEST_CASE("a sun direction that rounds to outside the disc brings no light, not NaN") {
  constexpr std::size_t n = 1 << 16;
  std::mt19937 random(5);
  // The outermost share 4e-5 of the disc, in the generator's steps of 2^-23.
  std::uniform_int_distribution<int> step(0, 299);
  std::uniform_real_distribution<float> unit(0, 1);
  std::vector<float> u(2 * n);
  for (std::size_t i = 0; i < n; ++i) {
    u[i] = 1 - 0x1p-24F - 0x1p-23F * static_cast<float>(step(random));
    u[n + i] = unit(random);
  }
  for (const int width : {1, 16}) {
    const Sampler sampler(width);
    std::size_t outside = 0;
    for (const double aperture : {0.2, 0.5358, 8.0, 60.0})
      for (const double elevation : {0.9, 1.1, 1.3, std::numbers::pi / 2})
        for (const double azimuth : {0.3, 2.5, 4.4}) {
          const SunLight light = sun_of(elevation, azimuth, aperture);
          for (const bool at_surface : {false, true}) {
            std::size_t wrong = 0;
            for (const Sample& s : sampler.sample(light, at_surface, u)) {
              // Inside the disc there is at least the sun's radiance.
              const bool sun = std::equal(s.rgb.begin(), s.rgb.end(), std::begin(light.record.sun_radiance),
                                          [](float rgb, float disc) { return rgb >= disc; });
              const bool nothing = s.rgb == std::array<float, 3>{};
              const bool finite = std::isfinite(s.pdf) && s.pdf > 0 &&
                                  std::all_of(s.rgb.begin(), s.rgb.end(), [](float x) { return std::isfinite(x); });
              wrong += !finite || (!sun && !nothing);
              outside += !sun;
            }
            CAPTURE(width, aperture, elevation, azimuth, at_surface);
            CHECK(wrong == 0);
          }
        }
    CAPTURE(width);
    CHECK(outside > 100);  // or the rim was never crossed
  }
}
