#include <catch2/catch.hpp>
#include <cstdlib>

#include "tests/geometry/geometry_device.h"

using namespace itn;
using namespace itn::test;

namespace {

// ITN_SEGMENTS: how long the walks are when run by hand.
std::uint64_t segments() {
  const char* given = std::getenv("ITN_SEGMENTS");
  return given ? static_cast<std::uint64_t>(std::atof(given)) : 200'000;
}

void check_walk(const char* name, const Shape& shape, Vec3 start, int box_width = 16) {
  const GeometryOnDevice g(scene_of({shape}), box_width == 4 ? 1 : box_width, box_width);
  for (const double mean : {0.0, 0.03}) {
    const WalkCounts counts = g.walk(start, mean, segments(), 7);
    INFO(name << ", mean free path " << mean << ": " << counts.segments << " segments, " << counts.surface
              << " ended on the surface");
    CHECK(counts.surface > counts.segments / 1000);
    CHECK(counts.escaped == 0);
    CHECK(counts.front == 0);
    if (std::getenv("ITN_SEGMENTS"))
      WARN(name << " " << mean << ": " << counts.surface << " hits, " << counts.escaped << " escaped, " << counts.front
                << " front");
  }
}

}  // namespace

TEST_CASE("a walk inside a torus knot never leaks") {
  check_walk("knot", shape_of(torus_knot(512, 64)), {1, 0, 0});
  check_walk("knot far from the origin", shape_of(moved(torus_knot(512, 64), 1, {100, -70, 30})), {101, -70, 30});
}
TEST_CASE("a walk inside a cube never leaks") {
  check_walk("cube", shape_of(cube(1)), {0.1, 0.2, 0.3});
  check_walk("cube, width 4", shape_of(cube(1)), {0.1, 0.2, 0.3}, 4);
  check_walk("cube, width 8", shape_of(cube(1)), {0.1, 0.2, 0.3}, 8);
}
TEST_CASE("a walk inside a spiky ball never leaks") {
  check_walk("spiky", shape_of(spiky(3, 0.2f, 3)), {0.01, 0.02, 0.03});
}
TEST_CASE("a walk inside a sharp star never leaks") {
  check_walk("star", shape_of(star_plate(7, 0.05f)), {0.001, 0.002, 0.003});
}
TEST_CASE("a walk inside a sphere never leaks") {
  check_walk("sphere", sphere({0.2, 0.1, -0.3}, 0.7), {0.2, 0.3, -0.3});
}
