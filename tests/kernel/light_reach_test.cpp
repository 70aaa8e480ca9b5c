// Bodies that refract find a light by where it stands and how wide they see it (runtime/render/compile/light_reach.h).
#include "runtime/render/compile/light_reach.h"

#include <catch2/catch.hpp>

#include "../support/meshes.h"
#include "kernels/model/models.h"
#include "kernels/shared/light_layout.h"

using namespace itn;
using namespace itn::test;

namespace {

Light point_at(double x, double y, double z) {
  Light light;
  light.become(*find_model(light_models(), "point"));
  light.set("position", Rgb{x, y, z});
  return light;
}

// A scene with a body of rough glass that is filled with a medium.
Scene scene_of(Shape body, const char* bsdf = "roughdielectric") {
  Scene scene;
  body.bsdf = 0;
  body.interior = 0;
  scene.shapes = {body};
  scene.bsdfs = {make_bsdf(bsdf)};
  return scene;
}

int reach_of_point(const Scene& scene, double x, double y, double z) {
  return RefractingBodies(scene).reach(point_at(x, y, z), nullptr, nullptr);
}

int reach_of_lamp(const Scene& scene, const Shape& lamp) {
  Light light;
  light.become(*find_model(light_models(), "area"));
  const LightSurfaces surfaces = light_surfaces(lamp, 0);
  return RefractingBodies(scene).reach(light, &lamp, &surfaces);
}

}  // namespace

TEST_CASE("a point inside of a ball or a mesh is inside, one in the corner of its box is not", "[light]") {
  for (const Scene& scene : {scene_of(sphere({0, 0, 0}, 1)), scene_of(shape_of(icosphere(3)))}) {
    CHECK(reach_of_point(scene, 0.3, -0.5, 0.7) == LIGHT_INSIDE);
    CHECK(reach_of_point(scene, 0.9, 0.9, 0.9) == LIGHT_AIMED_AT);
    CHECK(reach_of_point(scene, 0, 0, 2) == LIGHT_AIMED_AT);
    CHECK_FALSE(RefractingBodies(scene).has_panes());
  }
  CHECK(reach_of_point(scene_of(sphere({0, 0, 0}, 1), "diffuse"), 0, 0, 0) == LIGHT_AIMED_AT);
}

TEST_CASE("a lamp is aimed at where bodies see it small, and inside where the medium is around it", "[light]") {
  const Scene scene = scene_of(sphere({0, 0, 0}, 1));
  CHECK(reach_of_lamp(scene, sphere({0, 0, 4}, 0.3)) == LIGHT_AIMED_AT);
  CHECK(reach_of_lamp(scene, sphere({0, 0, 4}, 2.5)) == LIGHT_AT_BOUNDARIES);
  CHECK(reach_of_lamp(scene, shape_of(moved(icosphere(2), 0.2F, {0, 0, 0.5F}))) == LIGHT_INSIDE);
  Shape lamp = sphere({0, 0, 4}, 0.3);
  lamp.exterior = 0;
  CHECK(reach_of_lamp(scene, lamp) == LIGHT_INSIDE);
}

TEST_CASE("a rough surface without an inside is a pane", "[light]") {
  Scene scene = scene_of(disk({0, 0, 0}, {1, 0, 0}, {0, 1, 0}));
  scene.shapes[0].interior = -1;
  CHECK(RefractingBodies(scene).has_panes());
  scene.bsdfs = {make_bsdf("dielectric")};
  CHECK_FALSE(RefractingBodies(scene).has_panes());
}
