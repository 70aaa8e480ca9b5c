// Averages and their intervals: right by hand, and covering the truth as often as they say.
#include "network/evaluation/bootstrap.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "runtime/base/random.h"

using namespace itn;

namespace {

Clustered one_each(const std::vector<double>& values) {
  std::vector<std::size_t> cluster(values.size());
  for (std::size_t i = 0; i < cluster.size(); ++i) cluster[i] = i;
  return clustered(values, cluster);
}

// Squared errors of `clusters` cells of four images each: the cells differ in how large theirs are. True mean 1.25.
Clustered squares_of_cells(std::uint64_t seed, std::size_t clusters, double scale = 1) {
  std::vector<double> values;
  std::vector<std::size_t> cluster;
  for (std::size_t c = 0; c < clusters; ++c) {
    const double spread = 1 + 0.5 * random_normal(seed, 1, c);
    for (std::size_t i = 0; i < 4; ++i) {
      const double error = spread * random_normal(seed, 2, 4 * c + i);
      values.push_back(scale * error * error);
      cluster.push_back(c);
    }
  }
  return clustered(values, cluster);
}

}  // namespace

TEST_CASE("root mean squares and means by hand; runs are averaged; no images give no number") {
  const Clustered run = clustered(std::vector<double>{1, 4, 9}, std::vector<std::size_t>{3, 7, 7});
  CHECK(run.sum == std::vector<double>{1, 13});
  CHECK(run.count == std::vector<double>{1, 2});
  CHECK(average(run, Average::mean) == Approx(14.0 / 3));
  CHECK(average(run, Average::root_of_mean) == Approx(std::sqrt(14.0 / 3)));
  const Runs runs{one_each({1, 1}), one_each({9, 9})};
  CHECK(estimate(runs, Average::root_of_mean).value == Approx(2));  // not sqrt(5)
  CHECK(ratio(runs, {one_each({4, 4})}, Average::root_of_mean).value == Approx(1));
  CHECK(average(one_each({-1, 0.5}), Average::root_of_mean) == 0);
  CHECK(std::isnan(average(Clustered{}, Average::mean)));
}

TEST_CASE("the ratio of two medians") {
  const std::vector<double> a{1, 2, 30}, b{4, 4, 4};
  CHECK(ratio_of_medians(a, b).value == 0.5);
}

TEST_CASE("intervals of root mean squares cover the truth in about 95 of 100 data sets") {
  int covered = 0;
  constexpr int sets = 400;
  for (int s = 0; s < sets; ++s) {
    const Estimate e = estimate({squares_of_cells(static_cast<std::uint64_t>(s), 60)}, Average::root_of_mean,
                                {400, static_cast<std::uint64_t>(s)});
    CHECK((e.low <= e.value && e.value <= e.high));
    covered += e.low <= std::sqrt(1.25) && std::sqrt(1.25) <= e.high;
  }
  // Percentile intervals of 60 clusters cover a little less than they say; +-3 standard deviations of the count is 13.
  CAPTURE(covered);
  CHECK(covered >= 0.90 * sets);
  CHECK(covered <= 0.985 * sets);
}

TEST_CASE("images of a cell that err together count as one: clusters widen the interval") {
  std::vector<double> values;
  std::vector<std::size_t> cell, alone;
  for (std::size_t i = 0; i < 200; ++i) {
    values.push_back(std::exp(random_normal(5, 0, i / 10)));
    cell.push_back(i / 10);
    alone.push_back(i);
  }
  const Estimate together = estimate({clustered(values, cell)}, Average::mean),
                 apart = estimate({clustered(values, alone)}, Average::mean);
  CHECK(together.value == Approx(apart.value));
  CHECK(together.high - together.low > 2 * (apart.high - apart.low));  // sqrt(10) = 3.2 on the mean
}

TEST_CASE("a ratio of errors on the same images is known better than the errors") {
  const Clustered large = squares_of_cells(3, 40), small = squares_of_cells(3, 40, 0.25);
  const Estimate r = ratio({small}, {large}, Average::root_of_mean);
  CHECK(r.value == Approx(0.5));
  CHECK(r.high - r.low < 1e-9);
  const Estimate e = estimate({large}, Average::root_of_mean);
  CHECK(e.high - e.low > 0.1);
}

TEST_CASE("runs that disagree widen the interval, and one cell gives none") {
  const Clustered a = squares_of_cells(4, 40), b = squares_of_cells(4, 40, 9);
  const Estimate same = estimate({a, a}, Average::root_of_mean), differing = estimate({a, b}, Average::root_of_mean);
  CHECK(differing.low < average(a, Average::root_of_mean) * 1.5);
  CHECK(differing.high - differing.low > 3 * (same.high - same.low));
  const Estimate alone = estimate({squares_of_cells(4, 1)}, Average::root_of_mean);
  CHECK(std::isnan(alone.low));
  CHECK(std::isnan(alone.high));
}

TEST_CASE("the same seed gives the same interval") {
  const Runs runs{squares_of_cells(6, 30)};
  CHECK(estimate(runs, Average::mean, {500, 1}).low == estimate(runs, Average::mean, {500, 1}).low);
  CHECK(estimate(runs, Average::mean, {500, 1}).low != estimate(runs, Average::mean, {500, 2}).low);
}
