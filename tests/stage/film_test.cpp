// The film's sums in two floats each against sums in double precision: 10^5 samples a pixel lose no digits.
#include "runtime/wavefront/film.h"

#include <catch2/catch.hpp>
#include <random>

#include "runtime/renderer.h"
#include "runtime/wavefront/wavefront.h"
#include "scenes.h"
#include "stage_test.h"

using namespace itn;
using namespace itn::test;

namespace {

constexpr int samples_a_pixel = 100000;

// samples: [pixel][sample][channel]
void check_sums(const Image& film, const std::vector<float>& samples) {
  const std::size_t channels = 3, values = film.mean.size();
  double worst_mean = 0, worst_error = 0;
  for (std::size_t i = 0; i < values; ++i) {
    double sum = 0, square = 0;
    for (std::size_t s = 0; s < samples_a_pixel; ++s) {
      const double x = static_cast<double>(samples[(i / channels * samples_a_pixel + s) * channels + i % channels]);
      sum += x;
      square += x * x;
    }
    const double n = samples_a_pixel, mean = sum / n, error = std::sqrt((square / n - mean * mean) / (n - 1));
    worst_mean = std::max(worst_mean, std::abs(static_cast<double>(film.mean[i]) / mean - 1));
    worst_error = std::max(worst_error, std::abs(static_cast<double>(film.stderr_[i]) / error - 1));
  }
  CHECK(worst_mean < 0x1p-24);  // of the last rounding, to float
  CHECK(worst_error < 1e-6);
}

}  // namespace

TEST_CASE("sums of 10^5 samples are those of double precision, however they are split into launches") {
  constexpr std::size_t pixels = 5;
  std::mt19937 generator(3);
  std::lognormal_distribution<float> radiance(0, 2);  // rare large values among small ones, as in images
  std::vector<float> samples(pixels * samples_a_pixel * 3);
  for (float& x : samples) x = radiance(generator);
  Image previous;
  for (const std::size_t launches : {1, 8, 1000}) {
    Film film(device(), pixels, 1, 3, false);
    const std::size_t count = samples_a_pixel / launches;
    for (std::size_t launch = 0; launch < launches; ++launch) {
      std::vector<float> part;
      for (std::size_t p = 0; p < pixels; ++p) {
        auto value = samples.begin() + static_cast<std::ptrdiff_t>((p * samples_a_pixel + launch * count) * 3);
        for (std::size_t s = 0; s < count; ++s, value += 3) {
          part.insert(part.end(), value, value + 3);
          part.push_back(1e30F);  // not the image's
        }
      }
      film.add(device().upload(part, "samples"), 4, 0, 0, pixels, static_cast<int>(count), launch == 0);
    }
    std::vector<Image> images;
    film.develop(samples_a_pixel, pixels, images);
    const Image& out = images.front();
    CAPTURE(launches);
    check_sums(out, samples);
    if (launches > 1) CHECK((out.mean == previous.mean && out.stderr_ == previous.stderr_));
    previous = out;
  }
}

TEST_CASE("a render of 10^5 samples a pixel is the mean of its paths in double precision") {
  Scene scene = sphere_scene(bsdf_of("null"), medium_of(2, 0.9, 0.5));
  Sensor& sensor = scene.sensors[0];
  sensor.width = sensor.height = sensor.crop_width = sensor.crop_height = 2;
  sensor.to_world.m = {1, 0, 0, 0, 0, 0, 1, -4, 0, 1, 0, 0, 0, 0, 0, 1};
  RenderOptions options;
  options.spp = samples_a_pixel;
  options.seed = 5;
  const Rendering image = render(device(), scene, options);

  LaunchData data;
  data.geometry.box_width = 4;
  JobRecord job = append_scene(scene, 0, data);
  job.seed_low = 5;
  Wavefront wavefront(device(), data, {job}, {}, Operator::full, 0, Schedule::automatic);
  wavefront.trace({{0, 0, 4, 0, samples_a_pixel}});
  std::vector<float> grey(4 * samples_a_pixel), samples;
  device().download(wavefront.samples(), grey);
  for (const float x : grey) samples.insert(samples.end(), 3, x);
  check_sums(image, samples);
}
