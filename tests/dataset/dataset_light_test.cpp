// The lights of a data set: where an environment's light comes from, and pictures that cannot be light.
#include "network/dataset/dataset_light.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "itn/error.h"
#include "itn/exr.h"
#include "itn/file.h"
#include "itn/renderer.h"
#include "network/dataset/dataset_scene.h"
#include "network/dataset/shape_buffers.h"
#include "runtime/scene/shapes/polygonise.h"
#include "runtime/scene/transform.h"
#include "tests/support/temporary_folder.h"

using namespace itn;

namespace {

constexpr int width = 64, height = 33;

Bitmap dark() { return {width, height, 1, std::vector<float>(static_cast<std::size_t>(width * height))}; }

// Light of one picture row, from the direction between two columns: a lamp.
void add_lamp(Bitmap& picture, int row, int left_column, float radiance = 1) {
  for (const int column : {left_column, left_column + 1})
    picture.data[static_cast<std::size_t>(row * width + column % width)] += radiance;
}

double zenith_of_row(int row) { return 180.0 * row / (height - 1); }

Environment light_of(const Bitmap& picture, double azimuth) {
  return environment_light(std::make_shared<const Bitmap>(picture), azimuth, 1);
}

void check_near(const Vec3& a, const Vec3& b) {
  for (std::size_t k = 0; k < 3; ++k) CHECK(a[k] == Approx(b[k]).margin(0.01));
}

}  // namespace

TEST_CASE("every named direction of the sun: 0 degrees is behind the object, 90 to its side, the zenith above") {
  CHECK(sun_direction(0, 30)[1] == Approx(0.5));  // the camera looks along +y
  CHECK(sun_direction(90, 30)[0] == Approx(0.5));
  CHECK(sun_direction(45, 0)[2] == Approx(1));
}

TEST_CASE(
    "a lamp in the middle of a picture stands where a sun of its azimuth does, one on the right has a greater one") {
  constexpr int row = 6, middle = width / 2 - 1, quarter = width / 4;
  for (const double azimuth : {0.0, 30.0, 90.0, -120.0}) {
    CAPTURE(azimuth);
    Bitmap picture = dark();
    add_lamp(picture, row, middle);
    check_near(mean_direction(light_of(picture, azimuth)), sun_direction(azimuth, zenith_of_row(row)));
    picture = dark();
    add_lamp(picture, row, middle + quarter);
    check_near(mean_direction(light_of(picture, azimuth)), sun_direction(azimuth + 90, zenith_of_row(row)));
  }
}

TEST_CASE("the mean direction weighs by luminance and solid angle what is above the floor") {
  Bitmap picture = dark();
  add_lamp(picture, 8, 3, 2);
  add_lamp(picture, 8, 3 + width / 2, 2);
  check_near(mean_direction(light_of(picture, 10)), {0, 0, 1});  // two of the same, opposite
  add_lamp(picture, 30, 20, 1000);
  check_near(mean_direction(light_of(picture, 10)), {0, 0, 1});  // below the floor
  picture = dark();
  std::fill(picture.data.begin(), picture.data.end(), 0.25F);
  check_near(mean_direction(light_of(picture, 10)), {0, 0, 1});  // the same from everywhere
  check_near(mean_direction(light_of(dark(), 10)), {0, 0, 1});   // none at all

  // Half the sphere as bright as can be, the other half dark, the border through the zenith: by symmetry the mean lies
  // in the plane of the lit half's middle and the zenith, at 45 degrees: both its components are integrals of a cosine
  // over a quarter of the sphere.
  picture = dark();
  for (int y = 0; y < height; ++y)
    for (int x = width / 4; x < 3 * width / 4; ++x) picture.data[static_cast<std::size_t>(y * width + x)] = 7;
  check_near(mean_direction(light_of(picture, 90)), {std::sqrt(0.5), 0, std::sqrt(0.5)});

  // Colours count by their luminance: green more than blue.
  Bitmap coloured{width, height, 3, std::vector<float>(static_cast<std::size_t>(3 * width * height))};
  for (const int side : {0, 1})
    for (const int column : {side * width / 2 + 3, side * width / 2 + 4})
      coloured.data[static_cast<std::size_t>(3 * (8 * width + column) + 1 + side)] = 1;  // left green, right blue
  const Vec3 towards = mean_direction(light_of(coloured, 0));
  Bitmap green = dark();
  add_lamp(green, 8, 3);
  CHECK(dot(towards, mean_direction(light_of(green, 0))) > 0.95);
}

