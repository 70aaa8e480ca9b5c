// The mean of a score over its own density is the derivative of the density's integral: zero.
#include <catch2/catch.hpp>
#include <numbers>

#include "../support/chi_square.h"
#include "../support/z_test.h"
#include "kernels/model/bsdf/rough_dielectric.h"
#include "kernels/model/medium/homogeneous.h"
#include "kernels/model/phase/henyey_greenstein.h"
#include "score_support.h"

using namespace itn;
using namespace itn::test;

namespace {

constexpr double pi = std::numbers::pi;
constexpr double significance = 1e-6;

double score(const std::string& name, std::size_t which, const std::vector<double>& row) {
  const ScoreFunction& function = score_function(name);
  return Evaluation(function, row)[derivatives_of(function)[which].node];
}

// Mean over its standard error.
double z_of_mean(const std::vector<float>& values) {
  double sum = 0, square = 0;
  for (const float x : values) {
    sum += x;
    square += static_cast<double>(x) * x;
  }
  const auto count = static_cast<double>(values.size());
  const double mean = sum / count;
  return mean / std::sqrt((square / count - mean * mean) / count);
}

}  // namespace

TEST_CASE("mean score of Henyey-Greenstein is zero over directions", "[derivative]") {
  const double g = GENERATE(-0.9, -0.5, 0.0, 0.3, 0.8, 0.95);
  const auto weighted = [&](double c, double) {
    return 2 * pi * henyey_greenstein(c, g) * score("score_henyey_greenstein", 0, {g, c});
  };
  const auto size = [&](double c, double y) { return std::abs(weighted(c, y)); };
  const Grid grid{-1, 1, 0, 1, 256, 1};
  CHECK(integrate(size, grid, 1e-4) > 0.5);  // of what cancels
  CHECK(std::abs(integrate(weighted, grid, 1e-7)) < 1e-6);
}

TEST_CASE("mean score of sampled scattering angles is zero on the device (z-test)", "[derivative][stat]") {
  const int width = GENERATE(1, 16);
  const float g = GENERATE(-0.5f, 0.f, 0.8f);
  LaneFunction call = printed(score_function("score_henyey_greenstein"));
  call.includes = {"model/phase/henyey_greenstein.h"};
  call.inputs = {"u", "g"};
  call.body = "REAL c, s; henyey_greenstein_sample(g, u, &c, &s); score_henyey_greenstein(&g, c, &d_0);";
  constexpr std::size_t n = 1 << 17;
  const Columns out = run_lanes(call, width, {uniform_numbers(n, 5), std::vector<float>(n, g)});
  CHECK(std::abs(z_of_mean(out[0])) < largest_z_bound(6, significance));
}

TEST_CASE("mean score of a flight is zero: collisions up to a surface, and passages to it", "[derivative]") {
  const double sigma_t = GENERATE(0.5, 4.0, 50.0), surface = GENERATE(0.1, 1.0);
  const auto weighted = [&](double d, double) {
    return medium_free_flight(sigma_t, d) * score("score_homogeneous_scattering", 0, {sigma_t, 1, 1, 0.7, 1, 1, d});
  };
  const double collisions = integrate(weighted, {0, surface, 0, 1, 64, 1}, 1e-10);
  const double passages =
      medium_transmittance(sigma_t, surface) * score("score_homogeneous_passage", 0, {sigma_t, 1, 1, surface});
  const auto size = [&](double d, double y) { return std::abs(weighted(d, y)); };
  CHECK(integrate(size, {0, surface, 0, 1, 64, 1}, 1e-6) > 0.3 * std::min(surface, 1 / sigma_t));  // of what cancels
  CHECK(collisions + passages == Approx(0).margin(1e-8));
}

TEST_CASE("mean score of sampled flights is zero on the device (z-test)", "[derivative][stat]") {
  const int width = GENERATE(1, 16);
  const float sigma_t = GENERATE(0.5f, 50.f);
  LaneFunction call;
  call.functions = print_scores({{"score_homogeneous_passage", {0}}, {"score_homogeneous_scattering", {0}}}, 1);
  call.includes = {"model/medium/homogeneous.h"};
  call.inputs = {"u", "sigma_t"};
  call.outputs = {"score"};
  call.body = R"(
  const REAL surface = 0.7f / sigma_t, d = medium_free_flight_sample(sigma_t, u);
  const REAL n[6] = {sigma_t, sigma_t, sigma_t, NUMBER(0.9), NUMBER(0.9), NUMBER(0.9)};
  REAL collision[6], passage[6];
  score_homogeneous_scattering(n, d, collision);
  score_homogeneous_passage(n, surface, passage);
  score = SELECT(d < surface, collision[0], passage[0]);)";
  constexpr std::size_t n = 1 << 17;
  const Columns out = run_lanes(call, width, {uniform_numbers(n, 6), std::vector<float>(n, sigma_t)});
  CHECK(std::abs(z_of_mean(out[0])) < largest_z_bound(4, significance));
}

