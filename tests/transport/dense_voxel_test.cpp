// Voxels as dense as any: light that meets one goes no further, and what passes beside it costs no more than elsewhere.
#include <catch2/catch.hpp>
#include <cmath>
#include <memory>

#include "../support/temporary_folder.h"
#include "../support/z_test.h"
#include "itn/file.h"
#include "runtime/scene/volume/volume_file.h"
#include "transport.h"

using namespace itn;
using namespace itn::test;

namespace {

// One dense voxel in thin fog.
Scene scene_with(const TemporaryFolder& folder, float dense, const std::string& more = "") {
  VoxelGrid grid;
  grid.width = grid.height = grid.depth = 5;
  grid.data.assign(125, 0.2F);
  grid.data[62] = dense;
  write_volume_file(folder / "a.vol", grid);
  write_file(folder / "scene.xml", R"(<scene version="3.0.0"><integrator type="volpath"/>
<sensor type="perspective"><float name="fov" value="30"/>
  <transform name="to_world"><lookat origin="0,0,-5" target="0,0,0" up="0,1,0"/></transform>
  <film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="4"/><rfilter type="box"/></film></sensor>
<emitter type="constant"/>
<shape type="cube"><bsdf type="null"/><medium name="interior" type="heterogeneous">
  <volume type="gridvolume" name="sigma_t"><string name="filename" value="a.vol"/>)" +
                                       more + R"(
  <transform name="to_world"><translate x="-0.5" y="-0.5" z="-0.5"/><scale value="2"/></transform></volume>
  <float name="albedo" value="0.6"/></medium></shape></scene>)");
  return load_scene(folder / "scene.xml");
}

}  // namespace

TEST_CASE("a voxel of any density is as opaque as a dense one, and ends", "[transport][stat]") {
  const TemporaryFolder folder;
  RenderOptions options = one_lane();
  options.spp = 256;
  options.seed = 1;
  for (const char* more : {"", "<integer name=\"bits\" value=\"32\"/>"}) {
    const Rendering dense = render(device(), scene_with(folder, 3e4F, more), options);
    for (const float value : {1e6F, 1e9F, 1e30F}) {
      ++options.seed;
      const Rendering denser = render(device(), scene_with(folder, value, more), options);
      INFO(value << ": " << image_mean(denser).value << ", " << image_mean(dense).value);
      CHECK(denser.endless == 0);
      CHECK(std::abs(image_mean(denser).value - image_mean(dense).value) <
            largest_z_bound(6, 1e-4) * std::hypot(image_mean(denser).stderr_, image_mean(dense).stderr_));
    }
  }
}
