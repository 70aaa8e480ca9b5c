// Inversions from far starts: what is called converged is right, and photographs of another scene are said to be so.
#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <chrono>
#include <ostream>

#include "runtime/inverse/gauss_newton/numbers_inversion.h"
#include "tests/inversion/small_scene.h"
#include "tests/support/temporary_folder.h"

using namespace itn;
using namespace itn::test;

namespace {

const std::vector<std::string> names{"fog.sigma_t", "fog.albedo", "phase.g"};

struct Kind {
  const char* name;
  bool sun, rough;
  int pixels;
};

Scene scene_of(const Kind& kind, double sigma_t, double albedo, double g) {
  Scene scene = fog_ball(sigma_t, albedo, g, kind.pixels);
  if (!kind.sun) scene.environment = make_environment("constant");
  if (kind.rough) scene.bsdfs[0] = bsdf_of("roughdielectric", 1.33, 0.2);
  return scene;
}

using Material = std::array<double, 3>;

// As coverage_test.cpp's posteriors: sigma_t evenly in its logarithm.
Material drawn(std::mt19937_64& random) {
  std::uniform_real_distribution<double> uniform(0, 1);
  const double sigma_t = std::pow(6, uniform(random)), albedo = 0.4 + 0.55 * uniform(random);
  return {sigma_t, albedo, uniform(random) - 0.2};
}

// Counts how often the truth is inside.
struct Inside {
  int photos = 0, intervals = 0, covered = 0;

  void add(const std::vector<Interval>& found, const Material& truth) {
    ++photos;
    for (std::size_t p = 0; p < 3; ++p) {
      ++intervals;
      covered += found[p].low <= truth[p] && truth[p] <= found[p].high;
    }
  }
};
std::ostream& operator<<(std::ostream& to, const Inside& i) {
  return to << i.photos << " converged, " << i.covered << " of " << i.intervals << " intervals hold";
}

// As `itn invert` with --range, which is the posterior, and beside it Gauss-Newton from a start that is drawn like the
// photo's material and from random ones.
struct Counts {
  int photos = 0, starts = 0;
  Inside first, newton, posterior;  // those that converged: the first of the starts alone, all of them, the posterior
  double seconds = 0, newton_seconds = 0;
};

Counts far_starts(const Kind& kind, int photos, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Counts counts;
  const TemporaryFolder folder;
  for (int k = 0; k < photos; ++k) {
    const Material truth = drawn(random), start = drawn(random);
    const std::uint64_t of_photo = 1000 * seed + static_cast<std::uint64_t>(k);
    const std::vector<TargetImage> targets{
        rendered_target(test::device(), scene_of(kind, truth[0], truth[1], truth[2]), 1024, of_photo)};
    const Scene scene = scene_of(kind, start[0], start[1], start[2]);
    ForwardModel model(test::device(), scene, names, {0}, RenderOptions());
    NumbersQuestion question;
    question.scene = "ball";
    question.folder = folder / std::to_string(k);
    question.targets = {"photo"};
    question.seed = of_photo;
    question.range = {{names[0], {1, 6}}, {names[1], {0.4, 0.95}}, {names[2], {-0.2, 0.8}}};
    question.request = {{"photo", k}};
    question.of_scene = {{"ball", kind.name}};
    const NumbersAnswer answer = invert_numbers(question, {}, scene, targets, model, {});
    if (answer.converged()) counts.posterior.add(answer.posterior->parameters, truth);
    counts.seconds += answer.posterior->seconds;

    question.method = "gauss-newton";
    question.folder += "_newton";
    question.range.clear();
    question.begun = std::chrono::steady_clock::now();
    const InversionOutcome found = *invert_numbers(question, {}, scene, targets, model, {}).inversion;
    counts.newton_seconds += found.seconds;
    counts.starts += static_cast<int>(found.runs.size());
    if (found.converged()) counts.newton.add(found.parameters, truth);
    const Inversion::Conclusion& of_first = found.runs[0].end;
    if (of_first.converged) counts.first.add(intervals(model.coordinates(), of_first.x, of_first.covariance), truth);
    ++counts.photos;
  }
  return counts;
}

// A photo of what is not assumed.
struct Wrong {
  const char* name;
  void (*scene)(Scene&);
  void (*photo)(TargetImage&, std::mt19937_64&);
};

void nothing(Scene&) {}
void as_it_is(TargetImage&, std::mt19937_64&) {}

void clipped(TargetImage& photo, std::mt19937_64&) {
  const float most = 0.7F * *std::max_element(photo.value.begin(), photo.value.end());
  for (float& v : photo.value) v = std::min(v, most);
}

void blurred(TargetImage& photo, std::mt19937_64&) {
  const std::vector<float> sharp = photo.value;
  for (int y = 0; y < photo.height; ++y)
    for (int x = 0; x < photo.width; ++x) {
      float sum = 0, count = 0;
      for (int v = std::max(0, y - 1); v <= std::min(photo.height - 1, y + 1); ++v)
        for (int u = std::max(0, x - 1); u <= std::min(photo.width - 1, x + 1); ++u, ++count)
          sum += sharp[static_cast<std::size_t>(v * photo.width + u)];
      photo.value[static_cast<std::size_t>(y * photo.width + x)] = sum / count;
    }
}

void noisier(TargetImage& photo, std::mt19937_64& random) {
  std::normal_distribution<float> normal;
  for (std::size_t i = 0; i < photo.value.size(); ++i) photo.value[i] += 1.5F * photo.error[i] * normal(random);
}

const std::vector<Wrong> wrongs{
    {"nothing wrong", nothing, as_it_is},
    {"sun 25 degrees away",
     [](Scene& s) {
       s.environment->sun.direction = {0.55, -0.65, 0.52};
     },
     as_it_is},
    {"rough boundary", [](Scene& s) { s.bsdfs[0] = bsdf_of("roughdielectric", 1.33, 0.2); }, as_it_is},
    {"radius 3 % larger", [](Scene& s) { s.shapes[0].radius = 1.03; }, as_it_is},
    {"saturated at 70 %", nothing, clipped},
    {"blurred by 3 x 3 pixels", nothing, blurred},
    {"noise 1.8 times as strong as said", nothing, noisier},
};

int found_wrong(const Wrong& wrong, int photos, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const Kind kind{"", true, false, 24};
  int count = 0;
  ForwardModel model(test::device(), scene_of(kind, 2, 0.7, 0.3), names, {0}, RenderOptions());
  for (int k = 0; k < photos; ++k) {
    const Material truth = drawn(random);
    Scene scene = scene_of(kind, truth[0], truth[1], truth[2]);
    wrong.scene(scene);
    std::vector<TargetImage> targets{
        rendered_target(test::device(), scene, 512, 1000 * seed + static_cast<std::uint64_t>(k))};
    wrong.photo(targets[0], random);
    InversionOptions how;
    how.iterations = 6;  // from the truth: where the light or the shape is another, many more would follow to no end
    Inversion inversion(model, targets, how);
    std::vector<double> x;
    for (std::size_t p = 0; p < 3; ++p) x.push_back(model.coordinates()[p].of(truth[p]));
    count += !invert(inversion, x).fit.fits();
  }
  return count;
}

}  // namespace

