// texture/texture.h at checkerboards: the record's to_uv, Mitsuba's rule for the squares, and the colours.
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>

#include "../support/lane_function.h"
#include "kernels/model/texture/list.h"

using namespace itn::test;

namespace {

constexpr int model_numbers = 5;  // of a made-up model, whose colour stands in slots 0 to 2
const std::array<float, 3> colour_0{0.1F, 0.2F, 0.3F}, colour_1{0.7F, 0.8F, 0.9F};

// The third and fourth column begin with the bytes of a record, and with numbers.
const LaneFunction lookup{{"texture/texture.h"}, {"u", "v", "record", "numbers"}, {"r", "g", "b", "colour"}, R"(
  Lanes x, y, rgb[3], which;
  x.real = u;
  y.real = v;
  for (int l = 0; l < WIDTH; ++l) {
    float value[3];
    which.f[l] = texture_value((__global const TextureRecord*)(in_ + 2 * count_), in_, in_ + 3 * count_,
                               (TexturePlace){x.f[l], y.f[l]}, value);
    for (int c = 0; c < 3; ++c) rgb[c].f[l] = value[c];
  }
  r = rgb[0].real; g = rgb[1].real; b = rgb[2].real;
  colour = which.real;)"};

Columns look_up(int width, const std::array<float, 6>& to_uv, const std::vector<float>& u,
                const std::vector<float>& v) {
  TextureRecord record{};
  record.kind = TEXTURE_checkerboard;
  std::copy(to_uv.begin(), to_uv.end(), record.to_uv);
  record.numbers = model_numbers;
  std::vector<float> bytes(u.size()), numbers(u.size(), -1.0F);
  REQUIRE(bytes.size() * sizeof(float) > sizeof record);
  std::memcpy(bytes.data(), &record, sizeof record);
  std::copy(colour_0.begin(), colour_0.end(), numbers.begin() + model_numbers);
  std::copy(colour_1.begin(), colour_1.end(), numbers.begin() + 2 * model_numbers);
  return run_lanes(lookup, width, {u, v, bytes, numbers});
}

// Is a coordinate, after to_uv, in the second half of its unit?
bool second_half(double x) { return x - std::floor(x) > 0.5; }

double to_border(double x) { return std::abs(2 * x - std::round(2 * x)) / 2; }

// Is row i of the columns that colour, in all of them?
bool shows(const Columns& out, std::size_t i, int colour) {
  const std::array<float, 3>& rgb = colour == 1 ? colour_0 : colour_1;
  return out[0][i] == rgb[0] && out[1][i] == rgb[1] && out[2][i] == rgb[2] && out[3][i] == static_cast<float>(colour);
}

}  // namespace

TEST_CASE("a checkerboard shows the colours that double precision says, after to_uv", "[model]") {
  const int width = GENERATE(1, 16);
  const std::array<float, 6> to_uv{3.0F, 0.5F, -1.7F, -0.4F, 2.5F, -0.8F};
  const std::size_t n = 1 << 14;
  const std::vector<float> u = uniform_numbers(n, 1, -3, 3), v = uniform_numbers(n, 2, -3, 3);
  const Columns out = look_up(width, to_uv, u, v);
  std::size_t compared = 0, wrong = 0;
  std::array<std::size_t, 2> seen{};
  for (std::size_t i = 0; i < n; ++i) {
    const auto along = [&](std::size_t k) {
      return double(to_uv[k]) * double(u[i]) + double(to_uv[k + 1]) * double(v[i]) + double(to_uv[k + 2]);
    };
    const double x = along(0), y = along(3);
    if (to_border(x) < 5e-6 || to_border(y) < 5e-6) continue;  // rounding may take it across
    const int colour = second_half(x) == second_half(y) ? 1 : 2;
    ++compared;
    ++seen[static_cast<std::size_t>(colour - 1)];
    wrong += !shows(out, i, colour);
  }
  CHECK(wrong == 0);
  CHECK(compared > n - 10);
  CHECK(seen[0] > n / 3);
  CHECK(seen[1] > n / 3);
}

TEST_CASE("a checkerboard's borders and whole numbers belong to the first half of a unit", "[model]") {
  const int width = GENERATE(1, 16);
  std::vector<float> u, v;
  // all exact in single precision, as are their neighbours
  for (const float x : {-1.5F, -1.0F, -0.75F, -0.5F, 0.0F, 0.25F, 0.5F, 0.5000001F, 0.75F, 1.0F, 1.5F, 100000.5F})
    for (const float y : {-2.0F, -0.5F, -0.25F, 0.0F, 0.4999999F, 0.5F, 0.75F, 1.0F, 65536.0F}) {
      u.push_back(x);
      v.push_back(y);
    }
  const Columns out = look_up(width, {1, 0, 0, 0, 1, 0}, u, v);
  for (std::size_t i = 0; i < u.size(); ++i) {
    INFO("u " << u[i] << ", v " << v[i]);
    CHECK(shows(out, i, second_half(double(u[i])) == second_half(double(v[i])) ? 1 : 2));
  }
  CHECK(shows(look_up(width, {1, 0, 0, 0, 1, 0}, std::vector<float>(16, 0.5F), std::vector<float>(16, 1.0F)), 0, 1));
}
