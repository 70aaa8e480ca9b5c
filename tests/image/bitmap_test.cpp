#include "itn/bitmap.h"

#include <catch2/catch.hpp>
#include <map>

#include "itn/error.h"
#include "itn/exr.h"
#include "itn/file.h"
#include "runtime/image/png.h"
#include "runtime/image/srgb.h"
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

TEST_CASE("BMP, TGA and PNM textures are decoded as PNG ones are") {
  const TemporaryFolder folder;
  const std::string red_blue("\xff\x00\x00\x00\x00\x80", 6), blue_red("\x00\x00\xff\x80\x00\x00", 6);  // RGB and BGR
  itn::write_file(folder / "a.ppm", "P6\n2 1\n255\n" + red_blue);
  itn::write_file(folder / "a.tga", std::string("\0\0\2\0\0\0\0\0\0\0\0\0\2\0\1\0\x18\0", 18) + blue_red);
  const std::string header("BM\x3e\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0\2\0\0\0\1\0\0\0\1\0\x18\0", 30);
  itn::write_file(folder / "a.bmp", header + std::string(24, '\0') + blue_red + std::string(2, '\0'));
  for (const std::string name : {"a.ppm", "a.tga", "a.bmp"}) {
    INFO(name);
    const itn::Bitmap bitmap = itn::read_bitmap(folder / name);
    REQUIRE(bitmap.width == 2);
    REQUIRE(bitmap.data.size() == 6);
    CHECK(bitmap.data[0] == 1);
    CHECK(bitmap.data[1] == 0);
    CHECK(bitmap.data[3] == 0);
    CHECK(bitmap.data[5] == Approx(itn::srgb_decode(128 / 255.0)));
  }
}

TEST_CASE("an HDR texture keeps its values") {
  const TemporaryFolder folder;
  // Shared exponent: value = mantissa * 2^(exponent - 136).
  itn::write_file(folder / "a.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n" +
                                        std::string("\x80\x40\x20\x81\x80\x00\x00\x83", 8));
  CHECK(itn::read_bitmap(folder / "a.hdr").data == std::vector<float>{1, 0.5F, 0.25F, 4, 0, 0});
}

TEST_CASE("missing, foreign and truncated images are input errors") {
  const TemporaryFolder folder;
  CHECK_THROWS_AS(itn::read_bitmap(folder / "missing.png"), itn::InputError);
  itn::write_file(folder / "text.png", "this is text");
  CHECK_THROWS_WITH(itn::read_bitmap(folder / "text.png"), Catch::Contains("is no OpenEXR, PNG, JPEG"));
  itn::write_png(folder / "a.png", 64, 64, std::vector<std::uint8_t>(3 * 64 * 64, 99));
  const std::string bytes = itn::read_file(folder / "a.png");
  itn::write_file(folder / "cut.png", bytes.substr(0, bytes.size() / 2));
  CHECK_THROWS_AS(itn::read_bitmap(folder / "cut.png"), itn::InputError);
}

TEST_CASE("an HDR image that ends within its runs is refused and does not hang") {
  const TemporaryFolder folder;
  const std::string head = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 8\n\2\2" + std::string("\0\10", 2);
  itn::write_file(folder / "a.hdr", head + "\210\1\210\1\210\1\210\1");
  CHECK(itn::read_bitmap(folder / "a.hdr").data.size() == 24);
  itn::write_file(folder / "a.hdr", head + "\210\1\210\1\210\1");
  CHECK_THROWS_WITH(itn::read_bitmap(folder / "a.hdr"), Catch::Contains("a run of no pixels"));
}

TEST_CASE("images that stb_image reads are refused wherever they are cut") {
  const TemporaryFolder folder;
  const std::string bmp("BM\0\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0\4\0\0\0\2\0\0\0\1\0\x18\0", 30);
  const std::string tga("\4\0\2\0\0\0\0\0\0\0\0\0\4\0\2\0\x18\0name", 22),
      runs("\0\0\xa\0\0\0\0\0\0\0\0\0\4\0\2\0\x18\0", 18);
  const std::string palette("\0\1\1\0\0\2\0\x18\0\0\0\0\4\0\2\0\x8\0", 18);
  const std::string data = "the bytes of 8 pixels...";  // 24
  const std::map<std::string, std::string> files{
      {"a.pgm", "P5\n4 2\n255\n" + data.substr(0, 8)},
      {"b.ppm", "P6 # comment\n4 2\n200\n" + data},
      {"c.ppm", "P6\n2 2\n65535\n" + data},
      {"a.bmp", bmp + std::string(24, '\0') + data},
      {"a.tga", tga + data},
      {"runs.tga", runs +
                       "\x83"
                       "abc"
                       "\3" +
                       data.substr(0, 12)},
      {"palette.tga", palette + "abcdef" + std::string("\0\1\0\1\1\1\0\0", 8)},
      {"a.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 3\n" + data},
      {"wide.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 9\n" + data + "and more one"}};
  for (const auto& [name, whole] : files) {
    CAPTURE(name);
    itn::write_file(folder / name, whole);
    REQUIRE(!itn::read_bitmap(folder / name).data.empty());
    itn::write_file(folder / name, whole + "behind the end");
    CHECK(!itn::read_bitmap(folder / name).data.empty());
    for (std::size_t size = 0; size < whole.size(); ++size) {
      CAPTURE(size);
      itn::write_file(folder / name, whole.substr(0, size));
      CHECK_THROWS_WITH(itn::read_bitmap(folder / name), Catch::Contains(name));
    }
  }
}

