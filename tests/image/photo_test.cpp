// Pictures as cameras write them.
#include "itn/photo.h"

#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#define STBI_WRITE_NO_STDIO
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#include <stb/stb_image_write.h>
#pragma GCC diagnostic pop

#include <zlib.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <random>

#include "itn/bitmap.h"
#include "itn/error.h"
#include "itn/file.h"
#include "runtime/image/samples.h"
#include "runtime/image/srgb.h"
#include "tests/support/temporary_folder.h"

using namespace itn;

namespace {

using Catch::Contains;
using Bytes = std::vector<std::uint8_t>;

void append(void* context, void* data, int size) {
  static_cast<std::string*>(context)->append(static_cast<const char*>(data), static_cast<std::size_t>(size));
}

std::string png(int width, int height, int channels, const Bytes& samples) {
  std::string bytes;
  stbi_write_png_to_func(append, &bytes, width, height, channels, samples.data(), channels * width);
  return bytes;
}

std::string jpeg(int width, int height, int channels, const Bytes& samples) {
  std::string bytes;
  stbi_write_jpg_to_func(append, &bytes, width, height, channels, samples.data(), 95);
  return bytes;
}

template <class Number>
std::string little(Number value, std::size_t size) {
  std::string bytes;
  for (std::size_t i = 0; i < size; ++i) bytes += static_cast<char>(static_cast<std::uint64_t>(value) >> (8 * i));
  return bytes;
}

struct Tag {
  int name, value;
};

// One strip without compression; `more` replace the tags of their names or come on top.
std::string tiff(int width, int height, int channels, int bits, const std::string& samples,
                 std::vector<Tag> more = {}) {
  std::vector<Tag> tags{{256, width},
                        {257, height},
                        {258, bits},
                        {259, 1},
                        {262, channels < 3 ? 1 : 2},
                        {273, 8},
                        {277, channels},
                        {278, height},
                        {279, static_cast<int>(samples.size())}};
  if (channels == 2 || channels == 4) tags.push_back({338, 2});
  for (const Tag& tag : more) {
    const auto same = std::find_if(tags.begin(), tags.end(), [&](const Tag& t) { return t.name == tag.name; });
    if (same == tags.end())
      tags.push_back(tag);
    else
      same->value = tag.value;
  }
  std::sort(tags.begin(), tags.end(), [](const Tag& a, const Tag& b) { return a.name < b.name; });
  std::string bytes = "II*" + std::string(1, '\0') + little(8 + samples.size(), 4) + samples + little(tags.size(), 2);
  const std::size_t bits_at = bytes.size() + 12 * tags.size() + 4;
  for (const Tag& tag : tags) {
    const bool all = tag.name == 258 && channels > 2;  // a number for each sample, elsewhere
    bytes += little(tag.name, 2) + little(all ? 3 : 4, 2) + little(tag.name == 258 ? channels : 1, 4);
    bytes += all ? little(bits_at, 4) : channels == 2 && tag.name == 258 ? little(bits_at, 4) : little(tag.value, 4);
  }
  bytes += little(0, 4);
  for (int c = 0; c < channels; ++c) bytes += little(bits, channels == 2 ? 4 : 2);
  return bytes;
}

std::string words(const std::vector<int>& samples) {
  std::string bytes;
  for (const int s : samples) bytes += little(s, 2);
  return bytes;
}

Photo read(const std::string& bytes, const PhotoOptions& options = {}) {
  const TemporaryFolder folder;
  write_file(folder / "photo", bytes);
  return read_photo(folder / "photo", options);
}

std::string refusal(const std::string& bytes) {
  try {
    read(bytes);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

PhotoOptions with_curve(const std::string& text) { return {transfer_curve(text), 2}; }

}  // namespace

TEST_CASE("photos of 8 bits are decoded from sRGB, TIFFs of 16 bits are linear, unless another curve is given") {
  const Bytes samples{0, 64, 128, 192, 255, 10};
  for (const std::string& bytes :
       {png(2, 1, 3, samples), tiff(2, 1, 3, 8, std::string(samples.begin(), samples.end()))}) {
    const Photo photo = read(bytes, with_curve("auto")), linear = read(bytes, with_curve("linear")),
                power = read(bytes, with_curve("2.2"));
    REQUIRE(photo.width == 2);
    REQUIRE(photo.channels == 3);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      CHECK(photo.value[i] == Approx(srgb_decode(samples[i] / 255.0)).margin(1e-7));
      CHECK(linear.value[i] == Approx(samples[i] / 255.0).margin(1e-7));
      CHECK(power.value[i] == Approx(std::pow(samples[i] / 255.0, 2.2)).margin(1e-7));
    }
  }
  const std::string deep = tiff(2, 1, 1, 16, words({1, 40000}));
  CHECK(read(deep).value[1] == Approx(40000 / 65535.0));
  CHECK(read(deep, with_curve("srgb")).value[1] == Approx(srgb_decode(40000 / 65535.0)));
  for (const char* wrong : {"", "sRGB", "0.1", "6", "nan", "2.2x", "inf"})
    CHECK_THROWS_WITH(transfer_curve(wrong), Contains("need auto, srgb, linear, or an exponent"));
}

TEST_CASE("TIFFs of both byte orders, grey or colours, with and without alpha, compressed or not, are read") {
  CHECK(read(tiff(2, 1, 2, 8, "\x40\xff\x80\x7f")).weight[1] == Approx(127 / 255.0));
  const Photo alpha = read(tiff(1, 2, 4, 16, words({1, 2, 3, 65535, 4, 5, 6, 0})));
  CHECK(alpha.has_alpha);
  CHECK(alpha.weight == std::vector<float>{1, 0});
  CHECK(alpha.value[3] == Approx(4 / 65535.0));
  const std::string big(
      "MM\0*\0\0\0\x0a\x12\x34"  // one sample, then the directory
      "\0\x08\x01\0\0\4\0\0\0\1\0\0\0\1\x01\1\0\4\0\0\0\1\0\0\0\1\x01\2\0\3\0\0\0\1\0\x10\0\0"
      "\x01\3\0\3\0\0\0\1\0\1\0\0\x01\6\0\3\0\0\0\1\0\1\0\0\x01\x11\0\4\0\0\0\1\0\0\0\x08"
      "\x01\x15\0\3\0\0\0\1\0\1\0\0\x01\x17\0\4\0\0\0\1\0\0\0\2\0\0\0\0",
      10 + 2 + 8 * 12 + 4);
  CHECK(read(big).value[0] == Approx(0x1234 / 65535.0));
  const std::string packed("\xfd\x40", 2);  // PackBits: four times 0x40
  const Photo grey = read(tiff(4, 1, 1, 8, packed, {{259, 32773}}));
  CHECK(grey.value == std::vector<float>(4, static_cast<float>(srgb_decode(64 / 255.0))));
}

TEST_CASE("what libtiff warns of is an error where pixels are a guess, and passes where it is about other tags") {
  Bytes samples;
  for (int i = 0; i < 32 * 24 * 3; ++i) samples.push_back(static_cast<std::uint8_t>((i * i) % 251));
  const auto in_jpeg = [](const std::string& strip) { return tiff(32, 24, 3, 8, strip, {{259, 7}, {262, 6}}); };
  const std::string strip = jpeg(32, 24, 3, samples);
  REQUIRE(read(in_jpeg(strip)).value == read(strip).value);  // without the tag of its subsampling, of which it warns
  int cut = 0, changed = 0;
  for (std::size_t left = 3; left < strip.size() / 2; left += 7, ++cut)
    CHECK_THAT(refusal(in_jpeg(strip.substr(0, strip.size() - left))), Contains("JPEG"));
  CHECK(cut > 10);
  for (std::size_t at = strip.size() - 200; at < strip.size() - 4; at += 3) {
    std::string wrong = strip;
    wrong.replace(at, 2, "\xff\xd5");  // a marker in the middle of the data
    changed += refusal(in_jpeg(wrong)).find("is damaged; JPEGLib: Corrupt JPEG data") != std::string::npos;
  }
  CHECK(changed > 50);

  // PackBits: runs that go on in the next row; too few bytes.
  const std::string packed("\xfd\x40\xfd\x50", 4);
  CHECK(read(tiff(4, 2, 1, 8, packed, {{259, 32773}})).value.size() == 8);
  CHECK_THAT(refusal(tiff(2, 4, 1, 8, packed, {{259, 32773}})), Contains("PackBitsDecode: Discarding"));
  CHECK_THAT(refusal(tiff(4, 2, 1, 8, packed.substr(0, 3), {{259, 32773}})), Contains("PackBitsDecode"));

  // Bytes of strips that do not fit; of a kind that it does not know, as of cameras; in another order; without an end.
  CHECK_THAT(refusal(tiff(4, 2, 1, 8, "abcdefgh", {{279, 0}})), Contains("StripByteCounts"));
  const std::string plain = tiff(4, 2, 1, 8, "abcdefgh");
  for (const Tag tag : {Tag{50000, 7}, Tag{34665, 8}, Tag{33550, 8}, Tag{42113, 8}, Tag{271, 0x64636261}}) {
    CAPTURE(tag.name);
    CHECK(read(tiff(4, 2, 1, 8, "abcdefgh", {tag})).value == read(plain).value);
  }
  std::string unsorted = plain;
  const std::size_t directory = 8 + 8 + 2;
  std::swap_ranges(unsorted.begin() + directory, unsorted.begin() + directory + 12, unsorted.begin() + directory + 12);
  CHECK(read(unsorted).value == read(plain).value);
}

TEST_CASE("a TIFF's compressed strip whose checksum is wrong is refused") {
  const std::string head("\x78\x01\x01\x08\0\xf7\xff", 7), sum("\x0e\x00\x03\x25", 4);  // stored as it is
  CHECK(read(tiff(4, 2, 1, 8, head + "abcdefgh" + sum, {{259, 8}})).value[7] ==
        read(tiff(4, 2, 1, 8, "abcdefgh")).value[7]);
  CHECK_THAT(refusal(tiff(4, 2, 1, 8, head + "abcdefgi" + sum, {{259, 8}})), Contains("strip 0") && Contains("check"));
  CHECK_THAT(refusal(tiff(4, 2, 1, 8, head + "abcdefgh" + sum.substr(0, 2), {{259, 8}})), Contains("end early"));
}

TEST_CASE("TIFFs of kinds that are not read are refused, with what to do") {
  const std::string one = words({1, 2, 3});
  CHECK_THAT(refusal(tiff(1, 1, 3, 32, one + one)), Contains("whole numbers of 8 or 16 bits"));
  CHECK_THAT(refusal(tiff(1, 1, 3, 16, one, {{339, 3}})), Contains("kind 3") && Contains("OpenEXR"));
  CHECK_THAT(refusal(tiff(1, 1, 1, 8, "a", {{262, 8}})), Contains("need grey or RGB"));
  CHECK_THAT(refusal(tiff(1, 1, 3, 16, one, {{284, 2}})), Contains("a plane for each colour"));
  CHECK_THAT(refusal(tiff(1, 1, 4, 8, "abcd", {{338, 1}})), Contains("straight (unassociated) alpha"));
  CHECK_THAT(refusal(tiff(1, 1, 3, 16, one, {{259, 50000}})), Contains("need none, LZW"));
  CHECK_THAT(refusal(tiff(9000, 9000, 3, 8, "abc")), Contains("promises 9000 x 9000 pixels"));
  CHECK_THAT(refusal(tiff(90000, 90000, 3, 8, "abc")), Contains("make it smaller"));
}

namespace {

std::string chunk(const std::string& type, const std::string& data) {
  const auto big = [](std::uint32_t value) {
    std::string bytes;
    for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(value >> shift);
    return bytes;
  };
  const std::string both = type + data;
  const auto sum = crc32(0, reinterpret_cast<const Bytef*>(both.data()), static_cast<uInt>(both.size()));
  return big(static_cast<std::uint32_t>(data.size())) + both + big(static_cast<std::uint32_t>(sum));
}

// data: of rows with a filter each, without compression.
std::string png_of(int width, int height, int bits, int type, const std::string& rows, const std::string& before = "",
                   int wrong_sum = 0) {
  const std::string header{0,
                           0,
                           0,
                           static_cast<char>(width),
                           0,
                           0,
                           0,
                           static_cast<char>(height),
                           static_cast<char>(bits),
                           static_cast<char>(type),
                           0,
                           0,
                           0};
  const auto size = static_cast<unsigned>(rows.size());
  auto sum = adler32(1, reinterpret_cast<const Bytef*>(rows.data()), size) + static_cast<uLong>(wrong_sum);
  std::string data("\x78\x01\x01", 3);
  data += little(size, 2) + little(~size & 0xffffU, 2) + rows;
  for (int shift = 24; shift >= 0; shift -= 8) data += static_cast<char>(sum >> shift);
  return "\x89PNG\r\n\x1a\n" + chunk("IHDR", header) + before + chunk("IDAT", data) + chunk("IEND", "");
}

}  // namespace

TEST_CASE(
    "a PNG that is not whole is refused wherever it is cut, and one whose compressed data say that they are wrong") {
  const std::string rows("\0abc\0def", 8), whole = png_of(3, 2, 8, 0, rows);
  REQUIRE(read(whole).value.size() == 6);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    CAPTURE(size, whole.size());
    CHECK_THAT(refusal(whole.substr(0, size)), Contains("photo: "));
  }
  CHECK(read(whole + "behind the end").value.size() == 6);
  CHECK_THAT(refusal(png_of(3, 2, 8, 0, rows, "", 1)), Contains("incorrect data check"));
  CHECK_THAT(refusal(png_of(3, 2, 8, 0, rows, chunk("CgBI", "abcd"))), Contains("Apple"));
  CHECK_THAT(refusal(png_of(3, 2, 8, 0, rows.substr(0, 7))), Contains("damaged"));
}