namespace {

using Unit = Vector3<double>;

Unit at_angles(double theta, double phi) {
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

struct RoughDielectric {
  int distribution;
  double alpha, eta;
  Unit wi;

  double value(const Unit& wo) const {
    return rough_dielectric_eval(distribution, alpha, far_over_near(eta, wi.z), wi, wo);
  }
  const ScoreFunction& scores() const {
    return score_function(distribution == MICROFACET_GGX ? "score_rough_dielectric_1" : "score_rough_dielectric_0");
  }
};

// Integral of f |cos wo| g(wo) over one lobe; the radiance of transmitted light over eta^2 included, as a camera path's
// throughput holds it. Midpoint rule over microfacet normals, where f is smooth: wi.y = 0, so half of the azimuths do.
template <class Factor>
double over_lobe(const RoughDielectric& surface, bool reflection, int rows, const Factor& g) {
  const int columns = rows / 3;
  const double eta = far_over_near(surface.eta, surface.wi.z), side = surface.wi.z < 0 ? -1 : 1;
  const Unit up{surface.wi.x, surface.wi.y, side * surface.wi.z};
  double sum = 0;
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < columns; ++j) {
      const double t = (i + 0.5) / rows, theta = pi / 2 * t * t, phi = (j + 0.5) * pi / columns;
      const Unit m = at_angles(theta, phi);
      const double ci = dot3(up, m);
      double reflectance = 0, ct = 0;
      fresnel_dielectric_refract(std::min(std::abs(ci), 1.0), eta, &reflectance, &ct);
      const double along_m = reflection ? 2 * ci : ci / eta - ct, along_wi = reflection ? 1 : 1 / eta;
      const Unit out = sub3(scale3(m, along_m), scale3(up, along_wi));
      if (ci <= 0 || (reflection ? out.z <= 0 : ct == 0 || out.z >= 0)) continue;
      const double stretch = reflection ? 4 * ci : std::pow(ci - eta * ct, 2) / (eta * eta * ct);  // dwo / dm
      const double cell = std::sin(theta) * 2 * (pi * t / rows) * (pi / columns);
      const Unit wo{out.x, out.y, side * out.z};
      sum += surface.value(wo) * stretch * cell * g(wo);
    }
  return sum;
}

double albedo(const RoughDielectric& surface, bool reflection) {
  return over_lobe(surface, reflection, 1200, [](const Unit&) { return 1; });
}

double mean_score(const RoughDielectric& surface, bool reflection, std::size_t which) {
  const int node = derivatives_of(surface.scores())[which].node;
  return over_lobe(surface, reflection, 300, [&](const Unit& wo) {
    const std::array<double, 8> row{surface.alpha, surface.eta, surface.wi.x, surface.wi.y,
                                    surface.wi.z,  wo.x,        wo.y,         wo.z};
    return Evaluation(surface.scores(), row)[node];
  });
}

double albedo_slope(const RoughDielectric& surface, bool reflection, double RoughDielectric::*parameter) {
  const double h = 1e-3;
  RoughDielectric low = surface, high = surface;
  low.*parameter -= h;
  high.*parameter += h;
  return (albedo(high, reflection) - albedo(low, reflection)) / (2 * h);
}

Unit direction_of_cosine(double cosine) { return {std::sqrt(1 - cosine * cosine), 0, cosine}; }

}  // namespace

TEST_CASE("mean score of a rough dielectric is the derivative of its albedo, by roughness", "[derivative]") {
  const int distribution = GENERATE(MICROFACET_BECKMANN, MICROFACET_GGX);
  const double cosine = GENERATE(0.9, 0.3, -0.6), alpha = GENERATE(0.2, 0.5);
  const bool reflection = GENERATE(true, false);
  const RoughDielectric surface{distribution, alpha, 1.4, direction_of_cosine(cosine)};
  INFO("distribution " << distribution << ", cosine " << cosine << ", alpha " << alpha << ", reflection "
                       << reflection);
  CHECK(mean_score(surface, reflection, 0) ==
        Approx(albedo_slope(surface, reflection, &RoughDielectric::alpha)).epsilon(1e-3).margin(1e-4));
}

// With the term of the cone where transmission ends in a jump, which GGX needs (rough_dielectric_ggx_edge). From inside
// only where few facets reflect totally: at the critical angle the score is infinite, if integrable.
TEST_CASE("mean score of a rough dielectric is the derivative of its albedo, by index", "[derivative]") {
  const int distribution = GENERATE(MICROFACET_BECKMANN, MICROFACET_GGX);
  const double cosine = GENERATE(0.9, 0.3, -0.97);
  const bool reflection = GENERATE(true, false);
  const RoughDielectric surface{distribution, cosine < 0 ? 0.01 : 0.4, 1.4, direction_of_cosine(cosine)};
  INFO("distribution " << distribution << ", cosine " << cosine << ", reflection " << reflection);
  CHECK(mean_score(surface, reflection, 1) ==
        Approx(albedo_slope(surface, reflection, &RoughDielectric::eta)).epsilon(1e-3).margin(1e-4));
}

