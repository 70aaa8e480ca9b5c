#include <bit>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdint>

#include "../support/chi_square.h"
#include "../support/lane_function.h"
#include "../support/z_test.h"

using namespace itn::test;

namespace {

constexpr double significance = 1e-6;

const LaneFunction generator{{"path/random.h"},
                             {"pixel", "sample", "event", "stream", "seed"},
                             {"u0", "u1", "u2", "u3"},
                             R"(
  REAL u[4];
  Lanes s, k;
  s.real = stream;
  k.real = seed;
  random4(AS_UINT(pixel), AS_UINT(sample), AS_UINT(event), (uint)s.i[0], (uint)k.i[0], 77u, u);
  u0 = u[0]; u1 = u[1]; u2 = u[2]; u3 = u[3];)"};

// The four numbers of `count` counters; `at` says (pixel, sample, event, stream, seed) of the i-th. Stream and seed are
// uniform over 16 neighbours.
template <class At>
Columns numbers(int width, std::size_t count, At&& at) {
  Columns in(5, std::vector<float>(count));
  for (std::size_t i = 0; i < count; ++i) {
    const std::array<std::uint32_t, 5> counter = at(static_cast<std::uint32_t>(i));
    for (std::size_t k = 0; k < 5; ++k) in[k][i] = std::bit_cast<float>(counter[k]);
  }
  return run_lanes(generator, width, in);
}

// Pairs (x[i], y[i]) over 64 x 64 cells of equal probability, and their correlation.
void check_independent(const std::vector<float>& x, const std::vector<float>& y) {
  const auto n = x.size();
  std::vector<double> observed(64 * 64), expected(64 * 64, static_cast<double>(n) / (64 * 64));
  double product = 0;
  for (std::size_t i = 0; i < n; ++i) {
    observed[static_cast<std::size_t>(x[i] * 64) * 64 + static_cast<std::size_t>(y[i] * 64)] += 1;
    product += (x[i] - 0.5) * (y[i] - 0.5);
  }
  CHECK(chi_square(observed, expected).p_value > significance);
  CHECK(std::abs(product * 12 / std::sqrt(static_cast<double>(n))) < largest_z_bound(1, significance));
}

}  // namespace

// Known answers published with the Random123 library (kat_vectors, philox4x32 10).
TEST_CASE("Philox4x32-10 gives its published answers", "[random]") {
  const int width = GENERATE(1, 4, 8, 16);
  const LaneFunction philox{{"path/random.h"}, {"c0", "c1", "c2", "c3", "k0", "k1"}, {"r0", "r1", "r2", "r3"}, R"(
  UINT x[4];
  Lanes a, b;
  a.real = k0;
  b.real = k1;
  x[0] = AS_UINT(c0); x[1] = AS_UINT(c1); x[2] = AS_UINT(c2); x[3] = AS_UINT(c3);
  philox4x32_10(x, (uint)a.i[0], (uint)b.i[0]);
  r0 = AS_REAL(x[0]); r1 = AS_REAL(x[1]); r2 = AS_REAL(x[2]); r3 = AS_REAL(x[3]);)"};
  struct Known {
    std::array<std::uint32_t, 6> in;
    std::array<std::uint32_t, 4> out;
  };
  const std::array<Known, 3> known{{
      {{0, 0, 0, 0, 0, 0}, {0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}},
      {{0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff},
       {0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}},
      {{0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344, 0xa4093822, 0x299f31d0},
       {0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}},
  }};
  Columns in(6);
  for (const auto& k : known)
    for (std::size_t j = 0; j < 6; ++j) in[j].insert(in[j].end(), 16, std::bit_cast<float>(k.in[j]));
  const Columns out = run_lanes(philox, width, in);
  for (std::size_t i = 0; i < known.size(); ++i)
    for (std::size_t lane = 0; lane < 16; ++lane)
      for (std::size_t j = 0; j < 4; ++j)
        REQUIRE(std::bit_cast<std::uint32_t>(out[j][16 * i + lane]) == known[i].out[j]);
}

TEST_CASE("uniform numbers never reach 0 or 1", "[random]") {
  const int width = GENERATE(1, 16);
  const LaneFunction ends{{"path/random.h"}, {"bits"}, {"u"}, "u = uniform_from_bits(AS_UINT(bits));"};
  const Columns u = run_lanes(ends, width, {{std::bit_cast<float>(0u), std::bit_cast<float>(0xffffffffu)}});
  CHECK(u[0][0] == 0x1p-24f);
  CHECK(u[0][1] == 1 - 0x1p-24f);
}

TEST_CASE("numbers are the same at every width", "[random]") {
  const auto at = [](std::uint32_t i) { return std::array<std::uint32_t, 5>{i, 3 * i, i / 7, 1, 5}; };
  CHECK(numbers(1, 4096, at) == numbers(16, 4096, at));
}

TEST_CASE("numbers are uniform (chi-square)", "[random][stat]") {
  const Columns u = numbers(16, 1 << 18, [](std::uint32_t i) { return std::array<std::uint32_t, 5>{i, 0, 0, 0, 0}; });
  for (const auto& column : u) {
    std::vector<Point> points;
    for (const float x : column) points.push_back({x, 0.5});
    CHECK(chi_square(points, [](double, double) { return 1.0; }, {0, 1, 0, 1, 1024, 1}).p_value > significance);
  }
}

TEST_CASE("neighbouring pixels, samples, events, streams, seeds are independent (pair chi-square, correlation)",
          "[random][stat]") {
  constexpr std::size_t count = 1 << 17;
  const std::size_t which = GENERATE(0u, 1u, 2u, 3u, 4u);
  // 16 x 16 x 512 counters; the neighbour differs by one in a single word.
  const auto at = [&](std::uint32_t offset) {
    return [=](std::uint32_t i) {
      std::array<std::uint32_t, 5> c{i & 15, (i >> 4) & 15, i >> 8, 0, 9};
      c[which] += offset;
      return c;
    };
  };
  const Columns here = numbers(16, count, at(0)), there = numbers(16, count, at(1));
  for (std::size_t j = 0; j < 4; ++j) check_independent(here[j], there[j]);
}

TEST_CASE("the four numbers of an event are independent (pair chi-square, correlation)", "[random][stat]") {
  const Columns u = numbers(16, 1 << 17, [](std::uint32_t i) { return std::array<std::uint32_t, 5>{i, 1, 2, 0, 3}; });
  for (std::size_t a = 0; a < 4; ++a)
    for (std::size_t b = a + 1; b < 4; ++b) check_independent(u[a], u[b]);
}