TEST_CASE("a pixel of a colour that the palette does not have is an error") {
  const std::string palette = chunk("PLTE", "abcdef");  // two colours
  for (const int bits : {1, 2, 4, 8}) {
    CAPTURE(bits);
    const std::string good = std::string(1, '\0') + static_cast<char>(1 << (8 - bits)), bad = std::string("\0\xff", 2);
    CHECK(read(png_of(1, 1, bits, 3, good, palette)).value.size() == 3);
    CHECK(read(png_of(1, 1, bits, 3, good, palette + chunk("tRNS", "\x80\x80"))).has_alpha);
    if (bits > 1) CHECK_THAT(refusal(png_of(1, 1, bits, 3, bad, palette)), Contains("its palette has 2"));
    if (bits > 1)
      CHECK_THAT(refusal(png_of(1, 1, bits, 3, bad, palette + chunk("tRNS", "\x80"))), Contains("its palette has 2"));
  }
}

TEST_CASE("damaged photos of every kind are input errors, or pictures; never anything else") {
  Bytes samples;
  for (int i = 0; i < 16 * 12 * 3; ++i) samples.push_back(static_cast<std::uint8_t>(i * 37));
  const std::vector<std::string> files{png(16, 12, 3, samples), jpeg(16, 12, 3, samples),
                                       tiff(16, 12, 3, 8, std::string(samples.begin(), samples.end()))};
  std::mt19937 random(3);
  for (const std::string& whole : files) {
    CHECK(read(whole).width == 16);
    int tried = 0, refused = 0;
    for (std::size_t length = 0; length + 16 < whole.size(); length += 1 + whole.size() / 40, ++tried)
      refused += refusal(whole.substr(0, length)).find("photo: ") != std::string::npos;
    CHECK(refused == tried);
    for (int k = 0; k < 200; ++k) {
      std::string flipped = whole;
      for (int n = 0; n < 3; ++n) flipped[random() % flipped.size()] = static_cast<char>(random());
      CHECK_NOTHROW(refusal(flipped));
    }
  }
  CHECK_THAT(refusal("no picture at all"), Contains("is no OpenEXR, PNG, JPEG, TIFF"));
}

