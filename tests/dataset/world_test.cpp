// Data sets of scenes as people have them: cameras all around, drawn boundaries and lights, colours and a flash.
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <set>

#include "itn/colour.h"
#include "itn/error.h"
#include "itn/exr.h"
#include "itn/file.h"
#include "itn/renderer.h"
#include "network/dataset/dataset_scene.h"
#include "network/dataset/plan.h"
#include "network/dataset/shape_buffers.h"
#include "runtime/scene/shapes/polygonise.h"
#include "runtime/scene/transform.h"
#include "tests/support/temporary_folder.h"

using namespace itn;
using Catch::Contains;

namespace {

DatasetConfig config_of(const std::string& json) {
  const TemporaryFolder folder;
  write_file(folder / "config.json", json);
  return read_dataset_config(folder / "config.json");
}

Manifest plan_of(const std::string& json) { return plan_dataset(config_of(json), "0", "device").manifest; }

constexpr const char* small =
    R"({"preset": "world", "flash": 3, "train": {"random_shapes": 50}, "test": {"random_shapes": 4}})";

std::shared_ptr<const Mesh> egg() { return std::make_shared<const Mesh>(shape_mesh(ellipsoid({1, 0.6, 1.4}), 4000)); }

// Radiance of a white floor that faces the zenith, over 1 / pi: its irradiance, in luminance.
double irradiance_on_floor(const Environment& light) {
  Manifest set;
  set.size = 8;
  set.in_colours = true;
  Scene scene = dataset_scene(set, egg(), light);
  scene.shapes.resize(1);
  scene.media.clear();
  scene.bsdfs.resize(1);
  scene.bsdfs[0].value("reflectance") = Texture();
  scene.bsdfs[0].set("reflectance", 1);
  RenderOptions options;
  options.spp = 4096;
  const Rendering rendering = render(Device(), scene, options);
  double sum = 0;
  for (std::size_t i = 0; i < rendering.mean.size(); ++i)
    sum += luminance_weights[i % 3] * static_cast<double>(rendering.mean[i]);
  return std::numbers::pi * 3 * sum / static_cast<double>(rendering.mean.size());
}

}  // namespace

TEST_CASE("every image of a world has a camera, a boundary, a light and colours of its own, all within their ranges") {
  const Manifest set = plan_of(small);
  CHECK((set.in_colours && set.cameras && set.flash == 3));
  CHECK(set.lights.size() == set.images.size());
  int matched = 0, lamps = 0;
  std::set<double> elevations, sigma_ts;
  for (const Manifest::Image& image : set.images) {
    REQUIRE((image.camera && image.boundary && image.colours));
    CHECK((image.camera->elevation >= 10 && image.camera->elevation <= 80));
    elevations.insert(image.camera->elevation);
    if (image.boundary->rough) {
      CHECK((image.boundary->alpha >= 0.05 && image.boundary->alpha <= 0.5));
      CHECK((image.boundary->int_ior >= 1.2 && image.boundary->int_ior <= 1.6));
    }
    matched += !image.boundary->rough;
    for (std::size_t c = 0; c < 3; ++c) {
      CHECK((image.colours->sigma_t[c] >= 25 && image.colours->sigma_t[c] <= 300));
      CHECK((image.colours->albedo[c] >= 0.3 && image.colours->albedo[c] <= 0.95));
      sigma_ts.insert(image.colours->sigma_t[c]);
    }
    const Manifest::Light& light = set.lights[static_cast<std::size_t>(image.light)];
    lamps += light.lamps.has_value();
    CHECK(light.direction[2] > 0);
  }
  const auto count = static_cast<double>(set.images.size());
  CHECK(elevations.size() == set.images.size());
  CHECK(sigma_ts.size() == 3 * set.images.size());
  // Binomial: within four standard deviations of the shares that were asked for.
  CHECK(std::fabs(matched / count - 0.3) < 4 * std::sqrt(0.3 * 0.7 / count));
  CHECK(std::fabs(lamps / count - 0.5) < 4 * std::sqrt(0.25 / count));
}

