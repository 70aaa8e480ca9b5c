// What every BSDF of kernels/model/bsdf/list.h must be, in every variant: sampled in proportion to its density, a
// sample's weight its value over its density, no more light given back than arrives. A new one needs no test of its own
// for these.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "../support/chi_square.h"
#include "../support/lane_function.h"
#include "kernels/model/bsdf/list.h"
#include "runtime/scene/model.h"

using namespace itn;
using namespace itn::test;

namespace {

constexpr double significance = 1e-6;
using Direction = Vector3<double>;

struct BsdfUnderTest {
  const Model* model;
  void (*value)(int variant, const double* n, Direction wi, Direction wo, double* f);
  double (*density)(int variant, const double* n, Direction wi, Direction wo);
};

std::vector<BsdfUnderTest> all_bsdfs() {
  std::vector<BsdfUnderTest> all;
#define ITN_BSDF_UNDER_TEST(name, PREFIX, type, variants)                                                              \
  all.push_back({find_model(bsdf_models(), type),                                                                      \
                 [](int v, const double* n, Direction wi, Direction wo, double* f) { name##_value(v, n, wi, wo, f); }, \
                 [](int v, const double* n, Direction wi, Direction wo) { return name##_density(v, n, wi, wo); }});
  BSDF_LIST(ITN_BSDF_UNDER_TEST)
  std::erase_if(all, [](const BsdfUnderTest& b) { return b.model->traits & BSDF_SMOOTH; });  // no density
  return all;
}

// Values of all parameters, colours with three different channels.
std::vector<double> some_parameters(const Model& model) {
  std::vector<double> slots;
  for (const DeclaredParameter& p : model.parameters)
    for (int c = 0; c < p.kind.channels; ++c) {
      const double top = std::min(p.kind.high, 4.0);
      slots.push_back(p.name == "alpha"     ? 0.35
                      : p.name == "ext_ior" ? 1.0
                      : p.name == "int_ior" ? 1.45
                                            : p.kind.low + (top - p.kind.low) * (0.5 + 0.2 * c));
    }
  return slots;
}

Direction direction(double theta, double phi) {
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

std::string numbers_text(const std::vector<double>& n) {
  std::string text = "REAL n[32] = {";
  for (std::size_t i = 0; i < 32; ++i) text += "(REAL)(" + std::to_string(i < n.size() ? n[i] : 0.0) + "f), ";
  return text + "};\n";
}

}  // namespace

TEST_CASE("every BSDF's samples follow its density (chi-square), and weigh value over density", "[model][stat]") {
  constexpr std::size_t count = 1 << 17;
  const double theta = GENERATE(0.3, 1.2);
  for (const BsdfUnderTest& bsdf : all_bsdfs())
    for (int variant = 0; variant < static_cast<int>(bsdf.model->variants.size()); ++variant) {
      const std::vector<double> n = bsdf.model->to_numbers(some_parameters(*bsdf.model));
      const Direction wi = direction(theta, 0.7);
      LaneFunction call{{"model/bsdf/list.h"},
                        {"u0", "u1", "u2"},
                        {"x", "y", "z", "weight0", "weight2", "pdf", "scale"},
                        numbers_text(n)};
      call.body += "const REAL u[3] = {u0, u1, u2};\nREAL3 wo;\nREAL weight[3];\n";
      call.body += "const REAL3 wi = make3((REAL)(" + std::to_string(wi.x) + "f), (REAL)(" + std::to_string(wi.y) +
                   "f), (REAL)(" + std::to_string(wi.z) + "f));\n";
      call.body +=
          bsdf.model->name + "_draw(" + std::to_string(variant) +
          ", n, wi, u, &wo, weight, &pdf, &scale);\nx = wo.x; y = wo.y; z = wo.z; weight0 = weight[0]; weight2 = "
          "weight[2];";
      const Columns out =
          run_lanes(call, 16, {uniform_numbers(count, 1), uniform_numbers(count, 2), uniform_numbers(count, 3)});
      std::vector<Point> samples;
      std::size_t off = 0;
      for (std::size_t i = 0; i < count; ++i) {
        const Direction wo{out[0][i], out[1][i], out[2][i]};
        const bool lost = !(out[5][i] > 0);
        samples.push_back({lost ? std::nan("") : wo.z, std::atan2(wo.y, wo.x)});
        if (lost) continue;
        double f[3];
        bsdf.value(variant, n.data(), wi, wo, f);
        const double pdf = bsdf.density(variant, n.data(), wi, wo), radiance = out[6][i] * out[6][i];
        for (const auto& [c, column] : {std::pair{0, 3}, {2, 4}})
          off += !(std::abs(out[static_cast<std::size_t>(column)][i] * radiance * pdf - f[c]) <= 2e-3 * f[c] + 1e-6);
        off += !(std::abs(out[5][i] - pdf) <= 2e-3 * pdf);
      }
      const auto density = [&](double z, double phi) {
        const double sine = std::sqrt(std::max(0.0, 1 - z * z));
        return bsdf.density(variant, n.data(), wi, {sine * std::cos(phi), sine * std::sin(phi), z});
      };
      const ChiSquare result = chi_square(samples, density, {-1, 1 + 1e-6, -PI_, PI_, 48, 24});
      CAPTURE(bsdf.model->name, variant, theta, result.statistic, result.degrees_of_freedom, off);
      CHECK(result.p_value > significance);
      CHECK(off < count / 1000);  // single precision near grazing directions
    }
}

TEST_CASE("no BSDF gives back more light than arrives", "[model]") {
  for (const BsdfUnderTest& bsdf : all_bsdfs())
    for (int variant = 0; variant < static_cast<int>(bsdf.model->variants.size()); ++variant)
      for (const double theta : {0.2, 0.9, 1.4}) {
        const std::vector<double> n = bsdf.model->to_numbers(some_parameters(*bsdf.model));
        const Direction wi = direction(theta, 0);
        const auto power = [&](double t, double phi) {
          double f[3];
          const Direction wo = direction(t, phi);
          bsdf.value(variant, n.data(), wi, wo, f);
          // radiance scales by 1 / eta^2 where it is transmitted, power does not: from outside, light that is sent in
          const double scale = wo.z < 0 ? 1.45 * 1.45 : 1;
          return *std::max_element(f, f + 3) * std::sin(t) * scale;
        };
        CAPTURE(bsdf.model->name, variant, theta);
        CHECK(integrate(power, {0, PI_, 0, 2 * PI_, 32, 32}, 1e-3) < 1 + 2e-3);
      }
}

TEST_CASE("every BSDF that does not transmit is reciprocal: f(wi, wo) = f(wo, wi)", "[model]") {
  const auto u = uniform_numbers(4000, 11);
  for (const BsdfUnderTest& bsdf : all_bsdfs()) {
    if (bsdf.model->traits & BSDF_TRANSMITS) continue;
    for (int variant = 0; variant < static_cast<int>(bsdf.model->variants.size()); ++variant) {
      const std::vector<double> n = bsdf.model->to_numbers(some_parameters(*bsdf.model));
      double worst = 0;
      for (std::size_t i = 0; i < u.size(); i += 4) {
        const Direction a = direction(std::acos(u[i]), 6.28 * u[i + 1]),
                        b = direction(std::acos(u[i + 2]), 6.28 * u[i + 3]);
        double forth[3], back[3];
        bsdf.value(variant, n.data(), a, b, forth);
        bsdf.value(variant, n.data(), b, a, back);
        for (std::size_t c = 0; c < 3; ++c)
          worst = std::max(worst, std::abs(forth[c] / b.z - back[c] / a.z) / (forth[c] / b.z + 1e-12));
      }
      CAPTURE(bsdf.model->name, variant);
      CHECK(worst < 1e-9);
    }
  }
}
