// Elements that XML nests around BSDFs, as one BSDF: sampled in proportion to its density, a sample's weight its value
// over its density, on the device as in double precision, and differentiated as the sum that it is.
#include "runtime/scene/model/structure.h"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "../support/chi_square.h"
#include "../support/lane_function.h"
#include "runtime/render/compile/surfaces.h"
#include "runtime/render/derivative/score_functions.h"
#include "runtime/scene/model/sized_model.h"
#include "runtime/scene/model/structure_formula.h"

using namespace itn;
using namespace itn::test;

namespace {

constexpr double significance = 1e-6;
using Direction = Vector3<double>;

Direction direction(double theta, double phi) {
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

Bsdf diffuse(double r, double g, double b) {
  Bsdf bsdf = make_bsdf("diffuse");
  bsdf.set("reflectance", Rgb{r, g, b});
  return bsdf;
}

Bsdf metal(double alpha = 0.3) {
  Bsdf bsdf = make_bsdf("roughconductor", "ggx");
  bsdf.set("alpha", alpha);
  bsdf.set("eta", Rgb{0.2, 0.9, 1.1});
  bsdf.set("k", Rgb{3.9, 2.4, 2.1});
  return bsdf;
}

Bsdf mirror() {
  Bsdf bsdf = make_bsdf("conductor");
  bsdf.set("eta", Rgb{0.2, 0.9, 1.1});
  bsdf.set("k", Rgb{3.9, 2.4, 2.1});
  return bsdf;
}

Instance nest(const char* type) {
  Instance instance;
  instance.become(*find_model(nest_models(), type));
  return instance;
}

Bsdf blend(double weight, const Bsdf& a, const Bsdf& b) {
  Instance of = nest("blendbsdf");
  of.set("weight", weight);
  return make_nest(of, {a, b});
}

Bsdf mask(double opacity, const Bsdf& inside) {
  Instance of = nest("mask");
  of.set("opacity", opacity);
  return make_nest(of, {inside});
}

Bsdf normal_map(const Rgb& colour, const Bsdf& inside) {
  Instance of = nest("normalmap");
  of.set("normalmap", colour);
  return make_nest(of, {inside});
}

Bsdf twosided(const Bsdf& front, const Bsdf& back) { return make_nest(nest("twosided"), {front, back}); }
Bsdf twosided(const Bsdf& inside) { return make_nest(nest("twosided"), {inside}); }

Bsdf dictionary(const std::vector<double>& weights, const std::vector<Bsdf>& inside) {
  Instance of;
  of.become(dictionary_model(weights.size()));
  for (std::size_t k = 0; k < weights.size(); ++k) of.values[k].value.fill(weights[k]);
  return make_nest(of, inside);
}

const Rgb tilted{0.65, 0.4, 0.9}, straight{0.5, 0.5, 1};

struct Named {
  std::string name;
  Bsdf bsdf;
  bool reciprocal = true;
};

std::vector<Named> structures() {
  const Bsdf paint = diffuse(0.7, 0.3, 0.1), plastic = make_bsdf("roughplastic", "ggx");
  Bsdf brushed = make_bsdf("roughconductor", "ggx");
  brushed.become(*find_of_type(*brushed.model, BSDF_ANISOTROPIC), 1);
  brushed.set("alpha_u", 0.5);
  brushed.set("alpha_v", 0.2);
  const Bsdf worn = blend(0.35, normal_map(tilted, metal()), paint);
  return {
      {"blend", blend(0.3, paint, metal())},
      {"nested blend", blend(0.6, blend(0.4, plastic, mirror()), paint)},
      {"dictionary", dictionary({0.6, 1.2, 0.2, 0.4}, {paint, metal(), mirror(), plastic})},
      {"dictionary in a dictionary",
       mask(0.9, dictionary({3, 1}, {metal(), dictionary({0.1, 0.3}, {paint, brushed})}))},
      {"mask", mask(0.7, paint)},
      {"normal map", normal_map(tilted, brushed), false},
      {"normal map around twosided", normal_map(tilted, twosided(paint)), false},
      {"blend in a normal map", normal_map(tilted, blend(0.5, paint, metal())), false},
      {"two sides", twosided(blend(0.2, paint, plastic), metal())},
      {"worn metal on both sides", twosided(worn), false},
      {"worn metal with holes", mask(0.8, twosided(worn)), false},
      {"frosted", blend(0.5, make_bsdf("roughdielectric", "ggx"), twosided(paint)), false},
  };
}

std::vector<double> numbers(const Bsdf& bsdf) { return bsdf.model->to_numbers(0, bsdf.slots()); }

StructureFormula<double> formula(const Bsdf& bsdf, const std::vector<double>& n) {
  return {*bsdf.model->structure, n.data()};
}

// Draws from four uniform numbers: wo, weights, density and inverse index, and the leaf that was picked.
LaneFunction drawing(const Bsdf& bsdf, const Direction& wi) {
  const Model& model = *bsdf.model;
  std::string prefix = model.name;
  std::transform(prefix.begin(), prefix.end(), prefix.begin(), [](unsigned char c) { return std::toupper(c); });
  LaunchData data;
  data.structures[model.id] = &model;
  BsdfRecord record{};
  record.surface = model.id;
  data.bsdfs.push_back(record);
  LaneFunction call{{"scattering/structure.h"},
                    {"u0", "u1", "u2", "u3"},
                    {"x", "y", "z", "weight0", "weight2", "pdf", "scale", "picked"},
                    ""};
  call.functions = structures_text(data) + "STRUCTURE_FUNCTIONS(" + model.name + ", " + prefix + ")\n";
  const std::vector<double> n = numbers(bsdf);
  call.body = "REAL n[" + std::to_string(n.size()) + "] = {";
  for (const double value : n) call.body += "(REAL)(" + std::to_string(value) + "f), ";
  call.body += "};\nconst REAL u[4] = {u0, u1, u2, u2};\nREAL3 wo;\nREAL weight[3];\n";
  call.body += "const REAL3 wi = make3((REAL)(" + std::to_string(wi.x) + "f), (REAL)(" + std::to_string(wi.y) +
               "f), (REAL)(" + std::to_string(wi.z) + "f));\n";
  call.body += "picked = n[" + prefix + "_picked] = " + model.name + "_pick(n, wi, u3);\n" + model.name +
               "_draw(0, n, wi, u, &wo, weight, &pdf, &scale);\n"
               "x = wo.x; y = wo.y; z = wo.z; weight0 = weight[0]; weight2 = weight[2];";
  return call;
}

// Directions from which light comes and is seen by wi, in equal steps.
template <class Function>
double integral(const Function& f) {
  return integrate([&](double t, double phi) { return f(direction(t, phi)) * std::sin(t); },
                   {0, PI_, 0, 2 * PI_, 48, 48}, 1e-3);
}

}  // namespace

TEST_CASE("samples of structures follow their density (chi-square), and weigh value over density", "[model][stat]") {
  constexpr std::size_t count = 1 << 16;
  const double theta = GENERATE(0.4, 1.2, PI_ - 0.7);
  for (const Named& named : structures()) {
    const std::vector<double> n = numbers(named.bsdf);
    const StructureFormula<double> f = formula(named.bsdf, n);
    const Direction wi = direction(theta, 0.7);
    const Columns out = run_lanes(
        drawing(named.bsdf, wi), 16,
        {uniform_numbers(count, 1), uniform_numbers(count, 2), uniform_numbers(count, 3), uniform_numbers(count, 4)});
    std::vector<Point> samples;
    std::size_t off = 0, drawn = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const Direction wo{out[0][i], out[1][i], out[2][i]};
      const bool lost = !(out[5][i] > 0);
      samples.push_back({lost ? std::nan("") : wo.z, std::atan2(wo.y, wo.x)});
      if (lost) continue;
      ++drawn;
      const std::vector<double> value = f.value(wi, wo);
      const double pdf = f.density(wi, wo), radiance = out[6][i] * out[6][i];
      for (const auto& [c, column] : {std::pair{0U, 3U}, {2U, 4U}})
        off += !(std::abs(out[column][i] * radiance * pdf - value[c]) <= 3e-3 * value[c] + 1e-6);
      off += !(std::abs(out[5][i] - pdf) <= 3e-3 * pdf);
    }
    CAPTURE(named.name, theta, drawn, off);
    CHECK(off <= count / 500);  // single precision near grazing directions
    if (drawn == 0) continue;
    const auto density = [&](double z, double phi) {
      const double sine = std::sqrt(std::max(0.0, 1 - z * z));
      return f.density(wi, {sine * std::cos(phi), sine * std::sin(phi), z});
    };
    const ChiSquare result = chi_square(samples, density, {-1, 1 + 1e-6, -PI_, PI_, 48, 24});
    CAPTURE(result.statistic, result.degrees_of_freedom);
    CHECK(result.p_value > significance);
  }
}

