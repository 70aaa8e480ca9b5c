// The film's sums in three floats each against sums in double precision: no number of samples loses digits.
#include "runtime/render/wavefront/film.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "itn/renderer.h"
#include "runtime/render/wavefront/wavefront.h"
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

namespace {

// Samples of three channels, those of `part` over and over, in launches of its length.
Image repeated(const std::vector<float>& part, std::size_t times) {
  Film film(device(), 1, 1, 3, false);
  const cl::Buffer samples = device().upload(part, "samples");
  const int count = static_cast<int>(part.size() / 3);
  for (std::size_t i = 0; i < times; ++i) film.add(samples, 3, 0, 0, 1, count, i == 0);
  std::vector<Image> images;
  film.develop(static_cast<int>(times) * count, 1, images);
  return images.front();
}

}  // namespace

TEST_CASE("sums of 2^26 samples go on growing, and so does what is known of their noise") {
  constexpr std::size_t count = 1 << 16, times = 1 << 10;
  constexpr float step = 0x1p-20F;  // so little noise that it is less than what a float rounds off a square
  std::vector<float> part;
  for (std::size_t i = 0; i < count; ++i) {
    const bool even = i % 2 == 0;
    part.insert(part.end(), {0.7F, even ? 1 : 1 + step, i % 8 == 0 ? 5.6F : 0.0F});
  }
  const Image image = repeated(part, times);
  const double root = std::sqrt(static_cast<double>(count * times));
  CHECK(image.mean[0] == 0.7F);
  CHECK(image.stderr_[0] < 1e-9F / static_cast<float>(root));
  CHECK(image.mean[1] == 1 + step / 2);
  CHECK(image.stderr_[1] == Approx(static_cast<double>(step) / 2 / root).epsilon(1e-6));
  CHECK(image.mean[2] == Approx(0.7F).epsilon(1e-7));
  CHECK(image.stderr_[2] == Approx(0.7 * std::sqrt(7.0) / root).epsilon(1e-6));
}

TEST_CASE("what is added to a sum of 2^31 samples is not rounded off") {
  // The sum before is one sample, which is taken off again in the end.
  constexpr int count = 1 << 20;
  std::vector<float> samples;
  const auto add = [&](float times) { samples.insert(samples.end(), {0.7F * times, -0.3F * times, 1e-6F * times}); };
  add(0x1p31F);
  for (int i = 0; i < count - 2; ++i) add(1);
  add(-0x1p31F);
  const Image image = repeated(samples, 1);
  const double part = (count - 2.0) / count;
  CHECK(static_cast<double>(image.mean[0]) == Approx(static_cast<double>(0.7F) * part).epsilon(1e-7));
  CHECK(static_cast<double>(image.mean[1]) == Approx(static_cast<double>(-0.3F) * part).epsilon(1e-7));
  CHECK(static_cast<double>(image.mean[2]) == Approx(static_cast<double>(1e-6F) * part).epsilon(1e-7));
}

TEST_CASE("the error of samples whose squares are too large for a float is not 0") {
  const Image image = repeated({1e20F, 1, 1, 2e20F, 1, 1}, 1);
  CHECK(std::isinf(image.stderr_[0]));
  CHECK(image.stderr_[1] == 0);
}
