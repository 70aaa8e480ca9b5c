// Statistics against values that are known.
#include "runtime/base/statistics.h"

#include <catch2/catch.hpp>
#include <cmath>

using namespace itn;

TEST_CASE("the median of even and odd numbers of values, and of none") {
  CHECK(median({3, 1, 2}) == 2);
  CHECK(median({4, 1, 3, 2}) == 2.5);
  CHECK(std::isnan(median({})));
}

TEST_CASE("normal quantiles are those of tables, and invert the distribution function") {
  CHECK(normal_quantile(0.975) == Approx(1.959963985).epsilon(1e-9));
  CHECK(normal_quantile(0.5) == Approx(0).margin(1e-12));
  for (const double z : {-3.0, -0.2, 1.7}) CHECK(normal_quantile(normal_cdf(z)) == Approx(z).epsilon(1e-9));
}
