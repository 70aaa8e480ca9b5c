// Four ways to the same derivative: the recorded graph in double precision, dual numbers, central differences, and the
// printed OpenCL code.
#include <catch2/catch.hpp>
#include <numbers>

#include "kernels/model/bsdf/diffuse.h"
#include "kernels/model/bsdf/rough_dielectric.h"
#include "kernels/model/medium/homogeneous.h"
#include "kernels/model/phase/draine.h"
#include "kernels/model/phase/henyey_greenstein.h"
#include "kernels/model/sky_hosek_wilkie.h"
#include "runtime/base/dual.h"
#include "runtime/scene/sky/hosek_wilkie.h"
#include "score_support.h"

using namespace itn;
using namespace itn::test;

namespace {

constexpr std::size_t n = 20000;
constexpr double pi = std::numbers::pi;

// Directions with cosines of all sizes, down to 1e-4 from grazing and from the normal.
void add_directions(Columns& columns, unsigned seed) {
  const auto kind = uniform_numbers(n, seed), z = uniform_numbers(n, seed + 1, -1, 1),
             phi = uniform_numbers(n, seed + 2, 0, 2 * pi);
  std::vector<float> x(n), y(n), w(n);
  for (std::size_t i = 0; i < n; ++i) {
    double cosine = z[i];
    if (kind[i] < 0.1f) cosine *= 1e-2;
    if (kind[i] > 0.9f) cosine = std::copysign(1 - 1e-4 * std::abs(cosine), cosine);
    const double sine = std::sqrt(1 - cosine * cosine);
    x[i] = static_cast<float>(sine * std::cos(phi[i]));
    y[i] = static_cast<float>(sine * std::sin(phi[i]));
    w[i] = static_cast<float>(cosine);
  }
  columns.insert(columns.end(), {x, y, w});
}

Columns henyey_greenstein_inputs() {
  Columns in{uniform_numbers(n, 2, -0.99, 0.99), uniform_numbers(n, 1, -1, 1)};
  for (std::size_t i = 0; i < n; i += 100) in[1][i] = i % 200 ? 1.f : -1.f;  // straight on, straight back
  for (std::size_t i = 50; i < n; i += 100) in[0][i] = 1e-6f * static_cast<float>(i) / n;
  return in;
}

Columns draine_inputs() {
  Columns in = henyey_greenstein_inputs();
  in.insert(in.begin() + 1, uniform_numbers(n, 3, -7, 7));
  for (float& alpha : in[1]) alpha = std::exp(alpha);
  return in;
}

// A channel each.
Columns inputs_of_medium() {
  Columns in;
  for (unsigned channel = 0; channel < 3; ++channel) {
    in.push_back(uniform_numbers(n, 300 + channel, -3, 6));
    for (float& s : in.back()) s = std::exp(s);
  }
  in.push_back(uniform_numbers(n, 4, 0, 5));
  return in;
}

Columns medium_scattering_inputs() {
  Columns in = inputs_of_medium();
  for (unsigned channel = 0; channel < 3; ++channel)
    in.insert(in.end() - 1, uniform_numbers(n, 500 + channel, 1e-3, 1));
  return in;
}

Columns diffuse_inputs() {
  Columns in;
  for (unsigned channel = 0; channel < 3; ++channel) in.push_back(uniform_numbers(n, 600 + channel, 1e-3, 1));
  add_directions(in, 9);
  add_directions(in, 7);
  return in;
}

// wo: nine in ten drawn by the sampler, so that both lobes are met; the others anywhere.
Columns rough_dielectric_inputs(int distribution) {
  Columns in{uniform_numbers(n, 11, -3.9, 0), uniform_numbers(n, 12, 1.05, 2)};
  for (float& alpha : in[0]) alpha = std::exp(alpha);  // from 0.02
  for (std::size_t i = 1; i < n; i += 2) in[1][i] = 1 / in[1][i];
  add_directions(in, 13);
  add_directions(in, 16);
  const auto u0 = uniform_numbers(n, 21), u1 = uniform_numbers(n, 22), u2 = uniform_numbers(n, 23);
  for (std::size_t i = 0; i < n; ++i) {
    if (i % 10 == 0) continue;
    const Vector3<double> wi{in[2][i], in[3][i], in[4][i]};
    Vector3<double> wo{};
    double weight = 0, pdf = 0;
    bool reflected = false;
    rough_dielectric_sample<double>(distribution, in[0][i], far_over_near<double>(in[1][i], wi.z), wi, u0[i], u1[i],
                                    u2[i], &wo, &weight, &pdf, &reflected);
    in[5][i] = static_cast<float>(wo.x);
    in[6][i] = static_cast<float>(wo.y);
    in[7][i] = static_cast<float>(wo.z);
  }
  return in;
}

// m and the lobe: what the sampler decided; one in ten wi and m at random.
Columns rough_dielectric_decision_inputs(int distribution) {
  Columns in = rough_dielectric_inputs(distribution);
  in.emplace_back(n);
  for (std::size_t i = 0; i < n; ++i) {
    const Vector3<double> wi{in[2][i], in[3][i], in[4][i]}, wo{in[5][i], in[6][i], in[7][i]};
    const bool reflected = wi.z * wo.z > 0;
    const auto m = rough_dielectric_normal<double>(far_over_near<double>(in[1][i], wi.z), wi, wo, reflected);
    in[5][i] = static_cast<float>(m.x);
    in[6][i] = static_cast<float>(m.y);
    in[7][i] = static_cast<float>(m.z);
    in[8][i] = reflected;
  }
  return in;
}

// Coefficients and tangents of real skies, with random tangents beside.
Columns sky_inputs() {
  Columns in(23, std::vector<float>(n));
  const auto u = uniform_numbers(n, 31), cosine = uniform_numbers(n, 32, 0, 1), azimuth = uniform_numbers(n, 33, 0, pi);
  for (std::size_t i = 0; i < n; ++i) {
    if (i % 50) {  // a new sky every 50 rows
      for (std::size_t k = 0; k < 20; ++k) in[k][i] = in[k][i - 1];
    } else {
      SunSky parameters;
      parameters.turbidity = 1 + 9 * u[i];
      parameters.albedo = {u[i + 1], u[i + 2], u[i + 3]};
      parameters.sun.direction = {std::sqrt(1 - u[i + 4] * u[i + 4]), 0, u[i + 4]};
      const auto sky = clear_sky(parameters).sky[i % 3];
      const auto tangent = clear_sky_derivatives(parameters)[i % 4].sky[i % 4 ? i % 4 - 1 : 0];
      for (std::size_t k = 0; k < 10; ++k) {
        in[k][i] = static_cast<float>(sky[k]);
        in[10 + k][i] = static_cast<float>(tangent[k]);
      }
    }
    const double sun_cosine = u[i - i % 50 + 4], sine = std::sqrt(1 - cosine[i] * cosine[i]);
    const double dot = cosine[i] * sun_cosine + sine * std::sqrt(1 - sun_cosine * sun_cosine) * std::cos(azimuth[i]);
    in[20][i] = cosine[i];
    in[21][i] = static_cast<float>(std::acos(std::clamp(dot, -1., 1.)));
    in[22][i] = static_cast<float>(1 - dot);
  }
  return in;
}

// f in a channel over any scalar, from a row of its scalar inputs in the order of the arguments; edge: what is added to
// log f.
struct NoEdge {
  template <class Real>
  static Real edge(const Real*) {
    return 0;
  }
};
struct HenyeyGreenstein : NoEdge {
  template <class Real>
  static Real f(const Real* x, int) {
    return henyey_greenstein(x[1], x[0]);
  }
};
struct Draine : NoEdge {
  template <class Real>
  static Real f(const Real* x, int) {
    return draine(x[2], x[0], x[1]);
  }
};
struct Scattering : NoEdge {
  template <class Real>
  static Real f(const Real* x, int channel) {
    return medium_free_flight(x[channel], x[6]) * x[3 + channel];
  }
};
struct Passage : NoEdge {
  template <class Real>
  static Real f(const Real* x, int channel) {
    return medium_transmittance(x[channel], x[3]);
  }
};
struct Diffuse : NoEdge {
  template <class Real>
  static Real f(const Real* x, int channel) {
    return diffuse_eval(x[channel], Vector3<Real>{x[6], x[7], x[8]});
  }
};
template <int distribution>
struct RoughDielectric {
  template <class Real>
  static Real f(const Real* x, int) {
    const Vector3<Real> wi{x[2], x[3], x[4]}, wo{x[5], x[6], x[7]};
    return rough_dielectric_eval(distribution, x[0], far_over_near(x[1], wi.z), wi, wo);
  }
  template <class Real>
  static Real edge(const Real* x) {
    const Vector3<Real> wi{x[2], x[3], x[4]}, wo{x[5], x[6], x[7]};
    if (distribution != MICROFACET_GGX) return 0;
    return rough_dielectric_ggx_edge(far_over_near(x[1], wi.z), wi, wo);
  }
};
template <int distribution>
struct RoughDielectricDecision : NoEdge {
  template <class Real>
  static Real f(const Real* x, int) {
    const Vector3<Real> wi{x[2], x[3], x[4]}, m{x[5], x[6], x[7]};
    return rough_dielectric_choice(distribution, x[0], far_over_near(x[1], wi.z), wi, m, x[8]);
  }
};
struct Sky : NoEdge {
  template <class Real>
  static Real f(const Real* x, int) {
    return sky_hosek_wilkie(x, x[20], x[21], x[22]);
  }
};

struct Outcome {
  std::size_t compared = 0, sharp_difference = 0, sharp_device = 0, off_dual = 0, off_difference = 0, off_width_1 = 0,
              off_width_16 = 0, not_finite = 0;
};

// direction: how the inputs move for derivative number `which`.
template <class Model, class Direction>
Outcome compare(const ScoreFunction& function, const Columns& in, std::size_t which, const Direction& direction) {
  const bool logarithmic = function.name.rfind("score", 0) == 0;
  const Derivative of = derivatives_of(function)[which];
  const Columns narrow = run_lanes(printed(function), 1, in), wide = run_lanes(printed(function), 16, in);
  Outcome outcome;
  for (std::size_t i = 0; i < in[0].size(); ++i) {
    std::vector<double> row;
    for (const auto& column : in) row.push_back(column[i]);
    const Evaluation evaluation(function, row);
    const double derivative = evaluation[of.node], rounding = evaluation.rounding(of.node);
    const std::vector<double> moves = direction(row);

    std::vector<Dual<1>> dual(row.begin(), row.end());
    for (std::size_t k = 0; k < row.size(); ++k) dual[k].derivative[0] = moves[k];
    const Dual<1> f = Model::f(dual.data(), of.channel);
    if (!logarithmic || f.value > 1e-200) {  // else the quotient has no digits
      ++outcome.compared;
      const double reference =
          logarithmic ? f.derivative[0] / f.value + Model::edge(dual.data()).derivative[0] : f.derivative[0];
      outcome.off_dual += !(std::abs(derivative - reference) <= 0x1p-52 * 4 * (rounding + std::abs(reference)));

      // Fourth order; half the step tells how far it can be trusted.
      const auto difference = [&](double h) {
        const auto at = [&](double t) {
          std::vector<double> moved = row;
          for (std::size_t k = 0; k < row.size(); ++k) moved[k] += t * moves[k];
          const double value = Model::f(moved.data(), of.channel);
          return logarithmic ? std::log(value) + Model::edge(moved.data()) : value;
        };
        return (8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h);
      };
      double size = 1;  // of the step: a relative change of what moves
      for (std::size_t k = 0; k < row.size(); ++k)
        if (moves[k] != 0) size = std::min(size, std::abs(row[k] / moves[k]));
      const double step = 1e-4 * std::max(size, 1e-2);
      const double coarse = difference(step), fine = difference(step / 2);
      outcome.sharp_difference += std::abs(coarse - fine) <= 1e-5 * (std::abs(fine) + 1e-3);
      outcome.off_difference +=
          !(std::abs(derivative - fine) <= std::abs(coarse - fine) + 1e-7 * std::abs(fine) + 1e-8);
    } else {
      outcome.off_dual += !std::isfinite(derivative);
    }
    const double bound = 2 * 0x1p-24 * rounding + 1e-30;
    outcome.sharp_device += bound <= 1e-4 * (std::abs(derivative) + 1e-3);
    outcome.off_width_1 += !(std::abs(narrow[which][i] - derivative) <= bound);
    outcome.off_width_16 += !(std::abs(wide[which][i] - derivative) <= bound);
    outcome.not_finite += !std::isfinite(narrow[which][i]) || !std::isfinite(wide[which][i]);
  }
  return outcome;
}

// Checks the outcome of n rows: rounding bounds are first order and blind to comparisons that tip over; a central
// difference is wrong where it straddles a branch or the step is not small beside the distance to a singularity.
void check(const Outcome& outcome, const std::string& what) {
  INFO(what << ": compared " << outcome.compared << ", of them with a sharp difference " << outcome.sharp_difference
            << ", device bound below 1e-4 " << outcome.sharp_device << ", off dual " << outcome.off_dual
            << ", off difference " << outcome.off_difference << ", off at width 1 " << outcome.off_width_1
            << ", at width 16 " << outcome.off_width_16 << ", not finite " << outcome.not_finite);
  CHECK(outcome.compared > n / 2);
  CHECK(outcome.off_dual == 0);
  CHECK(outcome.sharp_difference > outcome.compared * 99 / 100);
  CHECK(outcome.sharp_device > n * 85 / 100);
  CHECK(outcome.off_difference < n / 1000);
  CHECK(outcome.off_width_1 < n / 1000);
  CHECK(outcome.off_width_16 < n / 1000);
  CHECK(outcome.not_finite == 0);
}

template <class Model>
void check_scores(const std::string& name, const Columns& in) {
  const ScoreFunction& function = score_function(name);
  const auto inputs = scalar_inputs(function);
  REQUIRE(inputs.size() == in.size());
  const std::vector<Derivative> derivatives = derivatives_of(function);
  for (std::size_t p = 0; p < derivatives.size(); ++p) {
    const std::string number = "n[" + std::to_string(derivatives[p].slot) + "]";
    const auto alone = [&](const std::vector<double>&) {
      std::vector<double> moves(inputs.size());
      for (std::size_t k = 0; k < inputs.size(); ++k) moves[k] = inputs[k] == number;
      return moves;
    };
    check(compare<Model>(function, in, p, alone), name + " by " + number);
  }
}

}  // namespace