TEST_CASE("structures draw the same one path and sixteen at a time", "[model]") {
  constexpr std::size_t count = 1024;
  const Columns u{uniform_numbers(count, 4), uniform_numbers(count, 5), uniform_numbers(count, 6),
                  uniform_numbers(count, 7)};
  for (const Named& named : structures()) {
    const LaneFunction call = drawing(named.bsdf, direction(0.8, 0.7));
    const Columns narrow = run_lanes(call, 1, u), wide = run_lanes(call, 16, u);
    std::size_t off = 0;
    for (std::size_t k = 0; k < narrow.size(); ++k)
      for (std::size_t i = 0; i < count; ++i)
        off += !(std::abs(narrow[k][i] - wide[k][i]) <= 1e-3 * (1e-2 + std::abs(wide[k][i])));
    CAPTURE(named.name, off);
    CHECK(off < count / 100);  // choices that tip over by rounding
  }
}

TEST_CASE("leaves are picked as often as their shares say, and what passes straight on is what is left", "[model]") {
  constexpr std::size_t count = 1 << 16;
  const Bsdf bsdf = mask(0.7, blend(0.25, diffuse(0.5, 0.5, 0.5), metal()));
  const Columns out = run_lanes(
      drawing(bsdf, direction(0.4, 0)), 16,
      {uniform_numbers(count, 1), uniform_numbers(count, 2), uniform_numbers(count, 3), uniform_numbers(count, 4)});
  std::map<int, double> share;
  for (const float picked : out[7]) share[static_cast<int>(std::lround(picked))] += 1.0 / count;
  CHECK(share[0] == Approx(0.7 * 0.75).margin(0.01));
  CHECK(share[1] == Approx(0.7 * 0.25).margin(0.01));
  CHECK(share[PASSAGE_LEAF] == Approx(0.3).margin(0.01));
  for (std::size_t i = 0; i < count; ++i) {
    if (out[7][i] != PASSAGE_LEAF) continue;
    CHECK(out[3][i] == 1.0F);
    CHECK(out[2][i] == Approx(-std::cos(0.4)).epsilon(1e-6));
    break;
  }
}

