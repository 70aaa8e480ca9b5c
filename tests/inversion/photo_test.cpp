// Photographs: what a camera does to the light is found along, and intervals hold for 8 bits.
#include <catch2/catch.hpp>
#include <random>

#include "runtime/image/png.h"
#include "runtime/image/srgb.h"
#include "runtime/inverse/gauss_newton/uncertainty.h"
#include "tests/inversion/small_scene.h"
#include "tests/support/temporary_folder.h"

using namespace itn;
using namespace itn::test;

namespace {

constexpr double red_balance = 1.3, blue_balance = 0.6, taken_at = 0.5;

Scene coloured_ball(double sigma_t, double albedo) {
  Scene scene = fog_ball(sigma_t, albedo, 0.5, 28);
  scene.sensors[0].luminance = false;
  return scene;
}

// Three channels without noise, a parameter's derivative in each.
Rendering made_rendering(double x) {
  Rendering r;
  r.width = r.height = 8;
  r.channels = 3;
  r.spp = 16;
  r.derivatives.resize(1);
  for (int i = 0; i < 8 * 8 * 3; ++i) {
    r.mean.push_back(static_cast<float>(2 + std::sin(0.3 * i) * x));
    r.stderr_.push_back(0.1F);
    r.derivatives[0].mean.push_back(static_cast<float>(std::sin(0.3 * i)));
    r.derivatives[0].stderr_.push_back(0.1F);
  }
  return r;
}

// The image as a camera of that many electrons a well takes it, as a file of 8 bits.
void write_photo(const std::string& file, const Rendering& image, double exposure, double electrons,
                 std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  std::vector<std::uint8_t> samples;
  for (const float radiance : image.mean)
    for (int c = 0; c < 3; ++c) {  // each has noise of its own
      const double light = exposure * static_cast<double>(radiance);
      const double counted = std::clamp(light + std::sqrt(light / electrons) * normal(random), 0.0, 1.0);
      samples.push_back(static_cast<std::uint8_t>(std::lround(255 * srgb_encode(counted))));
    }
  write_png(file, image.width, image.height, samples);
}

}  // namespace

TEST_CASE("the equations' derivatives by exposures and white balance are those of differences") {
  Parameter parameter;
  parameter.name = "x";
  parameter.high = INFINITY;
  const std::vector<Coordinate> coordinates{Coordinate(parameter)};
  const std::vector<double> at{0.1, 0.2, -0.3, 0.4, -0.2};  // two targets
  const auto render = [&](const std::vector<double>& x) { return made_rendering(coordinates[0].value(x[0])); };
  TargetImage target{8, 8, 3, std::vector<float>(8 * 8 * 3, 2.5F), std::vector<float>(64, 1.0F), {}};
  const std::vector<TargetImage> targets(2, target);
  std::vector<Reference> references;
  for (std::size_t t = 0; t < 2; ++t)
    references.push_back(reference_of(render(at), targets[t], t, 0.05, coordinates, at, true));
  const auto equations = [&](const std::vector<double>& x) {
    return least_squares({render(x), render(x)}, targets, references, coordinates, x, true);
  };
  const LeastSquares here = equations(at);
  constexpr double step = 1e-3;
  for (std::size_t k = 0; k < 5; ++k) {
    std::vector<double> up = at, down = at;
    up[k] += step;
    down[k] -= step;
    const Eigen::VectorXd difference = (equations(up).gradient - equations(down).gradient) / (2 * step);
    const auto column = static_cast<Eigen::Index>(k);
    CAPTURE(k);
    CHECK((difference - here.information.col(column)).norm() < 2e-3 * here.information.col(column).norm());
  }
}