TEST_CASE("score of Henyey-Greenstein: graph, dual numbers, differences and device agree", "[derivative]") {
  check_scores<HenyeyGreenstein>("score_henyey_greenstein", henyey_greenstein_inputs());
}

TEST_CASE("scores of Draine's phase function: graph, dual numbers, differences and device agree", "[derivative]") {
  check_scores<Draine>("score_draine", draine_inputs());
}

TEST_CASE("scores of the homogeneous medium: graph, dual numbers, differences and device agree", "[derivative]") {
  check_scores<Scattering>("score_homogeneous_scattering", medium_scattering_inputs());
  check_scores<Passage>("score_homogeneous_passage", inputs_of_medium());
}

TEST_CASE("score of diffuse reflection: graph, dual numbers, differences and device agree", "[derivative]") {
  Columns in = diffuse_inputs();
  for (float& z : in[8]) z = std::abs(z);
  check_scores<Diffuse>("score_diffuse_0", in);
}

TEST_CASE("scores of the rough dielectric: graph, dual numbers, differences and device agree", "[derivative]") {
  check_scores<RoughDielectric<MICROFACET_GGX>>("score_rough_dielectric_1", rough_dielectric_inputs(MICROFACET_GGX));
  check_scores<RoughDielectric<MICROFACET_BECKMANN>>("score_rough_dielectric_0",
                                                     rough_dielectric_inputs(MICROFACET_BECKMANN));
}

