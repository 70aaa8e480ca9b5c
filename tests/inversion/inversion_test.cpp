// Inversions of small synthetic images.
#include <catch2/catch.hpp>

#include "runtime/inverse/gauss_newton/uncertainty.h"
#include "tests/inversion/small_scene.h"

using namespace itn;
using namespace itn::test;

namespace {

const std::vector<std::string> two{"fog.sigma_t", "fog.albedo"};

ForwardModel model_of(const Scene& scene, const std::vector<std::string>& names) {
  RenderOptions options;
  options.seed = 5;
  return ForwardModel(test::device(), scene, names, {0}, options);
}

InversionOptions samples(int spp) {
  InversionOptions how;
  how.spp = spp;
  return how;
}

// |found - truth| in standard errors.
double error(const ForwardModel& model, const Inversion::Conclusion& end, std::size_t p, double truth) {
  const auto i = static_cast<Eigen::Index>(p);
  return std::fabs(end.x[p] - model.coordinates()[p].of(truth)) / std::sqrt(end.covariance(i, i));
}

}  // namespace

TEST_CASE("Gauss-Newton finds the material from far away", "[stat]") {
  const std::vector<TargetImage> targets{rendered_target(test::device(), fog_ball(4, 0.5, 0.5), 256, 7)};
  ForwardModel model = model_of(fog_ball(1, 0.9, 0.5), two);
  Inversion inversion(model, targets, samples(1024));
  const Inversion::Conclusion end = invert(inversion, model.start());
  CHECK(end.converged);
  CHECK(end.residual == Approx(1).margin(0.5));
  CHECK(error(model, end, 0, 4) < 4);
  CHECK(error(model, end, 1, 0.5) < 4);
  const std::vector<Interval> found = intervals(model.coordinates(), end.x, end.covariance);
  CHECK(found[0].high - found[0].low < 1.5);  // and it knows something
  CHECK(found[1].high - found[1].low < 0.1);
}

// A pixel that is lit and one in the dark: what tells a number are two values, whose difference is no noise.
TEST_CASE("Gauss-Newton finds two numbers from two values in a few steps", "[stat]") {
  std::vector<TargetImage> targets{rendered_target(test::device(), fog_ball(4, 0.5, 0.5), 1024, 7)};
  std::fill(targets[0].weight.begin(), targets[0].weight.end(), 0.0F);
  for (const std::size_t x : {4U, 9U}) targets[0].weight[7 * 14 + x] = 1;
  ForwardModel model = model_of(fog_ball(3, 0.6, 0.5), two);
  Inversion inversion(model, targets, samples(4096));
  InversionState state = inversion.start(model.start());
  while (!state.done) inversion.advance(state);
  const Inversion::Conclusion end = inversion.conclude(state);
  CAPTURE(state.iteration, end.distance, end.hidden, end.x[0], end.x[1]);
  CHECK(end.converged);
  CHECK(state.iteration <= 15);
  CHECK(error(model, end, 0, 4) < 4);
  CHECK(error(model, end, 1, 0.5) < 4);
  CHECK(std::sqrt(end.covariance(0, 0)) < 1);  // and it knows something
}

TEST_CASE("Adam goes to the same place", "[stat]") {
  const std::vector<TargetImage> targets{rendered_target(test::device(), fog_ball(4, 0.5, 0.5), 4096, 7)};
  ForwardModel model = model_of(fog_ball(2, 0.7, 0.5), two);
  InversionOptions how = samples(128);
  how.method = InversionOptions::Method::adam;
  how.iterations = 120;
  how.learning_rate = 0.1;
  Inversion inversion(model, targets, how);
  const Inversion::Conclusion end = invert(inversion, model.start());
  CHECK(model.coordinates()[0].value(end.x[0]) == Approx(4).epsilon(0.2));
  CHECK(model.coordinates()[1].value(end.x[1]) == Approx(0.5).margin(0.05));
}