TEST_CASE("structures give back no more light than arrives; a white one gives back all", "[model]") {
  for (const Named& named : structures())
    for (const double theta : {0.3, 1.2, PI_ - 0.5}) {
      const std::vector<double> n = numbers(named.bsdf);
      const StructureFormula<double> f = formula(named.bsdf, n);
      const Direction wi = direction(theta, 0.2);
      double chosen = 0;  // in mirrors
      std::vector<double> of_leaf = n;
      for (std::size_t k = 0; k < named.bsdf.model->structure->leaves.size(); ++k) {
        of_leaf[static_cast<std::size_t>(named.bsdf.model->structure->picked)] = static_cast<double>(k);
        chosen += formula(named.bsdf, of_leaf).chosen(wi, {-wi.x, -wi.y, wi.z})[0];
      }
      const double eta = 1.5046 / 1.000277;
      const double power = integral([&](const Direction& wo) {
        const std::vector<double> value = f.value(wi, wo);
        const double inside = wi.z > 0 ? eta * eta : 1 / (eta * eta);
        return *std::max_element(value.begin(), value.end()) * (wi.z * wo.z < 0 ? inside : 1);
      });
      CAPTURE(named.name, theta, power, chosen);
      CHECK(power + chosen < 1 + 5e-3);
    }
  const Bsdf white = blend(0.3, diffuse(1, 1, 1), blend(0.6, diffuse(1, 1, 1), diffuse(1, 1, 1)));
  const std::vector<double> n = numbers(white);
  CHECK(integral([&](const Direction& wo) { return formula(white, n).value(direction(0.5, 0), wo)[1]; }) ==
        Approx(1).epsilon(1e-3));
}

