// Volumes from OpenVDB files, whole and damaged; the files are written by OpenVDB itself.
#include <openvdb/io/File.h>
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include "runtime/scene/transform.h"
#include "runtime/scene/volume/packed_voxels.h"
#include "tests/scene/scene_folder.h"

using namespace itn;

namespace {

// Made by OpenVDB's list of types: Grid::create() compiles all that a grid can do, 3 s a type.
template <class Grid>
typename Grid::Ptr empty() {
  openvdb::initialize();
  return openvdb::gridPtrCast<Grid>(openvdb::GridBase::createGrid(Grid::gridType()));
}

// Voxels (2, -1, 3) to (4, 2, 7), of 0.5 along each axis, which begin at (10, 0, 0); value x + 10 y + 100 z, but for
// the first, which is not active.
template <class Grid>
typename Grid::Ptr steps(const std::string& name) {
  const auto grid = empty<Grid>();
  grid->setName(name);
  auto transform = openvdb::math::Transform::createLinearTransform(0.5);
  transform->postTranslate({10, 0, 0});
  grid->setTransform(transform);
  auto accessor = grid->getAccessor();
  for (int z = 3; z <= 7; ++z)
    for (int y = -1; y <= 2; ++y)
      for (int x = 2; x <= 4; ++x)
        if (x > 2 || y > -1 || z > 3)
          accessor.setValue({x, y, z}, typename Grid::ValueType(static_cast<float>(x + 10 * (y + 1) + 100 * z)));
  return grid;
}

void write(const SceneFolder& folder, const openvdb::GridPtrVec& grids,
           std::uint32_t compression = openvdb::io::COMPRESS_ZIP | openvdb::io::COMPRESS_ACTIVE_MASK) {
  openvdb::io::File file(folder.path("g.vdb"));
  file.setCompression(compression);
  file.write(grids);
}

std::string medium(const std::string& grid = "density", const std::string& more = "") {
  return "<medium type=\"heterogeneous\" id=\"m\">\n<volume type=\"vdbvolume\" name=\"sigma_t\">\n"
         "<string name=\"filename\" value=\"g.vdb\"/><string name=\"grid\" value=\"" +
         grid + "\"/>" + more + "</volume></medium>";
}

float voxel(const VoxelGrid& grid, int x, int y, int z, int channel = 0) {
  return grid.data[static_cast<std::size_t>(((z * grid.height + y) * grid.width + x) * grid.channels + channel)];
}

}  // namespace

TEST_CASE("a grid of an OpenVDB file arrives where the file says, with a layer of the background around") {
  SceneFolder folder;
  write(folder, {steps<openvdb::FloatGrid>("temperature"), steps<openvdb::FloatGrid>("density")});
  const Volume volume = *folder.load(medium()).media.at(0).value("sigma_t").volume;
  REQUIRE(volume.grid);
  const VoxelGrid& grid = *volume.grid;
  CHECK(grid.width == 5);
  CHECK(grid.height == 6);
  CHECK(grid.depth == 7);
  CHECK(grid.channels == 1);
  CHECK(voxel(grid, 1, 1, 1) == 0);  // not active
  CHECK(voxel(grid, 2, 1, 1) == 303);
  CHECK(voxel(grid, 3, 4, 5) == 734);
  CHECK(voxel(grid, 0, 3, 3) == 0);
  CHECK(voxel(grid, 4, 3, 3) == 0);
  // The middle of the first active layer's first voxel, (2, -1, 3): 1.5 voxels into the grid.
  const Vec3 middle = transform_point(volume.to_world, {1.5 / 5, 1.5 / 6, 1.5 / 7});
  CHECK(middle[0] == Approx(11));
  CHECK(middle[1] == Approx(-0.5));
  CHECK(middle[2] == Approx(1.5));
}

TEST_CASE("OpenVDB grids of doubles and of colours") {
  SceneFolder folder;
  write(folder, {steps<openvdb::DoubleGrid>("density"), steps<openvdb::Vec3SGrid>("tint")});
  CHECK(voxel(*folder.load(medium()).media.at(0).value("sigma_t").volume->grid, 3, 4, 5) == 734);
  const VoxelGrid tint = *folder.load(medium("tint")).media.at(0).value("sigma_t").volume->grid;
  CHECK(tint.channels == 3);
  for (const int channel : {0, 1, 2}) CHECK(voxel(tint, 3, 4, 5, channel) == 734);
}

TEST_CASE("wide OpenVDB grids that hold little keep the bricks that hold something") {
  SceneFolder folder;
  const auto wide = steps<openvdb::FloatGrid>("density");
  wide->getAccessor().setValue({1000, 600, 5}, 5.5F);
  wide->fill({{16, 16, 16}, {40, 40, 40}}, 2);  // tiles and parts of leaves
  write(folder, {wide});
  const Volume volume = *folder.load(medium()).media.at(0).value("sigma_t").volume;
  const VoxelGrid& grid = *volume.grid;
  REQUIRE(grid.packed);
  CHECK(grid.packed->bits == 32);
  CHECK(grid.packed->bytes() < (std::size_t{1} << 19));  // as floats: 97 MB
  CHECK((grid.packed->least == 0 && grid.packed->greatest == 734));
  const Vec3 corner = transform_point(volume.to_world, {0, 0, 0});
  CHECK(transform_point(volume.to_world, {1, 1, 1})[0] == Approx(corner[0] + 0.5 * grid.width));
  const std::array<int, 2> bricks{bricks_along(grid.width), bricks_along(grid.height)};
  const auto value = [&](int x, int y, int z) {
    const Vec3 place = Vec3{10 + 0.5 * x, 0.5 * y, 0.5 * z} - corner;  // the middle of that voxel
    std::array<int, 3> voxel{};
    for (std::size_t a = 0; a < 3; ++a) voxel[a] = static_cast<int>(std::floor(place[a] / 0.5));
    return grid.packed->value(grid.packed->voxel(bricks, voxel[0], voxel[1], voxel[2]));
  };
  CHECK(value(2, -1, 3) == 0);  // not active
  CHECK(value(4, 2, 7) == 734);
  CHECK(value(1000, 600, 5) == 5.5F);
  CHECK(value(999, 600, 5) == 0);
  for (const int x : {16, 23, 24, 32, 40}) CHECK(value(x, 33, 39) == 2);
  CHECK(value(15, 33, 39) == 0);
  CHECK(value(41, 33, 39) == 0);
}