TEST_CASE("an unknown exposure is found along", "[stat]") {
  std::vector<TargetImage> targets{rendered_target(test::device(), fog_ball(4, 0.5, 0.5), 1024, 7)};
  for (std::size_t i = 0; i < targets[0].value.size(); ++i) {
    targets[0].value[i] *= 1.7F;
    targets[0].error[i] *= 1.7F;
  }
  for (const auto method : {InversionOptions::Method::gauss_newton, InversionOptions::Method::adam}) {
    ForwardModel model = model_of(fog_ball(3, 0.6, 0.5), two);
    InversionOptions how = samples(method == InversionOptions::Method::adam ? 16 : 1024);
    how.method = method;
    how.exposure = true;
    how.iterations = method == InversionOptions::Method::adam ? 40 : 0;
    Inversion inversion(model, targets, how);
    CHECK(inversion.names() == std::vector<std::string>{"fog.sigma_t", "fog.albedo", "exposure 0"});
    const Inversion::Conclusion end = invert(inversion, model.start());
    CHECK(std::exp(end.x[2]) == Approx(1.7).epsilon(0.05));
    if (method == InversionOptions::Method::gauss_newton) {
      CHECK(end.converged);
      CHECK(std::fabs(end.x[2] - std::log(1.7)) < 4 * std::sqrt(end.covariance(2, 2)));
      CHECK(error(model, end, 1, 0.5) < 4);
    }
  }
}

TEST_CASE("an interrupted inversion goes on with the same numbers") {
  const std::vector<TargetImage> targets{rendered_target(test::device(), fog_ball(4, 0.5, 0.5), 64, 7)};
  for (const auto method : {InversionOptions::Method::gauss_newton, InversionOptions::Method::adam}) {
    InversionOptions how = samples(method == InversionOptions::Method::adam ? 4 : 256);
    how.method = method;
    how.iterations = 7;
    ForwardModel model = model_of(fog_ball(2, 0.7, 0.5), two);
    Inversion whole(model, targets, how);
    InversionState at = whole.start(model.start());
    std::vector<InversionState> states;
    while (!at.done) {
      states.push_back(at);
      whole.advance(at);
    }
    const Inversion::Conclusion expected = whole.conclude(at);
    for (const std::size_t k : {std::size_t{0}, states.size() / 2, states.size() - 1}) {
      ForwardModel fresh = model_of(fog_ball(2, 0.7, 0.5), two);
      Inversion rest(fresh, targets, how);
      InversionState state = states[k];
      while (!state.done) rest.advance(state);
      CAPTURE(k);
      CHECK(state.x == at.x);
      const Inversion::Conclusion end = rest.conclude(state);
      CHECK(end.x == expected.x);
      CHECK(end.covariance == expected.covariance);
    }
  }
}

TEST_CASE("the directions of an ambiguity are those of the covariance") {
  const std::vector<Coordinate> c =
      model_of(fog_ball(4, 0.5, 0.5), {"fog.sigma_t", "fog.albedo", "phase.g"}).coordinates();
  const std::vector<double> x{c[0].of(4), c[1].of(0.5), c[2].of(0.5)};
  // sigma_t known to 10 %, and g with it: d g = 0.5 d log sigma_t; the albedo to 1 %, alone
  const double slope_albedo = c[1].slope(x[1]) / 0.5, slope_g = c[2].slope(x[2]);
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(3, 3);
  covariance(0, 0) = 0.01;
  covariance(1, 1) = 1e-4 / (slope_albedo * slope_albedo);
  covariance(2, 2) = 0.0025 / (slope_g * slope_g);
  covariance(0, 2) = covariance(2, 0) = 0.005 / slope_g;
  const std::vector<Direction> d = ambiguity(c, x, covariance);
  REQUIRE(d.size() == 3);
  CHECK(d[0].uncertainty == Approx(0).margin(1e-6));
  CHECK(d[1].uncertainty == Approx(0.01));
  CHECK(d[1].part[1] == Approx(1));
  CHECK(d[2].uncertainty == Approx(std::sqrt(0.0125)));
  CHECK(d[2].part[2] / d[2].part[0] == Approx(0.5));
  CHECK(words(d[2], c) == "fog.sigma_t +10 %, phase.g +0.05");
}

TEST_CASE("reduced scattering and absorption carry the covariance of what they are made of") {
  const Scene scene = fog_ball(4, 0.5, 0.5);
  const std::vector<Coordinate> c = model_of(scene, {"fog.sigma_t", "phase.g"}).coordinates();
  const std::vector<double> x{c[0].of(4), c[1].of(0.5)};
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(2, 2);
  covariance(0, 0) = 0.01;  // 10 % of sigma_t
  const std::vector<Interval> found = transport_coefficients(scene, c, x, covariance);
  REQUIRE(found.size() == 2);
  CHECK(found[0].name == "fog.reduced_scattering");
  CHECK(found[0].value == Approx(1));
  CHECK(found[0].stderr_ == Approx(0.1));
  CHECK(found[1].name == "fog.absorption");
  CHECK(found[1].value == Approx(2));
  CHECK(found[1].stderr_ == Approx(0.2));
}