TEST_CASE("scores of the rough dielectric's decisions: graph, dual numbers, differences and device agree",
          "[derivative]") {
  check_scores<RoughDielectricDecision<MICROFACET_GGX>>("score_rough_dielectric_1_decision",
                                                        rough_dielectric_decision_inputs(MICROFACET_GGX));
  check_scores<RoughDielectricDecision<MICROFACET_BECKMANN>>("score_rough_dielectric_0_decision",
                                                             rough_dielectric_decision_inputs(MICROFACET_BECKMANN));
}

TEST_CASE("derivative of the clear sky: graph, dual numbers, differences and device agree", "[derivative]") {
  const ScoreFunction& function = score_function("derivative_sky_hosek_wilkie");
  const auto tangents = [](const std::vector<double>& row) {
    std::vector<double> moves(row.size());
    std::copy_n(row.begin() + 10, 10, moves.begin());
    return moves;
  };
  check(compare<Sky>(function, sky_inputs(), 0, tangents), function.name);
}

TEST_CASE("scores of the rough dielectric are finite for degenerate directions, however roots are rounded",
          "[derivative]") {
  const std::string name = GENERATE("score_rough_dielectric_1", "score_rough_dielectric_0");
  // OpenCL allows a root to be 3 units in the last place off; NVIDIA's are, PoCL's are not.
  const auto [width, root] = GENERATE(table<int, std::string>({{1, "sqrt(x)"},
                                                               {4, "sqrt(x)"},
                                                               {8, "sqrt(x)"},
                                                               {16, "sqrt(x)"},
                                                               {1, "(0.9999999f * sqrt(x))"},
                                                               {1, "(1.0000001f * sqrt(x))"}}));
  Columns in(8);
  for (const float alpha : {1e-4f, 0.1f, 1.f})
    for (const float eta : {1 / 1.5f, 1.5f, 1.f})
      for (const float z : {0.f, 1e-7f, -1e-7f, 1e-3f, 0.7453559925f, -0.7453559925f, 1.f, -1.f})
        for (const float z2 : {0.f, 1e-7f, -1e-7f, 1e-3f, -1e-3f, 0.5f, -0.5f, 1.f, -1.f})
          for (const float x2 : {1.f, -1.f}) {
            const std::array<float, 8> row{alpha, eta, std::sqrt(1 - z * z), 0, z, x2 * std::sqrt(1 - z2 * z2), 0, z2};
            for (std::size_t k = 0; k < 8; ++k) in[k].push_back(row[k]);
          }
  LaneFunction score = printed(score_function(name));
  score.functions = "#undef SQRT\n#define SQRT(x) " + root + "\n" + score.functions;
  const Columns out = run_lanes(score, width, in);
  std::string not_finite;
  for (std::size_t k = 0; k < out.size(); ++k)
    for (std::size_t row = 0; row < in[0].size(); ++row)
      if (!std::isfinite(out[k][row])) {
        not_finite += "\nscore " + std::to_string(k) + " of";
        for (const auto& column : in) not_finite += " " + std::to_string(column[row]);
      }
  CHECK(not_finite == "");
}

