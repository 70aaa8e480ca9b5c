// Posteriors whose renderings are in a folder.
#include "runtime/inverse/posterior/stored_posterior.h"

#include <catch2/catch.hpp>
#include <filesystem>
#include <limits>

#include "itn/error.h"
#include "itn/exr.h"
#include "itn/file.h"
#include "tests/inversion/small_scene.h"
#include "tests/support/temporary_folder.h"

using namespace itn;
using namespace itn::test;

namespace {

const StoredRun::Json scene_request{{"scene", "fog ball"}};

struct Small {
  explicit Small(double sigma_t, double albedo)
      : targets{rendered_target(test::device(), fog_ball(sigma_t, albedo, 0.5), 64, 7)} {
    for (const Coordinate& c : model.coordinates())
      ranges.push_back(c.parameter().name == "fog.sigma_t" ? NaturalRange(c.parameter(), 0.5, 8)
                                                           : NaturalRange(c.parameter(), 0.2, 0.95));
    how.rounds = 2;
    how.samples = 200;
    how.spp = 32;
  }

  // Advances at most so many times, with everything opened anew; the samples, if it is done then.
  Eigen::MatrixXd go_on(const std::string& folder, const std::string& renderings, int times) {
    RenderingStore store(renderings, scene_request, 2);
    StoredPosterior stored(folder, {{"targets", "one"}}, store, model, ranges, targets, how);
    for (int k = 0; k < times && !stored.done(); ++k) stored.advance();
    made = stored.made();
    found = stored.found();
    return stored.done() ? stored.posterior().samples().at : Eigen::MatrixXd();
  }

  std::vector<TargetImage> targets;
  ForwardModel model{test::device(), fog_ball(2, 0.7, 0.5), {"fog.sigma_t", "fog.albedo"}, {0}, RenderOptions()};
  std::vector<NaturalRange> ranges;
  PosteriorOptions how;
  std::size_t made = 0, found = 0;
};

constexpr int all = 1000;

}  // namespace

TEST_CASE("a posterior that was stopped after any rendering ends with the same samples") {
  const TemporaryFolder folder;
  Small small(4, 0.5);
  const Eigen::MatrixXd whole = small.go_on(folder / "whole", folder / "whole/renderings", all);
  const std::size_t renderings = small.made;
  CHECK(whole.cols() == 200);
  Eigen::MatrixXd parts;
  for (int k = 0; k < 20 && parts.size() == 0; ++k)
    parts = small.go_on(folder / "parts", folder / "parts/renderings", 11 + 7 * k);
  CHECK(parts == whole);
  CHECK(small.made == renderings);
  CHECK(small.found == 0);
}

TEST_CASE("the next photo of a scene finds the renderings of the last one") {
  const TemporaryFolder folder;
  Small first(4, 0.5), second(2, 0.8);
  first.go_on(folder / "first", folder / "renderings", all);
  const std::size_t renderings = first.made;
  second.go_on(folder / "second", folder / "renderings", all);
  CHECK(second.found == renderings);
  CHECK(second.made < renderings / 2);
  // the first goes on with what it had
  first.go_on(folder / "first", folder / "renderings", all);
  CHECK(first.found == 0);
  CHECK(first.made == renderings);
}

TEST_CASE("renderings of another scene are refused, and damaged ones by name") {
  const TemporaryFolder folder;
  Small small(4, 0.5);
  small.go_on(folder / "fit", folder / "renderings", 3);
  CHECK_THROWS_AS(RenderingStore(folder / "renderings", StoredRun::Json{{"scene", "another"}}, 2), UsageError);
  CHECK_THROWS_AS(RenderingStore(folder / "renderings", scene_request, 3), InputError);
  const std::string kept = folder / "renderings/000001_0.exr";
  const std::string other = read_file(folder / "renderings/000000_0.exr"), own = read_file(kept);
  write_file(kept, other);
  CHECK_THROWS_WITH(small.go_on(folder / "fit", folder / "renderings", all),
                    Catch::Contains("000001_0.exr: has changed since it was written"));
  write_file(kept, own);
  ExrImage image = read_exr(kept);
  image.data[8] += 0.25F;
  write_exr(kept, image);
  CHECK_THROWS_WITH(small.go_on(folder / "fit", folder / "renderings", all),
                    Catch::Contains("000001_0.exr: has changed since"));
  image.data[7] = std::numeric_limits<float>::infinity();
  write_exr(kept, image);
  CHECK_THROWS_WITH(small.go_on(folder / "fit", folder / "renderings", all), Catch::Contains("000001_0.exr"));
  write_exr(kept, ExrImage{1, 1, image.channels, std::vector<float>(image.channels.size()), {}});
  CHECK_THROWS_WITH(small.go_on(folder / "fit", folder / "renderings", all), Catch::Contains("1 x 1 pixels"));
  write_file(kept, "nothing");
  CHECK_THROWS_WITH(small.go_on(folder / "fit", folder / "renderings", all), Catch::Contains("000001_0.exr"));
}

TEST_CASE("natural coordinates lead back to values, their slope is a difference, and priors are those of values") {
  const ForwardModel model(test::device(), fog_ball(2, 0.7, 0.5), {"fog.sigma_t", "fog.albedo", "phase.g"}, {0},
                           RenderOptions());
  std::vector<NaturalRange> ranges;
  for (const Coordinate& c : model.coordinates()) ranges.push_back(NaturalRange::of_scene(c.parameter()));
  CHECK(ranges[0].low() == 0.2);
  CHECK(ranges[0].high() == 20);
  CHECK(ranges[2].low() == Approx(-1).margin(1e-3));
  ranges.push_back(NaturalRange::of_prior(model.coordinates()[1], 0.5, 4));
  for (const NaturalRange& range : ranges)
    for (const double t : {-0.9, -0.2, 0.5, 0.99}) {
      CAPTURE(range.parameter().name, t);
      constexpr double h = 1e-5;
      CHECK(range.of(range.value(t)) == Approx(t));
      CHECK(range.slope(t) == Approx((range.value(t + h) - range.value(t - h)) / (2 * h)).epsilon(1e-4));
    }
  // even in the albedo, so by the coordinate the density is the slope
  CHECK(std::exp(ranges[1].log_prior(0.7) - ranges[1].log_prior(0)) ==
        Approx(ranges[1].slope(0.7) / ranges[1].slope(0)));
  CHECK(ranges[0].log_prior(0.7) == ranges[0].log_prior(-0.7));
  CHECK_THROWS_AS(NaturalRange(model.coordinates()[1].parameter(), 0.5, 1.5), UsageError);
  CHECK_THROWS_AS(NaturalRange(model.coordinates()[0].parameter(), 0, 5), UsageError);
}
