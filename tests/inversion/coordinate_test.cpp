// An optimizer's coordinates against the ranges of the parameters.
#include "runtime/inverse/coordinate.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "itn/error.h"
#include "kernels/model/obstacle.h"

using namespace itn;

namespace {

Parameter parameter(double low, double high) {
  Parameter p;
  p.name = "skin.number";
  p.low = low;
  p.high = high;
  p.low_included = low == 0;
  p.high_included = std::isfinite(high);
  return p;
}

}  // namespace

TEST_CASE("a coordinate leads back to its value, and its slope is the difference quotient") {
  for (const Parameter& p :
       {parameter(0, INFINITY), parameter(0, 1), parameter(-1, 1), parameter(1, 10), parameter(0.001, 1000)})
    for (const double share : {0.03, 0.4, 0.97}) {
      const Coordinate c(p);
      const double value = std::isfinite(p.high) ? p.low + share * (p.high - p.low) : 100 * share;
      const double x = c.of(value), step = 1e-5;
      CAPTURE(p.low, p.high, value, x);
      CHECK(c.value(x) == Approx(value).epsilon(1e-12));
      CHECK(c.slope(x) == Approx((c.value(x + step) - c.value(x - step)) / (2 * step)).epsilon(1e-8));
    }
}

TEST_CASE("coordinates pushed as far as they go stay within the range, in float too") {
  for (const Parameter& p :
       {parameter(0, INFINITY), parameter(0, 1), parameter(-1, 1), parameter(1, 10), parameter(0.001, 1000)})
    for (const double far : {-1e9, 1e9}) {
      const Coordinate c(p);
      const double x = c.clamp(far);
      CAPTURE(p.low, p.high, far);
      CHECK(c.at_edge(x));
      CHECK(c.value(x) > p.low);
      CHECK(static_cast<double>(static_cast<float>(c.value(x))) > p.low);
      CHECK(static_cast<double>(static_cast<float>(c.value(x))) < p.high);
    }
}

TEST_CASE("a refractive index of 1.5 starts there, though its range ends at 1000") {
  const Coordinate index(parameter(0.001, 1000));
  CHECK(index.value(index.of(1.5)) == Approx(1.5).epsilon(1e-12));
}

TEST_CASE("a roughness never falls where the image does not change with it") {
  Parameter alpha = parameter(0, 1);
  alpha.member = "alpha";
  const Coordinate c(alpha);
  CHECK(static_cast<double>(static_cast<float>(c.value(c.clamp(-1e9)))) > least_alpha);
  CHECK(c.value(c.of(1e-5)) > least_alpha);
}

TEST_CASE("starts lie within a factor of four, or in the inner four fifths of the range") {
  Parameter sigma_t = parameter(0, INFINITY);
  sigma_t.value = 20;
  const Coordinate log(sigma_t), logit(parameter(-1, 1));
  CHECK(log.value(log.start(0)) == Approx(5));
  CHECK(log.value(log.start(1)) == Approx(80));
  CHECK(logit.value(logit.start(0)) == Approx(-0.8));
  CHECK(logit.value(logit.start(1)) == Approx(0.8));
}

TEST_CASE("a start on the edge begins just inside, one beyond it is refused with the range") {
  const Coordinate albedo(parameter(0, 1));
  CHECK(albedo.value(albedo.of(1)) == Approx(1).margin(0.003));
  CHECK(albedo.value(albedo.of(1)) < 1);
  CHECK_THROWS_AS(albedo.of(1.2), UsageError);
  CHECK_THROWS_WITH(albedo.of(1.2), "parameter skin.number: the start is 1.2, need a number in [0, 1]");
}