TEST_CASE("saturated pixels weigh nothing, in any of their channels, and their share is told") {
  const std::string bytes = png(4, 1, 3, {255, 0, 0, 0, 252, 0, 0, 0, 253, 9, 9, 9});
  const Photo photo = read(bytes);
  CHECK(photo.weight == std::vector<float>{0, 1, 0, 1});
  CHECK(photo.saturated == 0.5);
  CHECK(read(bytes, {{}, 0.9}).weight == std::vector<float>{0, 0, 0, 1});
  CHECK(read(bytes, {{}, 2}).weight == std::vector<float>{1, 1, 1, 1});
}

TEST_CASE("alpha weighs the pixels; nothing but transparent ones are refused") {
  const Photo photo = read(png(3, 1, 4, {9, 9, 9, 255, 9, 9, 9, 51, 255, 9, 9, 0}));
  CHECK(photo.has_alpha);
  CHECK(photo.weight[0] == 1);
  CHECK(photo.weight[1] == Approx(0.2));
  CHECK(photo.weight[2] == 0);
  CHECK(photo.saturated == 0);  // what is transparent does not count
  CHECK_THAT(refusal(png(1, 1, 4, {9, 9, 9, 0})), Contains("alpha is 0 everywhere"));
}

TEST_CASE("a photo is turned as EXIF and TIFF say") {
  // 2 x 3:  0 1 / 2 3 / 4 5
  const Samples stored{2, 3, 1, 8, false, 1, {0, 1, 2, 3, 4, 5}};
  const std::vector<std::vector<std::uint16_t>> seen{{0, 1, 2, 3, 4, 5}, {1, 0, 3, 2, 5, 4}, {5, 4, 3, 2, 1, 0},
                                                     {4, 5, 2, 3, 0, 1}, {0, 2, 4, 1, 3, 5}, {4, 2, 0, 5, 3, 1},
                                                     {5, 3, 1, 4, 2, 0}, {1, 3, 5, 0, 2, 4}};
  for (int k = 1; k <= 8; ++k) {
    Samples turned = stored;
    turned.orientation = k;
    turned = oriented(turned);
    CHECK(turned.width == (k <= 4 ? 2 : 3));
    CHECK(turned.data == seen[static_cast<std::size_t>(k) - 1]);
  }
  CHECK(read(tiff(2, 1, 1, 16, words({1, 2}), {{274, 6}})).height == 2);

  // 16 x 8, the left half white.
  Bytes samples;
  for (int i = 0; i < 16 * 8; ++i) samples.push_back(i % 16 < 8 ? 200 : 20);
  const std::string plain = jpeg(16, 8, 1, samples);
  for (const bool motorola : {false, true}) {
    const std::string exif = motorola ? std::string("MM\0*\0\0\0\x08\0\1\x01\x12\0\3\0\0\0\1\0\6\0\0\0\0\0\0", 26)
                                      : std::string("II*\0\x08\0\0\0\1\0\x12\x01\3\0\1\0\0\0\6\0\0\0\0\0\0\0", 26);
    const std::string block = std::string("Exif\0\0", 6) + exif;
    const std::string length{'\0', static_cast<char>(block.size() + 2)};
    const Photo photo = read(plain.substr(0, 2) + "\xff\xe1" + length + block + plain.substr(2));
    REQUIRE(photo.width == 8);
    REQUIRE(photo.height == 16);  // row 0 is what was on the left
    CHECK(photo.value[0] > 10 * photo.value[8 * 15 * static_cast<std::size_t>(photo.channels)]);
    // A PNG's block has no name before it; some writers give it one. It may stand behind the pixels, too.
    for (const std::string& named : {exif, block})
      for (const bool behind : {false, true}) {
        std::string turned = png(16, 8, 1, samples);
        turned.insert(behind ? turned.size() - 12 : 33, chunk("eXIf", named));
        const Photo of_png = read(turned);
        REQUIRE(of_png.width == 8);
        REQUIRE(of_png.height == 16);
        CHECK(of_png.value[0] > 10 * of_png.value[8 * 15]);
      }
  }
}

