// Solids: where they are, and that their slope is at most 1.
#include "runtime/scene/shapes/solid.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "runtime/scene/transform.h"
#include "tests/shapes/mesh_checks.h"

using namespace itn;

TEST_CASE("Solids are negative inside, zero on their surface and positive outside") {
  const auto crosses = [](const Solid& solid, const Vec3& surface, const Vec3& outwards) {
    CHECK(solid(surface) == Approx(0).margin(1e-12));
    CHECK(solid(surface + 0.01 * outwards) > 0);
    CHECK(solid(surface + -0.01 * outwards) < 0);
  };
  crosses(ball({1, 0, 0}, 0.5), {1, 0.5, 0}, {0, 1, 0});
  crosses(ellipsoid({0.2, 0.5, 1}), {0, 0, -1}, {0, 0, -1});
  crosses(box({0.2, 0.5, 1}), {0.1, 0.5, 0.3}, {0, 1, 0});
  crosses(cylinder(0.4, 1), {0, -0.4, 0.9}, {0, -1, 0});
  crosses(torus(1, 0.25), {0, 0.75, 0}, {0, -1, 0});
  crosses(capsule({0, 0, 0}, {1, 0, 0}, 0.2, 0.1), {0.5, 0, 0.15}, {0, 0, 1});
  crosses(superquadric({0.5, 0.6, 0.7}, 1, 8), {0.25, 0.3, 0}, {1, 1, 0});
  crosses(extruded(polygon({{0, 0}, {1, 0}, {0, 1}}), 0.5), {0.5, 0.5, 0}, {1, 1, 0});
  crosses(revolved(polygon({{0.2, 0}, {0.6, 0}, {0.6, 1}, {0.2, 1}})), {0, 0.2, 0.5}, {0, -1, 0});
  crosses(wavy_ball(0.8, {{{3, 0, 0}, 0.1, 0}}), {0, 0.9, 0}, {0, 1, 0});
  crosses(moved(ball({0, 0, 0}, 0.5), {0, 0, 1}), {0, 0, 1.5}, {0, 0, 1});
  crosses(turned(box({1, 0.5, 0.2}), rotate({0, 0, 1}, 90)), {0.1, 1, 0}, {0, 1, 0});
  crosses(stretched(ball({0, 0, 0}, 0.5), {1, 2, 3}), {0, 0, 1.5}, {0, 0, 1});
  // A quarter turn at height 1, and half the size there.
  crosses(twisted(box({0.8, 0.2, 1.5}), 1.5707963267948966, 0.9), {0, 0.8, 1}, {0, 1, 0});
  crosses(tapered(box({0.8, 0.2, 1}), 0.5, 1, 0.9), {0.6, 0, 0}, {1, 0, 0});
  crosses(shell(ball({0, 0, 0}, 0.5), 0.2), {0, 0.4, 0}, {0, -1, 0});
  crosses(rounded(box({0.2, 0.2, 0.2}), 0.1), {0.3, 0, 0}, {1, 0, 0});
  crosses(in_ring(ball({1, 0, 0}, 0.2), 4), {0, 1.2, 0}, {0, 1, 0});
}

TEST_CASE("Operations join and cut") {
  const Solid a = ball({0, 0, 0}, 0.5), b = ball({0.6, 0, 0}, 0.5);
  const Vec3 in_a{-0.4, 0, 0}, in_both{0.3, 0, 0}, in_b{1, 0, 0}, beside{0.3, 0.42, 0};
  const Solid both = unite({a, b}), cut = subtract(a, b), common = intersect(a, b);
  CHECK((both(in_a) < 0 && both(in_both) < 0 && both(in_b) < 0));
  CHECK((cut(in_a) < 0 && cut(in_both) > 0 && cut(in_b) > 0));
  CHECK((common(in_a) > 0 && common(in_both) < 0 && common(in_b) > 0));
  CHECK(both(beside) > 0);
  CHECK(unite_smoothly({a, b}, 0.3)(beside) < 0);
  CHECK(subtract_smoothly(a, b, 0.3)(in_a) == Approx(a(in_a)));
}

TEST_CASE("No solid is steeper than 1, so that its value is never more than the distance to its surface") {
  const Solid star = extruded(polygon(star_corners(5, 0.8, 0.4)), 0.7);
  const std::vector<Solid> solids{ellipsoid({0.2, 0.5, 1}),
                                  box({0.2, 0.5, 1}),
                                  torus(1, 0.25),
                                  capsule({-1, 0, 0}, {1, 0.5, 0}, 0.5, 0.05),
                                  tube({{{-1, 0, 0}, 0.1}, {{0, 0, 0}, 0.4}, {{0, 1, 0}, 0.1}}, true),
                                  superquadric({0.3, 0.6, 0.9}, 1, 1.3),
                                  superquadric({0.3, 0.6, 0.9}, 6, 16),
                                  wavy_ball(0.8, {{{5, 0, 0}, 0.1, 1}, {{0, 4, 4}, 0.05, 2}}),
                                  gyroid(0.7, 0.1),
                                  star,
                                  revolved(disc(0.7)),
                                  unite_smoothly({ball({0, 0, 0}, 0.5), box({0.2, 0.5, 1})}, 0.4),
                                  subtract_smoothly(ball({0, 0, 0}, 0.9), box({0.2, 0.5, 1}), 0.4),
                                  stretched(star, {0.4, 1, 1.6}),
                                  twisted(star, 3, 0.8),
                                  tapered(star, 0.3, 0.7, 0.8),
                                  tapered(star, 2, 0.7, 0.8),
                                  bumpy(star, 0.05, 0.3),
                                  in_ring(moved(star, {0.5, 0, 0}), 3)};
  for (std::size_t i = 0; i < solids.size(); ++i) {
    CAPTURE(i);
    CHECK(test::steepest_slope(solids[i], 20000) <= 1 + 1e-9);
  }
}
