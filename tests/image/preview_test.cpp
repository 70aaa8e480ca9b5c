#include "runtime/image/preview.h"

#include <catch2/catch.hpp>
#include <cmath>

TEST_CASE("tone mapping does not depend on the unit of radiance") {
  std::vector<float> data;
  for (int i = 0; i < 3000; ++i) data.push_back(static_cast<float>(i % 97));
  std::vector<float> scaled = data;
  for (float& x : scaled) x *= 1024;
  CHECK(itn::tone_mapped(data, 3) == itn::tone_mapped(scaled, 3));
}

TEST_CASE("a few fireflies do not darken the picture and brighter stays brighter") {
  std::vector<float> data;
  for (int i = 0; i < 1000; ++i) data.push_back(static_cast<float>(i));
  std::vector<float> spiked = data;
  spiked[3] = 1e9f;
  const auto plain = itn::tone_mapped(data, 1), with = itn::tone_mapped(spiked, 1);
  CHECK(std::abs(plain[3 * 500] - with[3 * 500]) <= 1);
  CHECK(with[3 * 3] == 255);
  for (std::size_t i = 1; i < 1000; ++i) REQUIRE(plain[3 * i] >= plain[3 * (i - 1)]);
}

TEST_CASE("pixels that are not finite stand out") {
  const auto bytes = itn::tone_mapped({1, 1, 1, NAN, 1, 1}, 3);
  CHECK(std::vector<std::uint8_t>(bytes.begin() + 3, bytes.end()) == std::vector<std::uint8_t>{255, 0, 255});
  const auto signed_bytes = itn::red_blue({1, NAN}, 1).bytes;
  CHECK(std::vector<std::uint8_t>(signed_bytes.begin() + 3, signed_bytes.end()) ==
        std::vector<std::uint8_t>{0, 255, 0});
}

TEST_CASE("signed data: white at zero, red above, blue below, symmetric") {
  const auto picture = itn::red_blue({0, 2, -2, 1, -1}, 1);
  CHECK(picture.scale == 2);
  CHECK(picture.bytes == std::vector<std::uint8_t>{255, 255, 255, 255, 0, 0, 0, 0, 255, 255, 128, 128, 128, 128, 255});
}

TEST_CASE("signed data: a few outliers and a large background of zeros leave the colours of the rest") {
  std::vector<float> data(100000, 0.0f);
  for (std::size_t i = 0; i < 1000; ++i) data[i] = i < 5 ? 1e6f : i % 2 ? 3.0f : -3.0f;
  const auto picture = itn::red_blue(data, 1);
  CHECK(picture.scale == 3);
  CHECK(std::vector<std::uint8_t>(picture.bytes.begin() + 3 * 10, picture.bytes.begin() + 3 * 12) ==
        std::vector<std::uint8_t>{0, 0, 255, 255, 0, 0});
}

TEST_CASE("signed colours: the mean of the channels decides") {
  const auto picture = itn::red_blue({3, -1, -2, 3, 3, 3}, 3);
  CHECK(picture.scale == 3);
  CHECK(picture.bytes == std::vector<std::uint8_t>{255, 255, 255, 255, 0, 0});
}

TEST_CASE("a black picture and an all-zero derivative are drawn") {
  CHECK(itn::tone_mapped({0, 0, 0}, 3) == std::vector<std::uint8_t>{0, 0, 0});
  CHECK(itn::red_blue({0, 0, 0}, 3).bytes == std::vector<std::uint8_t>{255, 255, 255});
}
