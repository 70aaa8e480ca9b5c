// Safetensors files byte by byte, and what is refused.
#include "itn/safetensors.h"

#include <catch2/catch.hpp>
#include <cstring>
#include <limits>

#include "itn/error.h"
#include "runtime/base/random.h"

namespace {

using namespace itn;
using Catch::Contains;

// A file from its header and data; the length stands in front, little-endian.
std::string file_of(const std::string& header, const std::string& data) {
  std::string bytes;
  for (int byte = 0; byte < 8; ++byte) bytes += static_cast<char>(header.size() >> (8 * byte) & 255);
  return bytes + header + data;
}

std::string message(const std::string& bytes) {
  try {
    parse_safetensors(bytes, "some.safetensors");
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

const Safetensors two_arrays{{{"a", {2}, {1.0f, -2.0f}}, {"b.c", {1, 2}, {0.5f, 65504.0f}}}, {{"format", "test"}}};

}  // namespace

TEST_CASE("A safetensors file of single precision has the documented bytes") {
  // 1 = 3f800000, -2 = c0000000, 0.5 = 3f000000, 65504 = 477fe000
  const std::string data("\x00\x00\x80\x3f\x00\x00\x00\xc0\x00\x00\x00\x3f\x00\xe0\x7f\x47", 16);
  std::string header = R"({"__metadata__":{"format":"test"},"a":{"dtype":"F32","shape":[2],"data_offsets":[0,8]},)"
                       R"("b.c":{"dtype":"F32","shape":[1,2],"data_offsets":[8,16]}})";
  header.resize((header.size() + 7) / 8 * 8, ' ');
  CHECK(safetensors_bytes(two_arrays, Precision::single) == file_of(header, data));
}

TEST_CASE("A safetensors file of half precision is read") {
  // 1 = 3c00, -2 = c000, 0.1 = 2e66 when rounded, 65504 = 7bff, the largest, and 2^-24 = 0001, the least
  const std::string data("\x00\x3c\x00\xc0\x66\x2e\xff\x7b\x01\x00", 10);
  const Safetensors read =
      parse_safetensors(file_of(R"({"x":{"dtype":"F16","shape":[5],"data_offsets":[0,10]}})", data), "f");
  CHECK(read.tensor("x", "f").values == std::vector<float>{1.0f, -2.0f, 0.0999755859375f, 65504.0f, 0x1p-24f});
}

TEST_CASE("A safetensors file of bytes has the documented ones: whole numbers, and a scale for each row") {
  const Safetensors arrays{{{"w", {2, 2}, {-2.0f, 0.5f, 0.0f, 0.0f}}, {"b", {2}, {1.0f, -2.0f}}}, {}};
  const std::string bytes = safetensors_bytes(arrays, Precision::byte);
  // 2 / 127 = 3c810204, and of zeros 0; 1 = 3f800000, -2 = c0000000; then -127, 0.5 * 127 / 2 = 32, 0, 0.
  CHECK(bytes.substr(bytes.size() - 20) == std::string("\x04\x02\x81\x3c\x00\x00\x00\x00"
                                                       "\x00\x00\x80\x3f\x00\x00\x00\xc0\x81\x20\x00\x00",
                                                       20));
  CHECK_THAT(bytes, Contains(R"("w.scale":{"dtype":"F32","shape":[2],"data_offsets":[0,8]})"));
  CHECK_THAT(bytes, Contains(R"("w":{"dtype":"I8","shape":[2,2],"data_offsets":[16,20]})"));
  const Safetensors read = parse_safetensors(bytes, "f");
  REQUIRE(read.tensors.size() == 2);
  CHECK(read.tensor("b", "f").values == arrays.tensors[1].values);
  const std::vector<float> rounded = read.tensor("w", "f").values;
  CHECK(rounded[0] == Approx(-2));
  CHECK(rounded[1] == Approx(0.5).margin(1 / 127.0));
  CHECK((rounded[2] == 0 && rounded[3] == 0));
}

TEST_CASE("In a file of bytes a row that is nearly 0 keeps its signs") {
  // 200 and -50 of the least number above 0: one 127th of 200 of them is 1.57 of them, which is stored as 2.
  const float least = std::numeric_limits<float>::denorm_min();
  const Safetensors arrays{{{"w", {2, 2}, {200 * least, -50 * least, 1.0f, 1.0f}}}, {}};
  const std::vector<float> read = parse_safetensors(safetensors_bytes(arrays, Precision::byte), "f").tensors[0].values;
  CHECK(read[0] == 200 * least);
  CHECK(read[1] == -50 * least);
  // A 127th of 180 is 1.42, which is stored as 1, and 180 is no byte.
  const Safetensors too_large{{{"w", {2, 2}, {180 * least, -180 * least, 1.0f, 1.0f}}}, {}};
  const std::vector<float> cut =
      parse_safetensors(safetensors_bytes(too_large, Precision::byte), "f").tensors[0].values;
  CHECK(cut[0] == 127 * least);
  CHECK(cut[1] == -127 * least);
}

TEST_CASE("Bytes without a scale for each row are an input error") {
  const std::string w = R"("w":{"dtype":"I8","shape":[2,2],"data_offsets":[8,12]})", bytes(4, '\x01');
  const auto with = [&](const std::string& scale, const std::string& data) {
    return message(file_of("{" + scale + "," + w + "}", data + bytes));
  };
  CHECK(with(R"("w.scale":{"dtype":"F32","shape":[2],"data_offsets":[0,8]})", std::string(8, '\0')) == "accepted");
  CHECK_THAT(with(R"("v.scale":{"dtype":"F32","shape":[2],"data_offsets":[0,8]})", std::string(8, '\0')),
             Contains("array 'w' is of type I8, which needs an array 'w.scale' of type F32"));
  CHECK_THAT(with(R"("w.scale":{"dtype":"I8","shape":[8],"data_offsets":[0,8]})", std::string(8, '\0')),
             Contains("of type F32"));
  CHECK_THAT(with(R"("w.scale":{"dtype":"F32","shape":[2,1],"data_offsets":[0,8]})", std::string(8, '\0')),
             Contains("one number for each row of 'w'"));
  CHECK_THAT(with(R"("w.scale":{"dtype":"F32","shape":[2],"data_offsets":[0,8]})",
                  std::string("\xff\xff\x7f\x7f\x00\x00\xc0\x7f", 8)),
             Contains("not finite"));
}

TEST_CASE("What was written with single precision is read back to the bit") {
  const Safetensors original{{{"x", {3}, {0.1f, 1e-30f, -3.4e38f}}, {"scalar", {}, {7.0f}}, {"empty", {0, 4}, {}}},
                             {{"k", "ü \"quoted\""}}};
  const Safetensors read = parse_safetensors(safetensors_bytes(original, Precision::single), "f");
  REQUIRE(read.tensors.size() == 3);
  CHECK(read.tensor("x", "f").values == original.tensors[0].values);
  CHECK(read.tensor("scalar", "f").values == std::vector<float>{7.0f});
  CHECK(read.tensor("scalar", "f").shape.empty());
  CHECK(read.tensor("empty", "f").shape == std::vector<std::size_t>{0, 4});
  CHECK(read.metadata == original.metadata);
}

TEST_CASE("Numbers that are not finite are not written") {
  for (const float wrong : {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()})
    for (const Precision precision : {Precision::single, Precision::byte})
      CHECK_THROWS_AS(safetensors_bytes({{{"x", {2, 1}, {1.0f, wrong}}}, {}}, precision), ResultError);
}

TEST_CASE("A file cut short anywhere, or with more at its end, is an input error") {
  const std::string bytes = safetensors_bytes(two_arrays, Precision::single);
  REQUIRE_NOTHROW(parse_safetensors(bytes, "f"));
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    INFO(length);
    CHECK_THROWS_AS(parse_safetensors(bytes.substr(0, length), "f"), InputError);
  }
  CHECK_THAT(message(bytes + "x"), Contains("some.safetensors: its arrays should have 16 bytes, and 17 are there"));
  CHECK_THAT(message(bytes.substr(0, 7)), Contains("truncated safetensors file of 7 bytes"));
}

TEST_CASE("A wrong header is an input error that says what is wrong") {
  const std::string data(8, '\0');
  const auto entry = [&](const std::string& text) { return message(file_of("{\"x\":" + text + "}", data)); };
  CHECK(entry(R"({"dtype":"F32","shape":[2],"data_offsets":[0,8]})") == "accepted");
  CHECK_THAT(entry(R"({"dtype":"F64","shape":[1],"data_offsets":[0,8]})"), Contains("type F64"));
  CHECK_THAT(entry(R"({"dtype":"F32","shape":[3],"data_offsets":[0,8]})"), Contains("larger than its place"));
  CHECK_THAT(entry(R"({"dtype":"F32","shape":[1],"data_offsets":[0,8]})"), Contains("does not fill its place"));
  CHECK_THAT(entry(R"({"dtype":"F16","shape":[3],"data_offsets":[0,7]})"), Contains("does not fill its place"));
  CHECK_THAT(entry(R"({"dtype":"F32","shape":[4294967296,4294967296,1],"data_offsets":[0,8]})"), Contains("larger"));
  CHECK_THAT(entry(R"({"dtype":"F32","shape":[1],"data_offsets":[4,8]})"), Contains("leaves a gap"));
  CHECK_THAT(entry(R"({"dtype":"F32","shape":[1],"data_offsets":[0,4]})"), Contains("should have 4 bytes"));
  CHECK_THAT(entry(R"({"dtype":"F32","shape":[2],"data_offsets":[8,0]})"), Contains("no valid place"));
  CHECK_THAT(entry(R"({"dtype":"F32","shape":[2],"data_offsets":[0,8,9]})"), Contains("no valid place"));
  CHECK_THAT(entry(R"({"dtype":"F32","shape":[-2],"data_offsets":[0,8]})"), Contains("whole number"));
  CHECK_THAT(entry(R"({"dtype":"F32","shape":[2.5],"data_offsets":[0,8]})"), Contains("whole number"));
  CHECK_THAT(entry(R"({"dtype":"F32","shape":2,"data_offsets":[0,8]})"), Contains("list of whole numbers"));
  CHECK_THAT(entry(R"({"dtype":"F32","shape":[2,0],"data_offsets":[0,8]})"), Contains("does not fill"));
  CHECK_THAT(entry(R"({"shape":[2],"data_offsets":[0,8]})"), Contains("dtype"));
  CHECK_THAT(entry("7"), Contains("no valid safetensors header"));
  CHECK_THAT(message(file_of("{\"x\":", data)), Contains("no valid safetensors header"));
  CHECK_THAT(message(file_of("[]", "")), Contains("no valid safetensors header"));
  CHECK_THAT(message(file_of(R"({"__metadata__":{"k":1}})", "")), Contains("no valid safetensors header"));
  CHECK_THAT(message(file_of(R"({"x":{"dtype":"F32","shape":[2],"data_offsets":[0,8]},)"
                             R"("y":{"dtype":"F32","shape":[1],"data_offsets":[4,8]}})",
                             data)),
             Contains("overlaps another"));
  CHECK_THAT(message(std::string(8, '\xff') + "{}"), Contains("truncated or no safetensors file"));
}

TEST_CASE("Numbers that are not finite are an input error") {
  const std::string nan("\x00\x00\xc0\x7f", 4), half_infinity("\x00\x7c", 2);
  CHECK_THAT(message(file_of(R"({"x":{"dtype":"F32","shape":[1],"data_offsets":[0,4]}})", nan)),
             Contains("not finite"));
  CHECK_THAT(message(file_of(R"({"x":{"dtype":"F16","shape":[1],"data_offsets":[0,2]}})", half_infinity)),
             Contains("not finite"));
}

TEST_CASE("A damaged file is read, or refused as an input error; nothing else happens") {
  const Safetensors arrays{{two_arrays.tensors[0], {"w", {2, 2}, {1.0f, 2.0f, 3.0f, -4.0f}}}, two_arrays.metadata};
  const std::string bytes = safetensors_bytes(arrays, Precision::byte);
  int refused = 0;
  constexpr int trials = 3000;
  for (std::uint64_t trial = 0; trial < trials; ++trial) {
    std::string damaged = bytes;
    for (std::uint64_t change = 0; change <= trial % 3; ++change) {
      const std::uint64_t random = random_bits(1, trial, change);
      damaged[random % damaged.size()] = static_cast<char>(random >> 40);
    }
    try {
      parse_safetensors(damaged, "f");
    } catch (const InputError&) {
      ++refused;
    }
  }
  // Most of the file is header, where hardly a byte can change unnoticed; a change in names, metadata or numbers can.
  CHECK(refused > trials / 2);
  CHECK(refused < trials);
}