TEST_CASE("exposure and white balance of a photo are found along with the material", "[stat]") {
  RenderOptions options;
  options.spp = 256;
  options.seed = 7;
  const Rendering image = render(test::device(), coloured_ball(4, 0.5), options);
  TargetImage target{image.width, image.height, 3, {}, {}, {}};
  const double factors[3] = {taken_at * red_balance, taken_at, taken_at * blue_balance};
  for (std::size_t i = 0; i < image.mean.size(); ++i) {
    target.value.push_back(static_cast<float>(factors[i % 3]) * image.mean[i]);
    target.error.push_back(static_cast<float>(factors[i % 3]) * image.stderr_[i]);
  }
  target.weight.assign(target.value.size() / 3, 1.0F);
  const std::vector<TargetImage> targets{target};
  RenderOptions of_model;
  of_model.seed = 5;
  ForwardModel model(test::device(), coloured_ball(3, 0.6), {"fog.sigma_t", "fog.albedo"}, {0}, of_model);
  InversionOptions how;
  how.spp = 512;
  how.exposure = how.white_balance = true;
  Inversion inversion(model, targets, how);
  CHECK(inversion.names() ==
        std::vector<std::string>{"fog.sigma_t", "fog.albedo", "exposure 0", "white balance R", "white balance B"});
  const Inversion::Conclusion end = invert(inversion, model.start());
  CAPTURE(end.distance, end.hidden, end.determined, end.residual);
  REQUIRE(end.converged);
  const std::vector<double> truth{model.coordinates()[0].of(4), model.coordinates()[1].of(0.5), std::log(taken_at),
                                  std::log(red_balance), std::log(blue_balance)};
  for (std::size_t k = 0; k < truth.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    CAPTURE(k, end.x[k], truth[k]);
    CHECK(std::fabs(end.x[k] - truth[k]) < 4 * std::sqrt(end.covariance(i, i)));
    CHECK(std::sqrt(end.covariance(i, i)) < 0.3);  // and it knows something
  }
  for (std::size_t c = 0; c < 3; ++c) CHECK(end.factors[0][c] == Approx(factors[c]).epsilon(0.05));
}

// 8 bits, photons, saturated highlights, an unknown exposure.
TEST_CASE("95 % intervals hold the truth in 92 to 98 % of photos of 8 bits", "[.photo_coverage]") {
  constexpr int photos = 150;
  const Device& device = test::device();
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> uniform;
  const TemporaryFolder folder;
  int converged = 0, covered = 0, intervals_seen = 0;
  double saturated = 0, residual = 0;
  for (int k = 0; k < photos; ++k) {
    const double truth[2] = {1.5 + 3.5 * uniform(random), 0.4 + 0.5 * uniform(random)};
    RenderOptions of_photo;
    of_photo.spp = 16384;  // its own noise is far below the camera's
    of_photo.seed = 1000 + static_cast<std::uint64_t>(k);
    const Scene scene = fog_ball(truth[0], truth[1], 0.3);
    const Rendering image = render(device, scene, of_photo);
    const float brightest = *std::max_element(image.mean.begin(), image.mean.end());
    const double exposure = (0.9 + 0.2 * uniform(random)) / static_cast<double>(brightest);
    write_photo(folder / "photo.png", image, exposure, 5000, random);
    const std::vector<TargetImage> targets{read_target(folder / "photo.png", "", image.width, image.height, 1)};
    for (const float weight : targets[0].weight) saturated += weight == 0;
    RenderOptions options;
    options.seed = 5000 + static_cast<std::uint64_t>(k);
    ForwardModel model(device, scene, {"fog.sigma_t", "fog.albedo"}, {0}, options);
    std::vector<double> start = model.start();
    for (double& x : start) x += uniform(random) - 0.5;
    InversionOptions how;
    how.spp = 4096;
    how.exposure = true;
    Inversion inversion(model, targets, how);
    const Inversion::Conclusion end = invert(inversion, start);
    residual += end.residual / photos;
    if (!end.converged) continue;
    ++converged;
    const std::vector<Interval> found = intervals(model.coordinates(), end.x, end.covariance);
    for (std::size_t p = 0; p < 2; ++p) covered += found[p].low <= truth[p] && truth[p] <= found[p].high;
    const Interval of_exposure = exposures(model.coordinates(), end.x, end.covariance, inversion.names())[0];
    covered += of_exposure.low <= exposure && exposure <= of_exposure.high;
    intervals_seen += 3;
  }
  const double share = double(covered) / intervals_seen;
  WARN(converged << " of " << photos << " converged, coverage " << 100 * share << " %, residual " << residual
                 << " times the noise's variance, saturated " << 100 * saturated / photos / (14 * 14) << " %");
  CHECK(converged >= 0.97 * photos);
  CHECK(share > 0.92);
  CHECK(share < 0.98);
}