TEST_CASE("only what is asked for is computed; unknown names are errors", "[derivative]") {
  const std::string all =
      print_scores({{"score_rough_dielectric_1", {ROUGH_DIELECTRIC_alpha, ROUGH_DIELECTRIC_eta}}}, 3);
  const std::string alpha = print_scores({{"score_rough_dielectric_1", {ROUGH_DIELECTRIC_alpha}}}, 3);
  const std::string none = print_scores({}, 3);
  CHECK(all.size() - none.size() > 2 * (alpha.size() - none.size()));
  CHECK(alpha.size() > none.size());
  for (const std::string& name : score_function_names()) CHECK(none.find("void " + name + "(") < none.size());
  CHECK_THROWS_WITH(print_scores({{"score_unknown", {0}}}, 3), "no score function score_unknown");
  CHECK_THROWS_WITH(print_scores({{"score_henyey_greenstein", {1}}}, 3),
                    "score_henyey_greenstein does not depend on n[1]");
}

TEST_CASE("scores of one channel are those of the first of three", "[derivative]") {
  const std::string all = print_scores({{"score_homogeneous_passage", {HOMOGENEOUS_sigma_t}}}, 1);
  const std::string from = all.substr(all.find("void score_homogeneous_passage("));
  const std::string grey = from.substr(0, from.find('}'));
  CHECK(grey.find("d[0] = ") < grey.size());
  CHECK(grey.find("d[1] = ") == std::string::npos);
  CHECK(score_function("score_rough_dielectric_1").same_in_all_channels(ROUGH_DIELECTRIC_alpha));
  CHECK(!score_function("score_diffuse_0").same_in_all_channels(DIFFUSE_reflectance));
  CHECK(score_function("score_homogeneous_scattering").inputs_of(HOMOGENEOUS_albedo, 0) ==
        std::set<std::string>{"n[3]"});
}
