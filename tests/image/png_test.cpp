#include "runtime/image/png.h"

#include <catch2/catch.hpp>

#include "runtime/error.h"
#include "runtime/image/exr.h"
#include "runtime/image/file.h"
#include "tests/support/temporary_folder.h"

TEST_CASE("sRGB encoding and decoding are inverse and meet the standard's values") {
  for (int i = 0; i <= 1000; ++i) {
    const double x = i / 1000.0;
    REQUIRE(itn::srgb_decode(itn::srgb_encode(x)) == Approx(x).margin(1e-7));
  }
  CHECK(itn::srgb_encode(0.2140411) == Approx(0.5).margin(1e-6));  // middle grey of the standard
}

TEST_CASE("a PNG comes back as linear values") {
  const TemporaryFolder folder;
  std::vector<std::uint8_t> rgb;
  for (int i = 0; i < 256; ++i)
    for (const int value : {i, 255 - i, 128}) rgb.push_back(static_cast<std::uint8_t>(value));
  itn::write_png(folder / "a.png", 16, 16, rgb);
  const itn::Bitmap linear = itn::read_bitmap(folder / "a.png"), raw = itn::read_bitmap(folder / "a.png", true);
  REQUIRE(linear.width == 16);
  REQUIRE(linear.height == 16);
  REQUIRE(linear.channels == 3);
  for (std::size_t i = 0; i < rgb.size(); ++i) {
    REQUIRE(raw.data[i] == Approx(rgb[i] / 255.0).margin(1e-6));
    REQUIRE(linear.data[i] == Approx(itn::srgb_decode(rgb[i] / 255.0)).margin(1e-6));
  }
}

TEST_CASE("an EXR texture keeps its values and its channels' order") {
  const TemporaryFolder folder;
  itn::write_exr(folder / "a.exr", {2, 1, {"R", "G", "B"}, {1, 2, 3, 4, 5, 6}, {}});
  CHECK(itn::read_bitmap(folder / "a.exr").data == std::vector<float>{1, 2, 3, 4, 5, 6});
  itn::write_exr(folder / "y.exr", {2, 1, {"Y"}, {7, 8}, {}});
  const itn::Bitmap grey = itn::read_bitmap(folder / "y.exr");
  CHECK(grey.channels == 1);
  CHECK(grey.data == std::vector<float>{7, 8});
  itn::write_exr(folder / "depth.exr", {2, 1, {"depth"}, {7, 8}, {}});
  CHECK_THROWS_WITH(itn::read_bitmap(folder / "depth.exr"), Catch::Contains("channels are depth; need R, G and B"));
}

TEST_CASE("missing, foreign and truncated images are input errors") {
  const TemporaryFolder folder;
  CHECK_THROWS_AS(itn::read_bitmap(folder / "missing.png"), itn::InputError);
  itn::write_file(folder / "text.png", "this is text");
  CHECK_THROWS_WITH(itn::read_bitmap(folder / "text.png"), Catch::Contains("is no PNG, JPEG or OpenEXR image"));
  itn::write_png(folder / "a.png", 64, 64, std::vector<std::uint8_t>(3 * 64 * 64, 99));
  const std::string bytes = itn::read_file(folder / "a.png");
  itn::write_file(folder / "cut.png", bytes.substr(0, bytes.size() / 2));
  CHECK_THROWS_AS(itn::read_bitmap(folder / "cut.png"), itn::InputError);
}
