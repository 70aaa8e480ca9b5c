// Which schedule and how many paths a launch: the same bits.
#include <catch2/catch.hpp>

#include "runtime/renderer.h"
#include "scenes.h"
#include "stage_test.h"

using namespace itn;
using namespace itn::test;

TEST_CASE("fused and staged schedules give the same bits for launches of any size") {
  Scene scene = sphere_scene(bsdf_of(BsdfKind::roughdielectric, 1.4, 0.3), medium_of(2, 0.9, 0.5));
  scene.sensors[0].to_world.m = {1, 0, 0, 0, 0, 0, 1, -4, 0, 1, 0, 0, 0, 0, 0, 1};
  scene.environment = wide_sun(40, {0.6, 0, 0.8}, 1);
  for (const int width : widths) {
    RenderOptions options;
    options.spp = 64;
    options.width = width;
    options.schedule = Schedule::fused;
    const Rendering fused = render(device(), scene, options);
    for (const int paths : {1000, 7777, 2000000000}) {
      options.schedule = Schedule::staged;
      options.paths_a_launch = paths;
      const Rendering staged = render(device(), scene, options);
      CAPTURE(width, paths);
      CHECK((staged.mean == fused.mean && staged.stderr_ == fused.stderr_));
    }
  }
}
