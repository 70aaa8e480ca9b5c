// Photographs that are spoilt: each fault does what it says, and nothing else.
#include "network/training/faults.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "runtime/base/error.h"

using namespace itn;

namespace {

constexpr int size = 64;
constexpr std::size_t pixels = size * size;

// A round spot of light of three colours on black, less of it in the photo without the flash, on a round object of
// which all is known.
Photographs spot() {
  Photographs p{size, std::vector<float>(3 * pixels), std::vector<float>(3 * pixels)};
  p.shape = {std::vector<float>(3 * pixels), std::vector<float>(pixels), std::vector<float>(pixels)};
  p.light = {0.5, 0, std::sqrt(0.75)};
  for (std::size_t i = 0; i < 3 * pixels; ++i) {
    const double x = static_cast<double>(i % size) - 31.5, y = static_cast<double>(i % pixels / size) - 31.5;
    const double light = std::exp(-(x * x + y * y) / (2 * 25)) * static_cast<double>(1 + i / pixels);
    p.image[i] = static_cast<float>(light);
    p.flash[i] = static_cast<float>(2 * light);
    if (i < pixels) p.shape.mask[i] = x * x + y * y < 15 * 15 ? 1 : 0;
    if (i < pixels) p.shape.nearness[i] = p.shape.mask[i] * static_cast<float>(15 * 15 - x * x - y * y);
    p.shape.normal[i] = i / pixels == 2 ? 1 : 0;
  }
  return p;
}

std::vector<float> sum(const std::vector<float>& a, const std::vector<float>& b) {
  std::vector<float> result = a;
  for (std::size_t i = 0; i < b.size(); ++i) result[i] += b[i];
  return result;
}

struct Moments {
  double total = 0, x = 0, y = 0, variance = 0;  // variance: of x
};

Moments moments(const std::vector<float>& planes) {
  Moments m;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    const auto value = static_cast<double>(planes[i]);
    m.total += value;
    m.x += value * static_cast<double>(i % size);
    m.y += value * static_cast<double>(i % pixels / size);
  }
  m.x /= m.total;
  m.y /= m.total;
  for (std::size_t i = 0; i < planes.size(); ++i)
    m.variance += static_cast<double>(planes[i]) * std::pow(static_cast<double>(i % size) - m.x, 2) / m.total;
  return m;
}

const Fault& named(const std::string& name) {
  const auto found = std::find_if(faults.begin(), faults.end(), [&](const Fault& f) { return f.name == name; });
  REQUIRE(found != faults.end());
  return *found;
}

// Photographs of a square object, with another flash.
Photographs others() {
  Photographs p = spot();
  std::fill(p.flash.begin(), p.flash.end(), 1.0F);
  for (std::size_t i = 0; i < pixels; ++i) p.shape.mask[i] = i % size < 20 && i / size < 20 ? 1 : 0;
  p.shape.nearness = p.shape.mask;
  return p;
}

Photographs spoilt(const std::string& fault, std::uint64_t stream = 1) {
  Photographs p = spot();
  spoil(p, named(fault), others, 7, stream);
  return p;
}

bool same(const SeenShape& a, const SeenShape& b) {
  return a.normal == b.normal && a.nearness == b.nearness && a.mask == b.mask;
}

}  // namespace

TEST_CASE("a moved camera shifts the photo with the flash by 1.5 to 6.5 pixels of 64, and nothing else") {
  const Photographs right = spot();
  double shortest = 100, longest = 0;
  for (std::uint64_t stream = 0; stream < 40; ++stream) {
    const Photographs moved = spoilt("moved", stream);
    CHECK((moved.image == right.image && moved.shape.mask == right.shape.mask));
    const Moments m = moments(sum(moved.image, moved.flash));
    const double length = std::hypot(m.x - 31.5, m.y - 31.5);
    shortest = std::min(shortest, length);
    longest = std::max(longest, length);
    CHECK(m.total == Approx(moments(sum(right.image, right.flash)).total).epsilon(1e-3));
  }
  CHECK(shortest > 1.49);
  CHECK(shortest < 2.5);
  CHECK(longest < 6.51);
  CHECK(longest > 5.5);
}

TEST_CASE("another curve is a power of both photos' radiance, either way") {
  const Photographs right = spot();
  bool above = false, below = false;
  for (std::uint64_t stream = 0; stream < 20; ++stream) {
    const Photographs bent = spoilt("curve", stream);
    CHECK(bent.shape.mask == right.shape.mask);
    const std::size_t a = 31 * size + 31, b = 31 * size + 40;
    const auto exponent = [&](const std::vector<float>& now, const std::vector<float>& before) {
      return std::log(static_cast<double>(now[a] / now[b])) / std::log(static_cast<double>(before[a] / before[b]));
    };
    const double of_image = exponent(bent.image, right.image);
    CHECK(exponent(sum(bent.image, bent.flash), sum(right.image, right.flash)) == Approx(of_image).epsilon(1e-4));
    CHECK(std::fabs(std::log(of_image)) > 0.39);
    CHECK(std::fabs(std::log(of_image)) < 1.01);
    above = above || of_image > 1;
    below = below || of_image < 1;
  }
  CHECK((above && below));
}