TEST_CASE("structures without bent normals are reciprocal", "[model]") {
  const auto u = uniform_numbers(2000, 11);
  for (const Named& named : structures()) {
    if (!named.reciprocal) continue;
    const std::vector<double> n = numbers(named.bsdf);
    const StructureFormula<double> f = formula(named.bsdf, n);
    double worst = 0;
    for (std::size_t i = 0; i < u.size(); i += 4) {
      const Direction a = direction(std::acos(u[i]), 6.28 * u[i + 1]),
                      b = direction(std::acos(u[i + 2]), 6.28 * u[i + 3]);
      const std::vector<double> forth = f.value(a, b), back = f.value(b, a);
      for (std::size_t c = 0; c < 3; ++c)
        worst = std::max(worst, std::abs(forth[c] / b.z - back[c] / a.z) / (forth[c] / b.z + 1e-12));
    }
    CAPTURE(named.name);
    CHECK(worst < 1e-9);
  }
}

TEST_CASE("a blend is the sum of its parts; normals that are straight up change nothing", "[model]") {
  const auto u = uniform_numbers(400, 12);
  const Bsdf paint = diffuse(0.7, 0.3, 0.1), plain = normal_map(straight, blend(0.3, paint, metal())),
             same = blend(0.3, paint, metal());
  const std::vector<double> n = numbers(plain), m = numbers(same), of_paint = paint.model->to_numbers(0, paint.slots()),
                            of_metal = metal().model->to_numbers(1, metal().slots());
  for (std::size_t i = 0; i < u.size(); i += 4) {
    const Direction a = direction(std::acos(u[i]), 6.28 * u[i + 1]),
                    b = direction(std::acos(u[i + 2]), 6.28 * u[i + 3]);
    double first[3], second[3];
    diffuse_value(0, of_paint.data(), a, b, first);
    rough_conductor_value(1, of_metal.data(), a, b, second);
    for (std::size_t c = 0; c < 3; ++c) {
      CHECK(formula(same, m).value(a, b)[c] == Approx(0.7 * first[c] + 0.3 * second[c]).epsilon(1e-12));
      CHECK(formula(plain, n).value(a, b)[c] == Approx(0.7 * first[c] + 0.3 * second[c]).epsilon(1e-9));
    }
  }
}

TEST_CASE("a dictionary weighs its entries by their share of the sum of weights", "[model]") {
  const Bsdf paint = diffuse(0.7, 0.3, 0.1), two = dictionary({1.4, 0.6}, {paint, metal()}),
             same = blend(0.3, paint, metal());
  const std::vector<double> n = numbers(two), m = numbers(same);
  const Direction a = direction(0.4, 1), b = direction(0.9, 2);
  for (std::size_t c = 0; c < 3; ++c) CHECK(formula(two, n).value(a, b)[c] == Approx(formula(same, m).value(a, b)[c]));
  CHECK(numbers(dictionary({3, 0, 1}, {paint, paint, paint}))[0] == Approx(0.75));
}