TEST_CASE("drawn lights are pictures of one's own in the share that was asked for, each turned to its azimuth") {
  const TemporaryFolder folder;
  Bitmap picture{32, 17, 1, std::vector<float>(32 * 17, 0.2F)};
  picture.data[32 * 4 + 9] = 30;
  write_exr(folder / "room.exr", {32, 17, {"Y"}, picture.data, {}});
  write_exr(folder / "yard.exr", {32, 17, {"Y"}, std::vector<float>(32 * 17, 1), {}});
  write_file(folder / "config.json", R"({"preset": "world",
    "train": {"random_shapes": 50, "lamps": 0.3, "pictures": 0.5, "environments": ["room.exr", "yard.exr"]},
    "test": {"random_shapes": 4}})");
  const DatasetPlan plan = plan_dataset(read_dataset_config(folder / "config.json"), "0", "device");
  const Manifest& set = plan.manifest;
  CHECK(plan.environment_files.size() == 2);
  double pictures = 0, rooms = 0, lamps = 0, trained = 0;
  for (const Manifest::Image& image : set.images) {
    const Manifest::Light& light = set.lights[static_cast<std::size_t>(image.light)];
    if (set.shapes[static_cast<std::size_t>(image.shape)].role == Manifest::Role::test) {
      CHECK_FALSE(light.environment);  // the test's own lights
      continue;
    }
    trained += 1;
    lamps += light.lamps.has_value();
    if (!light.environment) continue;
    pictures += 1;
    const bool is_room = light.environment->file == "environments/room.exr";
    rooms += is_room;
    const auto shown =
        std::make_shared<const Bitmap>(is_room ? picture : Bitmap{32, 17, 1, std::vector<float>(544, 1)});
    const Vec3 direction = mean_direction(environment_light(shown, light.azimuth, 1));
    CHECK(length(direction - Vec3(light.direction)) < 1e-9);
  }
  // Binomial: within four standard deviations.
  CHECK(std::fabs(pictures / trained - 0.5) < 4 * std::sqrt(0.25 / trained));
  CHECK(std::fabs(lamps / trained - 0.3) < 4 * std::sqrt(0.21 / trained));
  CHECK(std::fabs(rooms / pictures - 0.5) < 4 * std::sqrt(0.25 / pictures));
}

TEST_CASE("a sigma_t whose differences count is even over its range, one whose ratios count is not") {
  const auto below_middle = [](const std::string& more) {
    const Manifest set = plan_of(
        R"({"preset": "world", "sigma_t": [1, 101], "train": {"random_shapes": 100}, "test": {"random_shapes": 1})" +
        more + "}");
    double below = 0;
    for (const Manifest::Image& image : set.images)
      for (const double sigma_t : image.colours->sigma_t) below += sigma_t < 51;
    return below / 3 / static_cast<double>(set.images.size());
  };
  CHECK(below_middle(R"(, "sigma_t_scale": "linear")") == Approx(0.5).margin(0.03));
  CHECK(below_middle("") == Approx(std::log(51) / std::log(101)).margin(0.03));
}

TEST_CASE("a world's manifest comes back as written, and other sets' have nothing of it") {
  const TemporaryFolder folder;
  const Manifest set = plan_of(small);
  write_manifest(folder.path(), set);
  const std::string text = read_file(manifest_file(folder.path()));
  const Manifest read = read_manifest(folder.path());
  write_manifest(folder.path(), read);
  CHECK(read_file(manifest_file(folder.path())) == text);
  for (std::size_t i = 0; i < set.images.size(); ++i) {
    CHECK(read.images[i].colours->sigma_t == set.images[i].colours->sigma_t);
    CHECK(read.images[i].colours->albedo == set.images[i].colours->albedo);
    CHECK(read.images[i].camera->azimuth == set.images[i].camera->azimuth);
    CHECK(read.images[i].boundary->int_ior == set.images[i].boundary->int_ior);
    CHECK(read.lights[i].lamps == set.lights[i].lamps);
  }
  CHECK_FALSE(is_laboratory(read));
  const Manifest laptop = plan_dataset(read_dataset_config("laptop"), "0", "device").manifest;
  CHECK(is_laboratory(laptop));
  write_manifest(folder.path(), laptop);
  const std::string plain = read_file(manifest_file(folder.path()));
  for (const char* key : {"camera", "flash", "in_colours", "lamps", "linear_sigma_t"})
    CHECK_THAT(plain, !Contains("\"" + std::string(key)));
}