TEST_CASE("saturation cuts 5 to 40 % of the object off in the brighter photo, and the other at the same radiance") {
  for (std::uint64_t stream = 0; stream < 20; ++stream) {
    const Photographs cut = spoilt("saturated", stream), right = spot();
    const std::vector<float> lit = sum(cut.image, cut.flash);
    const float white = *std::max_element(lit.begin(), lit.end());
    double at_white = 0, all = 0;
    for (std::size_t i = 0; i < lit.size(); ++i) {
      CHECK(cut.image[i] == Approx(std::min(right.image[i], white)));
      if (right.shape.mask[i % pixels] != 1) continue;
      all += 1;
      at_white += static_cast<double>(lit[i]) > 0.99999 * static_cast<double>(white);
    }
    CHECK(at_white / all > 0.045);
    CHECK(at_white / all < 0.405);
  }
}

TEST_CASE("blur keeps the light and widens by 1 to 3 pixels; noise has a tenth to a half of the mean") {
  const Photographs right = spot();
  for (std::uint64_t stream = 0; stream < 10; ++stream) {
    const Photographs blurred = spoilt("blurred", stream);
    const Moments before = moments(right.image), after = moments(blurred.image);
    CHECK(after.total == Approx(before.total).epsilon(1e-3));
    const double width = std::sqrt(after.variance - before.variance);
    CHECK(width > 0.95);
    CHECK(width < 3.05);
    CHECK(moments(blurred.flash).variance == Approx(after.variance).epsilon(1e-4));

    const Photographs noisy = spoilt("noisy", stream);
    double square = 0, mean = 0, objects = 0;
    for (std::size_t i = 0; i < right.image.size(); ++i) {
      square += std::pow(static_cast<double>(noisy.image[i] - right.image[i]), 2);
      if (right.shape.mask[i % pixels] != 1) continue;
      mean += static_cast<double>(right.image[i]);
      objects += 1;
    }
    const double share = std::sqrt(square / static_cast<double>(right.image.size())) / (mean / objects);
    CHECK(share > 0.097);
    CHECK(share < 0.515);
  }
}

TEST_CASE("a wrong mask is another one with the object in it somewhere; the photos stay") {
  const Photographs right = spot();
  int grown = 0, shrunk = 0;
  for (std::uint64_t stream = 0; stream < 40; ++stream) {
    const Photographs wrong = spoilt("mask", stream);
    CHECK((wrong.image == right.image && wrong.flash == right.flash));
    CHECK(wrong.shape.mask != right.shape.mask);
    const auto area = std::count(wrong.shape.mask.begin(), wrong.shape.mask.end(), 1.0F);
    CHECK(area + std::count(wrong.shape.mask.begin(), wrong.shape.mask.end(), 0.0F) ==
          static_cast<std::ptrdiff_t>(pixels));
    CHECK(area > 0);
    grown += area > std::count(right.shape.mask.begin(), right.shape.mask.end(), 1.0F);
    shrunk += area < std::count(right.shape.mask.begin(), right.shape.mask.end(), 1.0F);
  }
  CHECK(grown > 5);
  CHECK(shrunk > 5);
  // An object of one pixel has nothing left to shrink.
  for (std::uint64_t stream = 0; stream < 20; ++stream) {
    Photographs tiny = spot();
    std::fill(tiny.shape.mask.begin(), tiny.shape.mask.end(), 0.0F);
    tiny.shape.mask[0] = 1;
    spoil(tiny, named("mask"), {}, 7, stream);
    CHECK(std::count(tiny.shape.mask.begin(), tiny.shape.mask.end(), 1.0F) > 0);
  }
}

TEST_CASE("without a flash the second photo is the first, brighter; another's flash is that") {
  const Photographs right = spot(), dark = spoilt("no_flash");
  CHECK(dark.image == right.image);
  const std::size_t middle = 31 * size + 31;
  const float brighter = dark.flash[middle] / dark.image[middle];
  for (const std::size_t i : {middle + 3, pixels + middle, 2 * pixels + middle - 5})
    CHECK(dark.flash[i] / dark.image[i] == Approx(brighter).epsilon(0.3));
  const Photographs wrong = spoilt("others_flash");
  CHECK(wrong.flash == others().flash);
  CHECK((wrong.image == right.image && same(wrong.shape, right.shape)));
}

