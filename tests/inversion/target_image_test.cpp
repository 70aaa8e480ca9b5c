// Targets as files: which channels count, and what cannot be radiance, a weight or a standard error.
#include "itn/target_image.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>

#include "itn/error.h"
#include "itn/exr.h"
#include "itn/file.h"
#include "runtime/image/png.h"
#include "runtime/image/srgb.h"
#include "tests/support/temporary_folder.h"

using namespace itn;

namespace {

using Catch::Contains;
constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN(),
                infinite = std::numeric_limits<float>::infinity();

// 2 x 1 pixels with the radiance 1, 2, 3 and 4, 5, 6, and standard errors of a tenth.
struct StoredTarget {
  TemporaryFolder folder;
  ExrImage image{2,
                 1,
                 {"R", "G", "B", "stderr.R", "stderr.G", "stderr.B"},
                 {1, 2, 3, 0.1F, 0.2F, 0.3F, 4, 5, 6, 0.4F, 0.5F, 0.6F},
                 {}};
  bool masked = false;

  TargetImage read(int channels = 3) const {
    write_exr(folder / "photo.exr", image);
    if (masked) write_exr(folder / "mask.exr", {2, 1, {"Y"}, {0.5F, 0}, {}});
    return read_target(folder / "photo.exr", masked ? folder / "mask.exr" : "", 2, 1, channels);
  }
  std::string refusal() const {
    try {
      read();
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  }
};

}  // namespace

TEST_CASE("a target's radiance and standard errors are those of its channels, in the order of the film's") {
  StoredTarget photo;
  const TargetImage target = photo.read();
  CHECK(target.value == std::vector<float>{1, 2, 3, 4, 5, 6});
  CHECK(target.error == std::vector<float>{0.1F, 0.2F, 0.3F, 0.4F, 0.5F, 0.6F});
  CHECK(target.weight == std::vector<float>{1, 1});
  photo.image = {2, 1, {"Y", "stderr.Y"}, {1, 0.1F, 2, 0.2F}, {}};
  const TargetImage grey = photo.read(1);
  CHECK(grey.value == std::vector<float>{1, 2});
  CHECK(grey.error == std::vector<float>{0.1F, 0.2F});
  CHECK_THROWS_WITH(photo.read(3), Contains("need R G B, as the sensor's film"));
}

TEST_CASE("standard errors of some channels only count as none") {
  StoredTarget photo;
  photo.image = {2, 1, {"R", "G", "B", "stderr.R", "stderr.B"}, {1, 2, 3, 0.1F, -1, 4, 5, 6, 0.4F, 0.6F}, {}};
  const TargetImage target = photo.read();
  CHECK(target.value == std::vector<float>{1, 2, 3, 4, 5, 6});
  CHECK(target.error.empty());
}

TEST_CASE("standard errors of 0 are taken; negative, infinite and NaN ones are refused with pixel and channel") {
  StoredTarget photo;
  photo.image.data[10] = 0;
  CHECK(photo.read().error[4] == 0);
  for (const float wrong : {-0.5F, infinite, not_a_number}) {
    CAPTURE(wrong);
    photo.image.data[10] = wrong;
    CHECK_THAT(photo.refusal(), Contains("photo.exr: pixel (1, 0), channel stderr.G is") &&
                                    Contains("a standard error is finite and 0 or more"));
  }
}

TEST_CASE("noise around black may be below 0; what is no radiance is refused") {
  StoredTarget photo;
  photo.image.data[0] = -1.6F;  // of 20 above
  CHECK(photo.read().value == std::vector<float>{-1.6F, 2, 3, 4, 5, 6});
  photo.image.data[0] = -2.4F;
  CHECK_THAT(photo.refusal(), Contains("photo.exr: its values below 0 add up to 0.12 of those above"));
  photo.image.data[0] = infinite;
  CHECK_THAT(photo.refusal(), Contains("pixel (0, 0), channel R is inf; radiance is finite"));
}

TEST_CASE("pixels of weight 0 may hold anything, and count as 0") {
  StoredTarget photo;
  photo.masked = true;
  photo.image.data[6] = not_a_number;
  photo.image.data[10] = -1;
  const TargetImage target = photo.read();
  CHECK(target.weight == std::vector<float>{0.5F, 0});
  CHECK(target.value == std::vector<float>{1, 2, 3, 0, 0, 0});
  CHECK(target.error == std::vector<float>{0.1F, 0.2F, 0.3F, 0, 0, 0});
  photo.masked = false;
  CHECK_THAT(photo.refusal(), Contains("pixel (1, 0), channel R is nan") && Contains("weight 0 in a mask"));
}

TEST_CASE("a target whose data window is not its display window is refused: its pixels would be compared with others") {
  CHECK_THROWS_WITH(read_target(ITN_SOURCE_DIR "/tests/fuzz/corpus/exr/moved.exr", "", 2, 2, 3),
                    Contains("moved.exr: its data window"));
  CHECK(read_target(ITN_SOURCE_DIR "/tests/fuzz/corpus/exr/colour.exr", "", 2, 2, 3).value.size() == 12);
}

TEST_CASE("a photo of 8 bits is a target: averaged down, what is saturated or masked left out, its noise known") {
  const TemporaryFolder folder;
  // 4 x 2, twice the film: the right half has a saturated pixel.
  std::vector<std::uint8_t> samples(24, 128);
  samples[9] = 255;
  write_png(folder / "photo.png", 4, 2, samples);
  const auto value = static_cast<float>(srgb_decode(128 / 255.0));
  const TargetImage target = read_target(folder / "photo.png", "", 2, 1, 3);
  CHECK(target.weight == std::vector<float>{1, 0});
  CHECK(target.value[0] == Approx(value));
  CHECK(target.error.empty());
  REQUIRE(target.noise.size() == 6);
  const double step = srgb_decode(128.5 / 255) - srgb_decode(127.5 / 255);
  CHECK(target.noise[0] == Approx(step / std::sqrt(12.0) / 2).epsilon(1e-3));  // of four pixels
  CHECK_THAT(target.note, Contains("4 x 2 pixels, averaged down to 2 x 1") && Contains("12 % are saturated"));
  CHECK(read_target(folder / "photo.png", "", 2, 1, 1).value[0] == Approx(value).epsilon(1e-5));  // luminance
  CHECK(read_target(folder / "photo.png", "", 2, 1, 3, {transfer_curve("linear"), 2}).value[0] == Approx(128 / 255.0));

  std::vector<std::uint8_t> mask(24, 255);
  for (std::size_t i = 0; i < 3; ++i) mask[i] = 0;
  write_png(folder / "mask.png", 4, 2, mask);
  CHECK(read_target(folder / "photo.png", folder / "mask.png", 2, 1, 3, {{}, 2}).weight == std::vector<float>{0, 1});
  CHECK_THROWS_WITH(read_target(folder / "photo.png", folder / "mask.png", 2, 1, 3),
                    Contains("saturated, transparent or masked"));
  write_exr(folder / "mask.exr", {2, 1, {"Y"}, {0.5F, 1}, {}});
  CHECK(read_target(folder / "photo.png", folder / "mask.exr", 2, 1, 3).weight == std::vector<float>{0.5F, 0});
  CHECK_THROWS_WITH(read_target(folder / "photo.png", "", 3, 1, 3), Contains("photo.png: 4 x 2 pixels, need 3 x 1"));
  write_file(folder / "grey.pgm", std::string("P5 2 1 255\n\x10\x20"));
  CHECK_THROWS_WITH(read_target(folder / "grey.pgm", "", 2, 1, 3), Contains("is grey, need colours"));
}

TEST_CASE("the noise of targets that do not say it is measured in them, unless it is given", "[stat]") {
  constexpr int side = 64;
  constexpr double gain = 0.02;
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  TargetImage noisy{side, side, 1, {}, std::vector<float>(side * side, 1), {}};
  TargetImage flat{side, side, 1, std::vector<float>(side * side, 2), std::vector<float>(side * side, 1), {}};
  TargetImage said = flat;
  said.error.assign(side * side, 0.3F);
  double expected = 0;
  for (int i = 0; i < side * side; ++i) {
    // a ball before black
    const double x = (i % side - 31.5) / 24, y = (i / side - 31.5) / 24, square = x * x + y * y;
    const double value = square < 1 ? 1 + 2 * std::sqrt(1 - square) : 0;
    noisy.value.push_back(static_cast<float>(value + std::sqrt(gain * value) * normal(random)));
    expected += gain * value;
  }
  std::vector<TargetImage> targets{noisy, flat, said};
  const TargetNoise noise = settle_noise(targets, {});
  CHECK_FALSE(noise.known);
  CHECK(noise.relative == 0);
  double found = 0;
  for (const float n : targets[0].error) found += std::pow(n, 2);
  CHECK(found == Approx(expected).epsilon(0.1));
  for (const float n : targets[1].error) CHECK(n == Approx(2e-3));
  CHECK(targets[2].error == said.error);
  std::vector<double> ratios;
  for (std::size_t i = 0; i < noisy.value.size(); ++i)
    if (noisy.value[i] > 0) ratios.push_back(targets[0].error[i] / noisy.value[i]);
  std::sort(ratios.begin(), ratios.end());
  CHECK(noise.measured == Approx((ratios[ratios.size() / 2] + 1e-3) / 2).epsilon(1e-6));

  std::vector<TargetImage> given{noisy, flat};
  CHECK(settle_noise(given, 0.05).known);
  CHECK(settle_noise(given, 0.05).relative == 0.05);
  CHECK(given[0].error.empty());
  std::vector<TargetImage> one{said};
  CHECK(settle_noise(one, {}).known);
  CHECK_THROWS_WITH(settle_noise(one, -1), "noise -1: need a finite number, 0 or more");
}