TEST_CASE("a packed OpenVDB grid of colours") {
  SceneFolder folder;
  write(folder, {steps<openvdb::Vec3SGrid>("density")});
  const std::string text = medium();
  const VoxelGrid grid =
      *folder.load(text.substr(0, text.find("</volume>")) + "<integer name=\"bits\" value=\"16\"/></volume></medium>")
           .media.at(0)
           .value("sigma_t")
           .volume->grid;
  REQUIRE(grid.packed);
  CHECK(grid.channels == 3);
  const std::size_t voxel = grid.packed->voxel({bricks_along(grid.width), bricks_along(grid.height)}, 4, 10, 7);
  for (const std::size_t c : {0, 1, 2}) CHECK(grid.packed->value(3 * voxel + c) == Approx(734).margin(734. / 131070));
}

TEST_CASE("OpenVDB grids that are no densities are refused") {
  SceneFolder folder;
  write(folder, {steps<openvdb::FloatGrid>("density")});
  folder.check_error(medium("smoke"), 4, {"no grid \"smoke\"", "density"});

  const auto distances = steps<openvdb::FloatGrid>("density");
  distances->setGridClass(openvdb::GRID_LEVEL_SET);
  write(folder, {distances});
  folder.check_error(medium(), 4, {"level set"});

  write(folder, {steps<openvdb::Int32Grid>("density")});
  folder.check_error(medium(), 4, {"int32", "need float"});

  const auto nothing = empty<openvdb::FloatGrid>();
  nothing->setName("density");
  write(folder, {nothing});
  folder.check_error(medium(), 4, {"no active voxels"});

  for (const float value : {-1.0F, std::numeric_limits<float>::quiet_NaN(), 1e35F}) {
    auto grid = steps<openvdb::FloatGrid>("density");
    grid->getAccessor().setValue({3, 1, 5}, value);
    write(folder, {grid});
    folder.check_error(medium(), 4, {"voxel (3, 1, 5)"});  // as the file calls it
    folder.check_error(medium("density", "<integer name=\"bits\" value=\"8\"/>"), 4, {"voxel (3, 1, 5)"});
  }

  auto wide = steps<openvdb::FloatGrid>("density");
  wide->getAccessor().setValue({2000000000, 0, 0}, 1);
  wide->getAccessor().setValue({-2000000000, 0, 0}, 1);
  write(folder, {wide});
  folder.check_error(medium(), 4, {"along each axis"});

  auto far = steps<openvdb::FloatGrid>("density");
  far->getAccessor().setValue({4000, 4000, 4000}, 1);
  write(folder, {far});
  folder.check_error(medium(), 4, {"60 active voxels", "126", "bricks", "only 3", "far voxels"});

  auto frustum = steps<openvdb::FloatGrid>("density");
  frustum->setTransform(
      openvdb::math::Transform::createFrustumTransform(openvdb::BBoxd({0, 0, 0}, {10, 10, 10}), 0.5, 2));
  write(folder, {frustum});
  folder.check_error(medium(), 4, {"frustum"});
}

TEST_CASE("a file of grids one after another, without their places, is read whole or refused") {
  SceneFolder folder;
  {
    std::ofstream out(folder.path("g.vdb"), std::ios::binary);
    openvdb::io::Stream(out).write(openvdb::GridCPtrVec{steps<openvdb::FloatGrid>("density")});
  }
  CHECK(folder.load(medium()).media.size() == 1);
  const auto whole = std::filesystem::file_size(folder.path("g.vdb"));
  for (const std::uintmax_t size : {whole - 1, whole - 100, whole / 2, whole / 5}) {
    std::filesystem::resize_file(folder.path("g.vdb"), size);
    folder.check_error(medium(), 4, {"g.vdb"});
  }
}

TEST_CASE("OpenVDB files that are none, or cut, are refused") {
  SceneFolder folder;
  folder.write("g.vdb", "VOL, or anything else that is no OpenVDB file at all");
  folder.check_error(medium(), 4, {"g.vdb", "OpenVDB"});
  for (const std::uint32_t compression :
       {std::uint32_t{openvdb::io::COMPRESS_NONE}, std::uint32_t{openvdb::io::COMPRESS_ACTIVE_MASK},
        std::uint32_t{openvdb::io::COMPRESS_ZIP}}) {
    write(folder, {steps<openvdb::FloatGrid>("density")}, compression);
    const auto whole = std::filesystem::file_size(folder.path("g.vdb"));
    for (std::uintmax_t size = whole; size > 0;) {
      size -= std::min(size, size > whole - 12 ? 1 : 1 + whole / 30);
      INFO(size << " of " << whole << " bytes, compression " << compression);
      std::filesystem::resize_file(folder.path("g.vdb"), size);
      folder.check_error(medium(), 4, {"g.vdb"});
    }
  }
}