TEST_CASE("the scores of structures are the derivatives of their values by all parameters", "[model]") {
  const auto u = uniform_numbers(80, 21);
  for (const Named& named : structures())
    for (const bool chosen : {false, true}) {
      const Model& model = *named.bsdf.model;
      const Structure& structure = *model.structure;
      const ScoreFunction& score = score_function(structure, chosen);
      const std::vector<double> at = named.bsdf.slots();
      const auto by = model.jacobian(0, at);
      std::vector<double> leaves{0};
      if (chosen) {
        for (std::size_t k = 1; k < structure.leaves.size(); ++k) leaves.push_back(static_cast<double>(k));
        leaves.push_back(PASSAGE_LEAF);
      }
      for (const double leaf : leaves)
        for (const DeclaredParameter& p : model.parameters)
          for (int c = 0; c < p.kind.channels && p.kind.listed && p.called != "scale"; ++c) {
            const auto slot = static_cast<std::size_t>(p.slot + c);
            const double h = 1e-3 * std::max(std::abs(at[slot]), 0.1);
            std::vector<std::vector<double>> moved;
            for (const int k : {-2, -1, 0, 1, 2}) {
              std::vector<double> there = at;
              there[slot] += k * h;
              moved.push_back(model.to_numbers(0, there));
              moved.back()[static_cast<std::size_t>(structure.picked)] = leaf;
            }
            double worst = 0;
            for (std::size_t i = 0; i < u.size(); i += 4) {
              const Direction wi = direction(std::acos(u[i]), 6.28 * u[i + 1]);
              const Direction wo =
                  chosen ? Direction{-wi.x, -wi.y, wi.z} : direction(std::acos(u[i + 2]), 6.28 * u[i + 3]);
              std::array<double, 5> f{};
              for (std::size_t k = 0; k < 5; ++k) {
                const StructureFormula<double> there(structure, moved[k].data());
                f[k] = (chosen ? there.chosen(wi, wo) : there.value(wi, wo))[static_cast<std::size_t>(c)];
              }
              if (!(f[0] > 1e-6)) continue;
              std::map<std::string, double> inputs{{"wi.x", wi.x}, {"wi.y", wi.y}, {"wi.z", wi.z},
                                                   {"wo.x", wo.x}, {"wo.y", wo.y}, {"wo.z", wo.z}};
              for (std::size_t k = 0; k < moved[2].size(); ++k) inputs["n[" + std::to_string(k) + "]"] = moved[2][k];
              std::vector<int> wanted;
              for (const auto& [place, node] : score.derivatives) wanted.push_back(node);
              const std::vector<double> value = score.graph.evaluate(wanted, inputs);
              double sum = 0;
              for (const auto& [place, node] : score.derivatives)
                if (place.second == c)
                  sum += value[static_cast<std::size_t>(node)] * by[static_cast<std::size_t>(place.first)][slot];
              const double difference = (8 * std::log(f[3] / f[1]) - std::log(f[4] / f[0])) / (12 * h);
              worst = std::max(worst, std::abs(sum - difference) / (1 + std::abs(difference)));
            }
            CAPTURE(named.name, chosen, leaf, p.name, c);
            CHECK(worst < 1e-5);
          }
    }
}

TEST_CASE("the score of a mixture is sum(w f s) / sum(w f)", "[model]") {
  const Bsdf paint = diffuse(0.7, 0.3, 0.1), shiny = metal(), both = blend(0.3, paint, shiny);
  const std::vector<double> n = numbers(both), own = shiny.model->to_numbers(1, shiny.slots());
  const Direction wi = direction(0.5, 0.3), wo = direction(0.7, 2.9);
  const auto at = [&](const ScoreFunction& score, const std::vector<double>& values, int slot) {
    std::map<std::string, double> inputs{{"wi.x", wi.x}, {"wi.y", wi.y}, {"wi.z", wi.z},
                                         {"wo.x", wo.x}, {"wo.y", wo.y}, {"wo.z", wo.z}};
    for (std::size_t k = 0; k < values.size(); ++k) inputs["n[" + std::to_string(k) + "]"] = values[k];
    const int node = score.derivatives.at({slot, 0});
    return score.graph.evaluate({node}, inputs)[static_cast<std::size_t>(node)];
  };
  double first[3], second[3];
  const std::vector<double> of_paint = paint.model->to_numbers(0, paint.slots());
  diffuse_value(0, of_paint.data(), wi, wo, first);
  rough_conductor_value(1, own.data(), wi, wo, second);
  const Structure& s = *both.model->structure;
  const int alpha = s.pieces[2].first_number + shiny.model->number_called("alpha").slot;
  const double leaf_score =
      at(score_function("score_rough_conductor_1"), own, shiny.model->number_called("alpha").slot);
  const double sum = 0.7 * first[0] + 0.3 * second[0];
  CHECK(at(score_function(s, false), n, alpha) == Approx(0.3 * second[0] * leaf_score / sum).epsilon(1e-9));
  CHECK(at(score_function(s, false), n, 0) == Approx((second[0] - first[0]) / sum).epsilon(1e-9));
}

TEST_CASE("what cannot be nested is refused with a remedy", "[model]") {
  const Model &normals = *find_model(nest_models(), "normalmap"), &sides = *find_model(nest_models(), "twosided");
  CHECK(refusal_of_nest(normals, {mask(0.5, metal())}).find("inside of the mask") != std::string::npos);
  CHECK(refusal_of_nest(normals, {make_bsdf("null")}).find("straight on") != std::string::npos);
  CHECK(refusal_of_nest(sides, {mask(0.5, metal())}).find("around twosided") != std::string::npos);
  CHECK(refusal_of_nest(sides, {blend(0.5, make_bsdf("dielectric"), metal())}).find("reflects") != std::string::npos);
  CHECK(refusal_of_nest(normals, {twosided(blend(0.5, metal(), diffuse(0, 0, 0)))}).empty());
}