// The decisions of rough_dielectric_sample count, samples that come out on the wrong side included, as a baseline
// needs.
TEST_CASE("mean score of a rough dielectric's decisions is zero over normals and lobes", "[derivative]") {
  const int distribution = GENERATE(MICROFACET_BECKMANN, MICROFACET_GGX);
  const double cosine = GENERATE(0.9, 0.2, -0.6), alpha = GENERATE(0.2, 0.5), index = 1.4;
  const Unit wi = direction_of_cosine(cosine);
  const double eta = far_over_near(index, cosine), side = cosine < 0 ? -1 : 1;
  const ScoreFunction& function = score_function(distribution == MICROFACET_GGX ? "score_rough_dielectric_1_decision"
                                                                                : "score_rough_dielectric_0_decision");
  const std::vector<Derivative> by = derivatives_of(function);
  constexpr int rows = 240, columns = 120;
  double norm = 0, by_alpha = 0, by_eta = 0, size = 0;
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < columns; ++j) {
      const double t = (i + 0.5) / rows, theta = pi / 2 * t * t, phi = (j + 0.5) * pi / columns;
      const Unit up = at_angles(theta, phi), m{up.x, up.y, side * up.z};
      if (dot3(wi, m) <= 0) continue;
      for (const double reflected : {0.0, 1.0}) {
        const double weight = rough_dielectric_choice(distribution, alpha, eta, wi, m, reflected) * std::sin(theta) *
                              2 * (pi * t / rows) * (pi / columns);
        const std::array<double, 9> row{alpha, index, wi.x, wi.y, wi.z, m.x, m.y, m.z, reflected};
        const Evaluation scores(function, row);
        norm += weight;
        by_alpha += weight * scores[by[0].node];
        by_eta += weight * scores[by[1].node];
        size += weight * std::abs(scores[by[0].node]);
      }
    }
  INFO("distribution " << distribution << ", cosine " << cosine << ", alpha " << alpha);
  CHECK(norm == Approx(1).epsilon(1e-4));
  CHECK(size > 0.5);
  CHECK(std::abs(by_alpha) < 1e-3 * size);
  CHECK(std::abs(by_eta) < 1e-12);
}

TEST_CASE("mean score of a rough dielectric's sampled decisions is zero on the device (z-test)", "[derivative][stat]") {
  const int width = GENERATE(1, 16);
  const std::string name = GENERATE("beckmann", "ggx");
  const std::string function =
      name == "ggx" ? "score_rough_dielectric_1_decision" : "score_rough_dielectric_0_decision";
  const float cosine = GENERATE(0.9f, 0.2f, -0.6f), alpha = GENERATE(0.1f, 0.5f);
  LaneFunction call;
  call.includes = {"model/bsdf/rough_dielectric.h"};
  call.functions = print_scores({{function, {ROUGH_DIELECTRIC_alpha, ROUGH_DIELECTRIC_eta}}}, 1);
  call.inputs = {"u0", "u1", "u2", "alpha", "cosine"};
  call.outputs = {"d_alpha", "d_eta", "lost"};
  call.body = "const int kind = MICROFACET_" + std::string(name == "ggx" ? "GGX" : "BECKMANN") + R"(;
  const REAL inside = (REAL)(1.4f), eta = far_over_near(inside, cosine);
  const REAL3 wi = make3(SQRT(1.0f - cosine * cosine), (REAL)(0.0f), cosine);
  REAL3 wo;
  REAL weight, pdf;
  MASK mirror;
  rough_dielectric_sample(kind, alpha, eta, wi, u0, u1, u2, &wo, &weight, &pdf, &mirror);
  const REAL reflected = SELECT(mirror, 1.0f, 0.0f);
  const REAL3 m = rough_dielectric_normal(eta, wi, wo, reflected);
  const REAL n[2] = {alpha, inside};
  REAL d[8];
  )" + function +
              R"((n, wi, m, reflected, d);
  d_alpha = d[0];
  d_eta = d[1];
  lost = SELECT(weight > 0.0f, 0.0f, 1.0f);)";
  constexpr std::size_t n = 1 << 17;
  const Columns out = run_lanes(call, width,
                                {uniform_numbers(n, 41), uniform_numbers(n, 42), uniform_numbers(n, 43),
                                 std::vector<float>(n, alpha), std::vector<float>(n, cosine)});
  INFO(name << ", cosine " << cosine << ", alpha " << alpha);
  constexpr std::size_t scores = 2 * 2 * 3 * 2 * 2;
  CHECK(std::abs(z_of_mean(out[0])) < largest_z_bound(scores, significance));
  CHECK(std::abs(z_of_mean(out[1])) < largest_z_bound(scores, significance));
  if (alpha == 0.5f && cosine == 0.2f) CHECK(std::count(out[2].begin(), out[2].end(), 1.f) > 1000);
}