TEST_CASE(
    "a larger photo is averaged over boxes: its light stays, its noise falls, a part of a pixel is not the whole") {
  Photo photo{6, 4, 1, {}, std::vector<float>(24, 1), std::vector<float>(24, 0.1F)};
  for (int i = 0; i < 24; ++i) photo.value.push_back(static_cast<float>(i));
  photo.weight[0] = 0;
  photo.weight[9] = 0.5F;
  const Photo half = averaged_down(photo, 3, 2, "photo");
  CHECK(half.value == std::vector<float>{3.5F, 5.5F, 7.5F, 15.5F, 17.5F, 19.5F});
  CHECK(half.weight == std::vector<float>{0, 0.5F, 1, 1, 1, 1});
  for (const float noise : half.noise) CHECK(noise == Approx(0.05));
  // 6 : 4 pixels as 4 : 3 (2.67 of them high, which is 3 to half a pixel): boxes of parts of pixels.
  const Photo parts = averaged_down(photo, 4, 3, "photo");
  double sum = 0;
  for (const float value : parts.value) sum += value;
  CHECK(sum / 12 == Approx(11.5));
  CHECK(parts.value[0] == Approx((0 + 1 * 0.5 + (6 + 7 * 0.5) / 3) / 1.5 / (4.0 / 3)));
  CHECK(averaged_down(photo, 6, 4, "photo").value == photo.value);
  CHECK_THROWS_WITH(averaged_down(photo, 3, 3, "a.png"), Contains("a.png: 6 x 4 pixels, need 3 x 3"));
  CHECK_THROWS_WITH(averaged_down(photo, 12, 8, "a.png"), Contains("cut it, or set the film's size"));
}

