#include "tests/support/egg_set.h"

#include "network/dataset/dataset_light.h"
#include "runtime/scene/mesh/mesh_file.h"
#include "runtime/scene/shapes/polygonise.h"

using namespace itn;

EggSet::EggSet() {
  write_ply(folder / "egg.ply", shape_mesh(ellipsoid({1, 1, 1.4}), 600));
  set.size = 16;
  set.mm_per_unit = 2;
  set.shapes = {{"egg", Manifest::Role::train, "egg.exr", Manifest::FileMesh{"egg.ply"}}};
  for (const double azimuth : {30.0, 80.0}) set.lights.push_back({azimuth, 30, sun_direction(azimuth, 30), {}});
}