TEST_CASE("an HDR image with runs in some rows alone is refused") {
  const TemporaryFolder folder;
  const std::string head = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 8\n",
                    row = std::string("\2\2\0\10", 4) + "\210\1\210\1\210\1\210\1";
  itn::write_file(folder / "a.hdr", head + row + row);
  CHECK(itn::read_bitmap(folder / "a.hdr").data.size() == 48);
  itn::write_file(folder / "a.hdr", head + row + std::string(100, 'a'));
  CHECK_THROWS_WITH(itn::read_bitmap(folder / "a.hdr"), Catch::Contains("row 1") && Catch::Contains("no runs"));
}

TEST_CASE("a PNM's samples are shares of its largest value, those of two bytes with the greater first") {
  const TemporaryFolder folder;
  const auto read = [&](const std::string& bytes) {
    itn::write_file(folder / "a.pgm", bytes);
    return itn::read_bitmap(folder / "a.pgm", true).data;
  };
  CHECK(read(std::string("P5\n3 1\n100\n\0\x32\x64", 16))[1] == Approx(0.5).margin(1e-5));
  CHECK(read("P5\n1 1\n100\n\x64")[0] == 1);
  const std::vector<float> deep = read(std::string("P5\n3 1\n1000\n\0\0\x01\xf4\x03\xe8", 18));
  CHECK(deep[0] == 0);
  CHECK(deep[1] == Approx(0.5).margin(1e-5));
  CHECK(deep[2] == 1);
  CHECK(read("P5\n1 1\n65535\n\x80\x01")[0] == Approx(0x8001 / 65535.0).margin(1e-6));
  CHECK_THROWS_WITH(read("P5\n1 1\n100\n\x65"), Catch::Contains("a sample is 101"));
  CHECK_THROWS_WITH(read(std::string("P5\n1 1\n0\n\0", 10)), Catch::Contains("largest value"));
}

TEST_CASE("a BMP's or a TGA's pixel of a colour beyond the palette is an error") {
  const TemporaryFolder folder;
  // Two colours; four pixels of eight, four and one bits.
  const auto bmp = [](int bits, const std::string& row) {
    std::string header("BM\0\0\0\0\0\0\0\0\x3e\0\0\0\x28\0\0\0\4\0\0\0\1\0\0\0\1\0\0\0", 30);
    header[28] = static_cast<char>(bits);
    return header + std::string(24, '\0') + std::string("abc\0def\0", 8) + row;
  };
  const auto read = [&](const std::string& name, const std::string& bytes) {
    itn::write_file(folder / name, bytes);
    return itn::read_bitmap(folder / name, true).data;
  };
  const std::string eight("\0\1\0\1", 4), four("\x01\x01\0\0", 4), one("\x50\0\0\0", 4);
  for (const auto& [bits, row] : {std::pair{8, eight}, {4, four}, {1, one}}) {
    CAPTURE(bits);
    const std::vector<float> values = read("a.bmp", bmp(bits, row));
    REQUIRE(values.size() == 12);
    CHECK(values[0] == Approx('c' / 255.0));
    CHECK(values[3] == Approx('f' / 255.0));
  }
  CHECK_THROWS_WITH(read("a.bmp", bmp(8, std::string("\0\1\2\1", 4))), Catch::Contains("of colour 2"));
  CHECK_THROWS_WITH(read("a.bmp", bmp(4, std::string("\x01\x02\0\0", 4))), Catch::Contains("of colour 2"));
  const std::string tga("\0\1\1\0\0\2\0\x18\0\0\0\0\4\0\1\0\x8\0", 18),
      runs("\0\1\x9\0\0\2\0\x18\0\0\0\0\4\0\1\0\x8\0", 18);
  CHECK(read("a.tga", tga + "abcdef" + eight)[3] == Approx('f' / 255.0));
  CHECK(read("a.tga", runs + "abcdef" + "\x83\1")[3] == Approx('f' / 255.0));
  CHECK_THROWS_WITH(read("a.tga", tga + "abcdef" + std::string("\0\1\2\1", 4)), Catch::Contains("of colour 2"));
  CHECK_THROWS_WITH(read("a.tga", runs + "abcdef" + "\x83\2"), Catch::Contains("of colour 2"));
}

TEST_CASE("a PNM whose size has too many digits is refused") {
  const TemporaryFolder folder;
  itn::write_file(folder / "a.pgm", "P5 # comment\n1 # another\n4294967297 255\nx");
  CHECK_THROWS_WITH(itn::read_bitmap(folder / "a.pgm"), Catch::Contains("a number of 10 digits"));
}

TEST_CASE("a PNG that promises more than it can hold, or with a wrong checksum, is refused") {
  const TemporaryFolder folder;
  itn::write_png(folder / "a.png", 2, 2, std::vector<std::uint8_t>(12, 100));
  const std::string whole = itn::read_file(folder / "a.png");
  std::string bomb = whole;
  bomb.replace(16, 8, std::string("\0\0\x2b\x67\0\0\x2b\x67", 8));  // 11111 x 11111
  itn::write_file(folder / "b.png", bomb);
  CHECK_THROWS_WITH(itn::read_bitmap(folder / "b.png"), Catch::Contains("more than its"));
  bomb.replace(16, 8, std::string("\0\0\x2e\xe0\0\0\x2e\xe0", 8));  // 12000 x 12000
  itn::write_file(folder / "b.png", bomb);
  CHECK_THROWS_WITH(itn::read_bitmap(folder / "b.png"), Catch::Contains("make it smaller"));
  for (const char* chunk : {"IHDR", "IDAT"}) {
    std::string flipped = whole;
    const std::size_t at = flipped.find(chunk) + 6;
    flipped[at] = static_cast<char>(flipped[at] ^ 1);
    itn::write_file(folder / "b.png", flipped);
    CHECK_THROWS_AS(itn::read_bitmap(folder / "b.png"), itn::InputError);
  }
}