TEST_CASE("what a world cannot be is refused by key, value and what is needed") {
  const auto refusal = [](const std::string& more) {
    try {
      config_of(R"({"preset": "world", )" + more + "}");
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  CHECK_THAT(refusal(R"("camera": {"elevation": [0, 80]})"), Contains("camera.elevation") && Contains("5 to 85"));
  CHECK_THAT(refusal(R"("camera": {"elevation": [10, 80], "roll": 3})"), Contains("roll is not known"));
  CHECK_THAT(refusal(R"("colours": "cmyk")"), Contains("\"luminance\" or \"rgb\""));
  CHECK_THAT(refusal(R"("flash": -1)"), Contains("flash is -1"));
  CHECK_THAT(refusal(R"("train": {"pictures": 0.2})"), Contains("`environments` to draw from"));
  CHECK_THAT(refusal(R"("train": {"pictures": 0.2, "environments": ["a.exr"], "azimuths": [3]})"),
             Contains("\"azimuths\": []"));
  CHECK_THAT(refusal(R"("train": {"pictures": 0.6, "lamps": 0.5, "environments": ["a.exr"]})"), Contains("at most 1"));
  CHECK_THAT(refusal(R"("boundary": {"type": "drawn", "matched": 2})"), Contains("boundary.matched is 2"));
  CHECK_THAT(refusal(R"("train": {"lamps": 1.5})"), Contains("train.lamps is 1.5"));
  CHECK_THAT(refusal(R"("train": {"zenith_range": [50]})"), Contains("train.zenith_range"));
  CHECK(refusal(R"("boundary": {"type": "matched"}, "camera": null)") == "accepted");
}

TEST_CASE("a camera that goes around the object sees what the usual one sees of the object turned the other way") {
  Manifest set;
  set.size = 32;
  const double azimuth = 70;
  Manifest::Image image;
  image.camera = Manifest::Camera{45, azimuth};
  Mesh turned = *egg();
  for (auto* vectors : {&turned.position, &turned.normal})
    for (auto& v : *vectors) {
      const Vec3 to = transform_vector(rotate({0, 0, 1}, -azimuth), {v[0], v[1], v[2]});
      v = {static_cast<float>(to[0]), static_cast<float>(to[1]), static_cast<float>(to[2])};
    }
  const ShapeBuffers around = shape_buffers(dataset_scene(set, image, egg()), 0, 1),
                     usual = shape_buffers(dataset_scene(set, std::make_shared<const Mesh>(turned)), 0, 1);
  int seen = 0;
  for (std::size_t i = 0; i < usual.mask.size(); ++i) {
    CHECK(around.mask[i] == usual.mask[i]);
    if (usual.mask[i] == 0) continue;
    ++seen;
    CHECK(around.depth[i] == Approx(usual.depth[i]).margin(1e-4));
    CHECK(dot(before_camera(image, around.normal[i]), usual.normal[i]) > 0.9999);
  }
  CHECK(seen > 100);
}

TEST_CASE("from above the camera looks down on the object, and keeps its distance") {
  Manifest set;
  Manifest::Image image;
  for (const double elevation : {10.0, 45.0, 80.0}) {
    image.camera = Manifest::Camera{elevation, 0};
    const Transform to_world = dataset_scene(set, image, egg()).sensors[0].to_world;
    const Vec3 at = transform_point(to_world, {0, 0, 0});
    CHECK(at[2] - 0.45 == Approx(std::sin(elevation * std::numbers::pi / 180) * length(at - Vec3{0, 0, 0.45})));
    CHECK(at[1] < 0);
    const Transform usual = dataset_scene(set, egg()).sensors[0].to_world;
    CHECK(length(at - Vec3{0, 0, 0.45}) == Approx(length(transform_point(usual, {0, 0, 0}) - Vec3{0, 0, 0.45})));
  }
}

TEST_CASE("every room with lamps gives the floor the same irradiance, and no two are alike") {
  std::set<float> brightest;
  for (const std::uint64_t seed : {1, 2, 3}) {
    const auto room = lamp_room(seed);
    brightest.insert(*std::max_element(room->data.begin(), room->data.end()));
    CHECK(*std::min_element(room->data.begin(), room->data.end()) > 0);
    CHECK(irradiance_on_floor(environment_light(room, 30, 1)) == Approx(3).epsilon(0.03));  // pixels of 6 degrees
    CHECK(mean_direction(environment_light(room, 30, 1))[2] > 0);
  }
  CHECK(brightest.size() == 3);
  CHECK(lamp_room(7)->data == lamp_room(7)->data);
}

TEST_CASE("the flash has the irradiance that it is asked for, wherever the camera stands, and is the only light") {
  const double tilt = 30;  // of the floor's normal from the lamp
  const Vec3 towards{0, -std::sin(tilt * std::numbers::pi / 180), std::cos(tilt * std::numbers::pi / 180)};
  CHECK(irradiance_on_floor(lamp_alone(towards, 5)) ==
        Approx(5 * std::cos(tilt * std::numbers::pi / 180)).epsilon(0.01));
  Manifest set;
  Manifest::Image image;
  image.camera = Manifest::Camera{20, -130};
  const Scene scene = in_flash(dataset_scene(set, image, egg()), 2);
  CHECK(scene.lights.empty());
  const Vec3 lamp = transform_vector(scene.environment->to_world, {0, 0, 1}),
             view = transform_vector(scene.sensors[0].to_world, {0, 0, 1});
  CHECK(dot(lamp, view) == Approx(-1));
  CHECK(scene.environment->number("sky_scale") == 0);
}