TEST_CASE("the noise of a photo is found in it: rounding where nothing else is, and that of photons", "[stat]") {
  constexpr int side = 200;
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (const double gain : {0.0, 1.0 / 4000, 1.0 / 500}) {
    Bytes samples;
    for (int y = 0; y < side; ++y)
      for (int x = 0; x < side; ++x) {
        // slopes, and an edge
        const double value = (0.1 + 0.6 * x / side) * (y > side / 2 ? 1 : 0.5) + 0.02 * std::sin(0.05 * y);
        const double noisy = std::clamp(value + std::sqrt(gain * value) * normal(random), 0.0, 1.0);
        samples.push_back(static_cast<std::uint8_t>(std::lround(255 * srgb_encode(noisy))));
      }
    const Photo photo = read(png(side, side, 1, samples));
    double ratio = 0;
    for (std::size_t i = 0; i < photo.value.size(); ++i) {
      const double sample = samples[i] / 255.0,
                   slope = (srgb_decode(sample + 1e-4) - srgb_decode(sample - 1e-4)) / 2e-4;
      const double expected = std::pow(slope / 255, 2) / 12 + gain * static_cast<double>(photo.value[i]);
      ratio += std::pow(photo.noise[i], 2) / expected / (side * side);
    }
    CAPTURE(gain);
    CHECK(ratio == Approx(1).epsilon(gain == 0 ? 0.35 : 0.1));
  }
}

TEST_CASE("a TIFF is a texture, too") {
  const TemporaryFolder folder;
  write_file(folder / "a.tif", tiff(2, 1, 3, 8, std::string("\xff\0\0\0\0\x80", 6)));
  const Bitmap bitmap = read_bitmap(folder / "a.tif");
  CHECK(bitmap.channels == 3);
  CHECK(bitmap.data[0] == 1);
  CHECK(bitmap.data[5] == Approx(srgb_decode(128 / 255.0)));
}