TEST_CASE("what the posterior finds holds the truth where Gauss-Newton would start far away", "[.far_starts]") {
  const std::vector<Kind> kinds{
      {"sun, matched, 14 x 14", true, false, 14},       {"sun, rough, 14 x 14", true, true, 14},
      {"constant, matched, 14 x 14", false, false, 14}, {"constant, rough, 14 x 14", false, true, 14},
      {"sun, matched, 32 x 32", true, false, 32},       {"constant, rough, 32 x 32", false, true, 32}};
  const int photos = 4;
  Inside all;
  int asked = 0;
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    const Counts c = far_starts(kinds[k], photos, 40 + k);
    WARN(kinds[k].name << ", of " << c.photos << " photos: the first start alone " << c.first << "; "
                       << c.starts / double(c.photos) << " starts " << c.newton << " in " << c.newton_seconds / c.photos
                       << " s; posterior " << c.posterior << " in " << c.seconds / c.photos << " s");
    asked += c.photos;
    all.photos += c.posterior.photos;
    all.intervals += c.posterior.intervals;
    all.covered += c.posterior.covered;
  }
  CHECK(all.photos >= 0.9 * asked);
  CHECK(all.covered >= 0.92 * all.intervals);
}

TEST_CASE("photographs of another scene are said not to fit, those of this one seldom", "[.trust]") {
  const int photos = 20;
  for (const Wrong& wrong : wrongs) {
    const int found = found_wrong(wrong, photos, 60);
    WARN(wrong.name << ": " << found << " of " << photos << " do not fit");
    if (&wrong == &wrongs.front())
      CHECK(found <= 3);
    else
      CHECK(found >= 0.9 * photos);
  }
}