TEST_CASE("a lamp to the right throws the object's shadow to the left of the image") {
  Manifest set;
  set.size = 16;
  Bitmap picture = dark();
  add_lamp(picture, 10, width / 2 - 1, 100);
  const auto ball_mesh = std::make_shared<const Mesh>(shape_mesh(ball({0, 0, 0}, 1), 800));
  const Scene scene = dataset_scene(set, ball_mesh, light_of(picture, 90), {300, 0.3, 0});
  RenderOptions options;
  options.spp = 256;
  const Rendering rendering = render(Device(), scene, options);
  const ShapeBuffers seen = shape_buffers(scene, 0, 1);
  double left = 0, right = 0;
  for (std::size_t i = 0; i < rendering.mean.size(); ++i)
    if (seen.mask[i] == 0) (i % 16 < 8 ? left : right) += rendering.mean[i];
  CHECK(left < 0.9 * right);
}

TEST_CASE("a picture that cannot be light is refused with the file, the pixel and what is needed") {
  const TemporaryFolder folder;
  const std::string file = folder / "room.exr";
  const auto refusal = [&] {
    try {
      read_environment(file);
    } catch (const InputError& error) {
      CHECK_THAT(error.what(), Catch::StartsWith(file + ": "));
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  using Catch::Contains;
  CHECK_THAT(refusal(), Contains("cannot be read"));
  write_file(file, "words");
  CHECK_THAT(refusal(), Contains("is no OpenEXR, PNG, JPEG"));
  ExrImage image{4, 3, {"R", "G", "B"}, std::vector<float>(36, 0.5F), {}};
  write_exr(file, image);
  CHECK(refusal() == "accepted");
  image.data[3 * (4 * 2 + 1) + 2] = -0.25F;
  write_exr(file, image);
  CHECK_THAT(refusal(), Contains("column 1, row 2, channel 2 is -0.25; 1.4 % of the light is negative"));
  image.data[3 * (4 * 2 + 1) + 2] = -0.017F;  // of 17.5
  write_exr(file, image);
  CHECK(refusal() == "accepted");
  CHECK(read_environment(file)->data[3 * (4 * 2 + 1) + 2] == 0);
  for (const float wrong : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    image.data[3 * (4 * 2 + 1) + 2] = wrong;
    write_exr(file, image);
    CHECK_THAT(refusal(), Contains("column 1, row 2, channel 2 is") && Contains("need finite numbers"));
  }
  write_exr(file, {2, 2, {"R", "G", "B"}, std::vector<float>(12, 0.5F), {}});
  CHECK_THAT(refusal(), Contains("has 2 x 2 pixels; need") && Contains("3 x 3 or more"));
}

TEST_CASE("a set's lights are suns and environments as its manifest says; a picture is read once") {
  const TemporaryFolder folder;
  write_exr(folder / "room.exr", {4, 3, {"R", "G", "B"}, std::vector<float>(36, 0.5F), {}});
  Manifest set;
  set.lights = {{30, 30, sun_direction(30, 30), {}},
                {0, 0, {0, 0, 1}, Manifest::Environment{"room.exr", 2}},
                {90, 0, {0, 0, 1}, Manifest::Environment{"room.exr", 2}},
                {0, 0, {0, 0, 1}, Manifest::Environment{"nowhere.exr", 2}}};
  DatasetLights lights(set, folder / "");
  CHECK(lights.of(0).type() == "sunsky");
  CHECK(lights.of(0).sun.direction == set.lights[0].direction);
  const Environment room = lights.of(1), turned = lights.of(2);
  CHECK((room.type() == "envmap" && room.number("scale") == 2));
  CHECK(room.bitmap == turned.bitmap);
  CHECK(room.to_world.m == light_of(dark(), 0).to_world.m);
  CHECK(turned.to_world.m == light_of(dark(), 90).to_world.m);
  CHECK_THROWS_WITH(lights.of(3), Catch::Contains("nowhere.exr"));
}
