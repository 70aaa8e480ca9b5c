// The sampler of directions that refract to the sun: samples against the density that MIS weighs them with.
#include <catch2/catch.hpp>

#include "../support/chi_square.h"
#include "../support/lane_function.h"
#include "kernels/model/microfacet.h"
#include "kernels/model/shading_frame.h"
#include "tests/support/plain_program.h"

using namespace itn::test;

namespace {

using Direction = Vector3<double>;

const LaneFunction connection{
    {"light/light_connection.h"},
    {"distribution", "alpha", "eta", "gx", "gy", "gz", "lx", "ly", "lz", "u0", "u1", "ax", "ay", "az"},
    {"x", "y", "z", "density", "again", "anywhere"},
    R"(
  AssumedBoundary b;
  b.distribution = CAST_INT(distribution);
  b.alpha = alpha;
  b.eta = eta;
  REAL3 guess = make3(gx, gy, gz), light = make3(lx, ly, lz), d;
  density = sample_refracted(&b, guess, light, u0, u1, &d);
  x = d.x; y = d.y; z = d.z;
  again = refracted_pdf(&b, guess, light, d);
  anywhere = refracted_pdf(&b, guess, light, make3(ax, ay, az));)",
    itn::test::plain_program({}, 1,
                             {{"MEDIUM_LIGHT_SAMPLING", "1"},
                              {"ROUGH_LIGHT_SAMPLING", "1"},
                              {"LIGHT_SAMPLING", "1"},
                              {"HAS_SUN", "1"},
                              {"HAS_MEDIUM", "1"}})};

struct Boundary {
  int distribution;
  double alpha, eta;  // eta: inside over outside
  Direction guess, light;
};

// Density per solid angle of directions w inside that a microfacet about the guess refracts from the light: that of
// microfacet normals times |dh / dw| (Walter et al. 2007, equation 17).
double density_of(const Boundary& b, const Direction& w) {
  Direction h = sub3(scale3(w, b.eta), b.light);
  h = scale3(h, (dot3(h, b.guess) < 0 ? -1 : 1) / std::sqrt(dot3(h, h)));
  const double outside = dot3(b.light, h), inside = dot3(w, h), cosine = dot3(h, b.guess);
  if (outside <= 0 || inside <= 0 || cosine <= 0) return 0;
  const Direction local{std::sqrt(std::max(0.0, 1 - cosine * cosine)), 0, cosine};
  const double normals =
      b.distribution == MICROFACET_GGX ? ggx_normals(local, b.alpha) : beckmann_normals(local, b.alpha);
  const double d = outside - b.eta * inside;
  return normals * cosine * b.eta * b.eta * inside / (d * d);
}

Columns run(const Boundary& b, int width, std::size_t n) {
  const auto constant = [&](double value) { return std::vector<float>(n, static_cast<float>(value)); };
  Columns anywhere(3);
  const auto z = uniform_numbers(n, 3, -1, 1), turn = uniform_numbers(n, 4);
  for (std::size_t i = 0; i < n; ++i) {
    const double r = std::sqrt(1 - double(z[i]) * z[i]), phi = 2 * PI_ * turn[i];
    anywhere[0].push_back(static_cast<float>(r * std::cos(phi)));
    anywhere[1].push_back(static_cast<float>(r * std::sin(phi)));
    anywhere[2].push_back(z[i]);
  }
  return run_lanes(
      connection, width,
      {constant(b.distribution), constant(b.alpha), constant(b.eta), constant(b.guess.x), constant(b.guess.y),
       constant(b.guess.z), constant(b.light.x), constant(b.light.y), constant(b.light.z), uniform_numbers(n, 1),
       uniform_numbers(n, 2), anywhere[0], anywhere[1], anywhere[2]});
}

}  // namespace

TEST_CASE("directions that refract to the light follow their density (chi-square)", "[model][stat]") {
  const int distribution = GENERATE(MICROFACET_BECKMANN, MICROFACET_GGX);
  const double alpha = GENERATE(0.15, 0.5), eta = GENERATE(1.5, 0.8), cosine = GENERATE(0.9, 0.5);
  const int width = alpha < 0.3 ? 1 : 16;
  constexpr std::size_t n = 1 << 16;
  const Direction guess{0.36, -0.48, 0.8};
  Direction s, t;
  shading_frame(guess, &s, &t);
  const Boundary b{distribution, alpha, eta, guess,
                   to_world(s, t, guess, Direction{std::sqrt(1 - cosine * cosine), 0, cosine})};
  const Columns out = run(b, width, n);

  std::vector<Point> samples;
  double worst = 0, worst_again = 0, worst_anywhere = 0;
  std::size_t rejected = 0;
  const auto z = uniform_numbers(n, 3, -1, 1), turn = uniform_numbers(n, 4);
  for (std::size_t i = 0; i < n; ++i) {
    const double r = std::sqrt(1 - double(z[i]) * z[i]), phi = 2 * PI_ * turn[i];
    const double expected = density_of(b, {r * std::cos(phi), r * std::sin(phi), z[i]});
    worst_anywhere = std::max(worst_anywhere, std::abs(out[5][i] - expected) / (expected + 0.01));
    if (out[3][i] <= 0) {
      ++rejected;
      samples.push_back({NAN, NAN});
      continue;
    }
    const Direction w{out[0][i], out[1][i], out[2][i]}, local = to_local(s, t, guess, w);
    samples.push_back({std::acos(std::clamp(local.z, -1.0, 1.0)), std::atan2(local.y, local.x)});
    const double density = density_of(b, w);
    worst = std::max(worst, std::abs(out[3][i] / density - 1) / (1 + 1 / density));
    worst_again = std::max(worst_again, std::abs(out[4][i] / density - 1) / (1 + 1 / density));
  }
  const auto density = [&](double theta, double phi) {
    const Direction local{std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
    return density_of(b, to_world(s, t, guess, local)) * std::sin(theta);
  };
  CAPTURE(distribution, alpha, eta, cosine, width, rejected);
  CHECK(n - rejected > 1000);  // total reflection takes most of grazing light where eta < 1
  CHECK(worst < 2e-3);
  CHECK(worst_again < 2e-3);
  CHECK(worst_anywhere < 2e-3);
  CHECK(chi_square(samples, density, {0, PI_, -PI_, PI_, 64, 32}).p_value > 1e-6);
}
