// Misfits of made-up photos are told by what they look like: a bright thing with an edge on a floor.
#include "runtime/inverse/misfit.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <random>

using namespace itn;

namespace {

constexpr int width = 48, height = 36;
constexpr double deviation = 0.01;

using Picture = std::function<double(double x, double y, int c)>;

// An ellipse with a soft edge that is brighter to one side, before a floor that is darker in the distance.
double thing(double x, double y, int c) {
  const double right = (x - 26) / 11, below = (y - 17) / 8,
               inside = 1 / (1 + std::exp(8 * (right * right + below * below - 1)));
  const double floor = 0.3 + 0.004 * y;
  return floor + inside * (0.5 + 0.2 * right - 0.1 * c - floor);
}

Rendering rendered(const Picture& picture, std::mt19937_64& random, int channels) {
  std::normal_distribution<float> normal(0, static_cast<float>(deviation) / 2);
  Rendering image;
  image.width = width;
  image.height = height;
  image.channels = channels;
  image.spp = 64;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < channels; ++c) image.mean.push_back(static_cast<float>(picture(x, y, c)) + normal(random));
  return image;
}

// The misfit that is said where `target` was photographed, and `thing` was found. said: the noise, over what it is.
// most: that the camera can tell.
Misfit looks_like(const Picture& target, std::uint64_t seed, double said = 1, int channels = 1, float most = 10) {
  std::mt19937_64 random(seed);
  std::normal_distribution<float> normal(0, static_cast<float>(deviation));
  const Rendering image = rendered(thing, random, channels);
  TargetImage photo{width, height, channels, {}, std::vector<float>(width * height, 1.0F), {}};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < channels; ++c)
        photo.value.push_back(std::min(most, static_cast<float>(target(x, y, c)) + normal(random)));
  WhiteResidual white{width, height, channels, {}};
  for (std::size_t i = 0; i < photo.value.size(); ++i) {
    white.deviation.push_back(said * std::sqrt(1.25) * deviation);
    white.value.push_back(static_cast<double>(image.mean[i] - photo.value[i]) / white.deviation.back());
  }
  return misfit_of({{image, {1, 1, 1}, photo, white}}, image_fit({white}, true), false, false);
}

}  // namespace

TEST_CASE("a photo that fits looks like no fault") {
  int named = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) named += !looks_like(thing, seed).kind.empty();
  CHECK(named <= 2);
}

TEST_CASE("a photo that was taken from beside is said to be shifted, how far and where to") {
  for (const auto& [x, y] : {std::pair{0.2, 0.0}, {-0.4, 0.0}, {0.0, 0.3}, {0.9, -0.6}}) {
    const Misfit m = looks_like([x = x, y = y](double a, double b, int c) { return thing(a - x, b - y, c); }, 1);
    CAPTURE(x, y, m.words);
    CHECK(m.kind == "shift");
    CHECK(m.x == Approx(x).margin(0.08 + 0.1 * std::fabs(x)));
    CHECK(m.y == Approx(y).margin(0.08 + 0.1 * std::fabs(y)));
    CHECK(m.share > 0.5);
    CHECK_THAT(m.words, Catch::Contains("camera"));
    CHECK((m.words.find("to the left") != std::string::npos) == (x < 0 && std::fabs(x) > std::fabs(y) / 4));
  }
}

TEST_CASE("a thing of another size, turned, or out of focus is said to be so") {
  for (const double larger : {0.03, -0.05}) {
    const Misfit m = looks_like(
        [&](double a, double b, int c) { return thing(26 + (a - 26) / (1 + larger), 17 + (b - 17) / (1 + larger), c); },
        2);
    CAPTURE(larger, m.words);
    CHECK(m.kind == "size");
    CHECK(m.change == Approx(larger).epsilon(0.25));
    CHECK((m.words.find("larger") != std::string::npos) == (larger > 0));
  }
  const double sine = std::sin(0.1), cosine = std::cos(0.1);
  const Misfit turned = looks_like(
      [&](double a, double b, int c) {
        return thing(26 + cosine * (a - 26) - sine * (b - 17), 17 + sine * (a - 26) + cosine * (b - 17), c);
      },
      3);
  CAPTURE(turned.words);
  CHECK(turned.kind == "rotation");
  const Misfit blurred = looks_like(
      [](double a, double b, int c) {
        return (thing(a - 2, b, c) + thing(a + 2, b, c) + thing(a, b - 2, c) + thing(a, b + 2, c)) / 4;
      },
      4);
  CAPTURE(blurred.words);
  CHECK(blurred.kind == "blur");
  CHECK_THAT(blurred.words, Catch::Contains("blurred"));
}

TEST_CASE("another brightness, colour or black level is said to be so") {
  const Misfit brighter = looks_like([](double a, double b, int c) { return 1.1 * thing(a, b, c); }, 5);
  CAPTURE(brighter.words);
  CHECK(brighter.kind == "brightness");
  CHECK(brighter.change == Approx(0.1).epsilon(0.05));
  const Misfit offset = looks_like([](double a, double b, int c) { return 0.03 + thing(a, b, c); }, 6);
  CAPTURE(offset.words);
  CHECK(offset.kind == "offset");
  const Misfit colour =
      looks_like([](double a, double b, int c) { return (c == 0 ? 1.08 : 0.95) * thing(a, b, c); }, 7, 1, 3);
  CAPTURE(colour.words);
  CHECK(colour.kind == "colour");
  const Misfit cut = looks_like(thing, 8, 1, 1, 0.55F);
  CAPTURE(cut.words);
  CHECK(cut.kind == "saturation");
}

TEST_CASE("noise that was said to be another than it is is said to be so, with what to say") {
  const Misfit large = looks_like(thing, 9, 10), small = looks_like(thing, 9, 0.5);
  CHECK(large.kind == "noise_too_large");
  CHECK(1 / large.change == Approx(10).epsilon(0.1));
  CHECK(small.kind == "noise_too_small");
  CHECK(small.change == Approx(2).epsilon(0.1));
  // A wrong scene does not hide behind noise that was claimed.
  CHECK(looks_like([](double a, double b, int c) { return thing(a - 0.5, b, c); }, 10, 20).kind == "noise_too_large");
}

TEST_CASE("what a parameter explains is no fault: it has taken that already") {
  std::mt19937_64 random(11);
  Rendering image = rendered(thing, random, 1);
  Image derivative;
  for (const float v : image.mean) derivative.mean.push_back(v);  // the parameter is the brightness itself
  image.derivatives.push_back(derivative);
  TargetImage photo{width, height, 1, {}, std::vector<float>(width * height, 1.0F), {}};
  WhiteResidual white{width, height, 1, {}};
  for (std::size_t i = 0; i < image.mean.size(); ++i) {
    photo.value.push_back(1.1F * image.mean[i]);
    white.deviation.push_back(deviation);
    white.value.push_back(static_cast<double>(image.mean[i] - photo.value[i]) / deviation);
  }
  const Misfit m = misfit_of({{image, {1, 1, 1}, photo, white}}, image_fit({white}, true), false, false);
  CHECK_FALSE(m.kind.empty());
  CHECK(m.kind != "brightness");
}

TEST_CASE("a spot that is none of these is said to lie along edges or in areas") {
  const Misfit spot =
      looks_like([](double a, double b,
                    int c) { return thing(a, b, c) + 0.2 * std::exp(-((a - 10) * (a - 10) + (b - 8) * (b - 8)) / 20); },
                 12);
  CAPTURE(spot.words);
  CHECK(spot.kind == "areas");
}