TEST_CASE("another exposure is one factor on all light, of e^.4 to e^1.2 either way") {
  const Photographs right = spot();
  bool above = false, below = false;
  for (std::uint64_t stream = 0; stream < 20; ++stream) {
    const Photographs exposed = spoilt("exposure", stream);
    const double factor = moments(exposed.image).total / moments(right.image).total;
    CHECK(std::fabs(std::log(factor)) > 0.399);
    CHECK(std::fabs(std::log(factor)) < 1.201);
    const auto scaled = [&](float value) { return Approx(factor * static_cast<double>(value)).epsilon(1e-5); };
    for (std::size_t i = 0; i < right.image.size(); i += 7) {
      CHECK(exposed.image[i] == scaled(right.image[i]));
      CHECK(exposed.flash[i] == scaled(right.flash[i]));
    }
    above = above || factor > 1;
    below = below || factor < 1;
  }
  CHECK((above && below));
}

TEST_CASE("a displaced shape is the same shape 2 to 6.5 pixels of 64 beside; another's is another's") {
  const Photographs right = spot();
  const Moments before = moments(right.shape.mask);
  for (std::uint64_t stream = 0; stream < 40; ++stream) {
    const Photographs moved = spoilt("displaced", stream);
    CHECK((moved.image == right.image && moved.flash == right.flash && moved.light == right.light));
    CHECK(moved.shape.normal == right.shape.normal);  // the same everywhere
    const Moments after = moments(moved.shape.mask), nearness = moments(moved.shape.nearness);
    CHECK(after.total == before.total);
    const double length = std::hypot(after.x - before.x, after.y - before.y);
    CHECK(length > 1.29);  // whole pixels
    CHECK(length < 7.21);
    CHECK(nearness.x == Approx(after.x));
    CHECK(nearness.y == Approx(after.y));
  }
  const Photographs wrong = spoilt("others_shape");
  CHECK(same(wrong.shape, others().shape));
  CHECK((wrong.image == right.image && wrong.flash == right.flash && wrong.light == right.light));
}

TEST_CASE("another light is as high, and from 20 to 90 degrees beside") {
  const Photographs right = spot();
  double least = 180, most = 0;
  for (std::uint64_t stream = 0; stream < 40; ++stream) {
    const Photographs turned = spoilt("light", stream);
    CHECK((turned.image == right.image && turned.flash == right.flash && same(turned.shape, right.shape)));
    CHECK(turned.light[2] == right.light[2]);
    CHECK(std::hypot(turned.light[0], turned.light[1]) == Approx(0.5));
    const double angle = std::fabs(std::atan2(turned.light[1], turned.light[0])) * 180 / 3.14159265;
    least = std::min(least, angle);
    most = std::max(most, angle);
  }
  CHECK(least > 19.99);
  CHECK(least < 30);
  CHECK(most > 80);
  CHECK(most < 90.01);
}

TEST_CASE("faults are the same for the same seed and stream, and refused where they cannot happen") {
  for (const Fault& fault : faults) {
    const Photographs once = spoilt(fault.name, 3), again = spoilt(fault.name, 3);
    CHECK((once.image == again.image && once.flash == again.flash && once.light == again.light));
    CHECK(same(once.shape, again.shape));
  }
  CHECK(spoilt("noisy", 3).image != spoilt("noisy", 4).image);
  Photographs alone = spot();
  alone.flash.clear();
  alone.shape = {};
  alone.light = {};
  for (const char* needs_more : {"moved", "mask", "displaced", "light"})
    CHECK_THROWS_AS(spoil(alone, named(needs_more), {}, 0, 0), UsageError);
  spoil(alone, named("saturated"), {}, 0, 0);
}

TEST_CASE("what can go wrong is with what the network sees") {
  const auto names = [](std::vector<std::string> inputs, bool exposure) {
    NetworkDescription network;
    network.inputs = std::move(inputs);
    network.exposure = exposure;
    std::string all;
    for (const Fault& fault : faults_of(network)) all += std::string(fault.name) + " ";
    return all;
  };
  CHECK(names({"luminance"}, true) == "noisy blurred curve saturated ");
  CHECK(names({"luminance"}, false) == "noisy blurred curve saturated exposure ");
  CHECK(names({"rgb", "mask"}, true) == "noisy blurred curve saturated mask ");
  CHECK(names({"rgb", "flash_rgb", "mask"}, true) == "noisy blurred curve saturated mask moved others_flash no_flash ");
  CHECK(names({"luminance", "normal", "nearness", "light"}, false) ==
        "noisy blurred curve saturated exposure displaced others_shape light ");
}
