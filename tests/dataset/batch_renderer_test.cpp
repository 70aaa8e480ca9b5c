// Many images in one wavefront have the bits of each alone.
#include "runtime/render/batch_renderer.h"

#include <catch2/catch.hpp>

#include "itn/error.h"
#include "network/dataset/dataset_scene.h"
#include "runtime/scene/shapes/polygonise.h"

using namespace itn;

namespace {

const Device& device() {
  static const Device the_device;
  return the_device;
}

std::shared_ptr<const Mesh> mesh_of(const Solid& solid) { return std::make_shared<const Mesh>(shape_mesh(solid, 800)); }

struct Scenes {
  Manifest set;
  std::vector<std::shared_ptr<const Mesh>> shapes{mesh_of(ball({0, 0, 0}, 1)), mesh_of(torus(1, 0.4))};

  Scenes() {
    set.size = 16;
    set.boundary.alpha = 0.2;
    set.boundary.int_ior = 1.4;
  }
  Scene scene(std::size_t shape, double azimuth, const DatasetMaterial& material) const {
    return dataset_scene(set, shapes[shape], sun_and_sky(sun_direction(azimuth, 30)), material);
  }
};

void check_same(const Rendering& a, const Rendering& b) {
  CHECK((a.mean == b.mean && a.stderr_ == b.stderr_));
  CHECK((a.mean_of_image == b.mean_of_image && a.stderr_of_mean == b.stderr_of_mean));
  CHECK((a.width == b.width && a.height == b.height && a.channels == b.channels && a.spp == b.spp));
  REQUIRE(a.derivatives.size() == b.derivatives.size());
  for (std::size_t p = 0; p < a.derivatives.size(); ++p)
    CHECK((a.derivatives[p].mean == b.derivatives[p].mean && a.derivatives[p].stderr_ == b.derivatives[p].stderr_));
}

}  // namespace

TEST_CASE("images of a batch have the bits of each alone: shapes, lights, materials, seeds, derivatives") {
  Scenes scenes;
  scenes.set.boundary.rough = GENERATE(false, true);
  std::vector<Scene> all;
  std::vector<std::size_t> shapes{0, 1, 1, 0};
  all.push_back(scenes.scene(0, 0, {20, 0.9, 0.5}));
  all.push_back(scenes.scene(1, 30, {5, 0.5, 0.1}));
  all.push_back(scenes.scene(1, 90, {40, 0.7, 0.8}));
  all.push_back(scenes.scene(0, 60, {10, 0.95, 0.3}));
  RenderOptions options;
  options.derivatives = {dataset_sigma_t, dataset_albedo, dataset_g};
  options.baselines = GENERATE(Baselines::off, Baselines::on);
  BatchRenderer renderer(device(), options);
  std::vector<int> geometries;
  for (std::size_t s = 0; s < 2; ++s)
    geometries.push_back(renderer.add_geometry(renderer.geometry_of(scenes.scene(s, 0, {}))));
  std::vector<BatchImage> batch;
  for (std::size_t i = 0; i < all.size(); ++i) batch.push_back({&all[i], geometries[shapes[i]], 100 + i, 0});

  constexpr int spp = 8;
  const std::vector<Rendering> together = renderer.render(batch, spp);
  REQUIRE(together.size() == all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    CAPTURE(i);
    RenderOptions alone = options;
    alone.spp = spp;
    alone.seed = 100 + i;
    check_same(together[i], render(device(), all[i], alone));
  }
  SECTION("in another order, after others, in launches of another size") {
    RenderOptions small = options;
    small.paths_a_launch = 777;
    BatchRenderer other(device(), small);
    other.add_geometry(other.geometry_of(scenes.scene(0, 0, {})));
    other.forget_geometries();
    const int torus = other.add_geometry(other.geometry_of(scenes.scene(1, 0, {}))),
              ball = other.add_geometry(other.geometry_of(scenes.scene(0, 0, {})));
    other.render({{&all[1], torus, 5, 0}}, 2);
    const std::vector<Rendering> again =
        other.render({{&all[3], ball, 103, 0}, {&all[1], torus, 101, 0}, {&all[0], ball, 100, 0}}, spp);
    check_same(again[0], together[3]);
    check_same(again[1], together[1]);
    check_same(again[2], together[0]);
  }
  SECTION("groups of samples have the bits of each group alone") {
    const std::vector<Rendering> groups = renderer.render(batch, spp, 4);
    REQUIRE(groups.size() == 4 * all.size());
    for (std::size_t i = 0; i < all.size(); ++i) {
      RenderOptions alone = options;
      alone.seed = 100 + i;
      Renderer single(device(), all[i], alone);
      for (std::size_t g = 0; g < 4; ++g) check_same(groups[4 * i + g], single.render(static_cast<int>(2 * g), 2));
    }
  }
  SECTION("samples of a batch may be any") {
    RenderOptions alone = options;
    alone.seed = 100;
    Renderer single(device(), all[0], alone);
    check_same(renderer.render({{&all[0], geometries[0], 100, 3}}, 4).front(), single.render(3, 4));
  }
}

TEST_CASE("images of a batch that share an environment, turned or not, have the bits of each alone") {
  Scenes scenes;
  scenes.set.boundary.rough = GENERATE(false, true);
  Bitmap picture{16, 9, 1, std::vector<float>(16 * 9, 0.2F)};
  picture.data[16 * 2 + 5] = 30;
  const auto shared = std::make_shared<const Bitmap>(picture);
  const DatasetMaterial material{20, 0.9, 0.5};
  std::vector<Scene> all;
  for (const auto& [azimuth, scale] : {std::pair{0.0, 1.0}, {90.0, 1.0}, {0.0, 1.0}, {0.0, 3.0}})
    all.push_back(dataset_scene(scenes.set, scenes.shapes[0], environment_light(shared, azimuth, scale), material));
  BatchRenderer renderer(device(), {});
  const int geometry = renderer.add_geometry(renderer.geometry_of(all[0]));
  std::vector<BatchImage> batch;
  for (const Scene& scene : all) batch.push_back({&scene, geometry, 7, 0});
  const std::vector<Rendering> together = renderer.render(batch, 16);
  RenderOptions alone;
  alone.spp = 16;
  alone.seed = 7;
  for (std::size_t i = 0; i < all.size(); ++i) {
    CAPTURE(i);
    check_same(together[i], render(device(), all[i], alone));
  }
  CHECK(together[0].mean == together[2].mean);
  CHECK(together[0].mean != together[1].mean);
  CHECK(together[3].mean_of_image[0] == Approx(3 * together[0].mean_of_image[0]));
}

TEST_CASE("a batch has no baselines of itself") {
  Scenes scenes;
  const Scene scene = scenes.scene(0, 0, {20, 0.9, 0.5});
  RenderOptions options;
  options.derivatives = {dataset_sigma_t};
  BatchRenderer renderer(device(), options);
  const int geometry = renderer.add_geometry(renderer.geometry_of(scene));
  options.baselines = Baselines::off;
  check_same(renderer.render({{&scene, geometry, 0, 0}}, 4).front(), Renderer(device(), scene, options).render(0, 4));
}

TEST_CASE("a batch refuses derivatives by the light and films of different kinds") {
  const Scenes scenes;
  Scene first = scenes.scene(0, 0, {}), second = first;
  second.sensors[0].luminance = false;
  RenderOptions options;
  BatchRenderer plain(device(), options);
  const int geometry = plain.add_geometry(plain.geometry_of(first));
  CHECK_THROWS_AS(plain.render({{&first, geometry, 0, 0}, {&second, geometry, 0, 0}}, 2), UsageError);
  options.derivatives = {"sky.sun_scale"};
  BatchRenderer by_light(device(), options);
  CHECK_THROWS_WITH(by_light.render({{&first, by_light.add_geometry(by_light.geometry_of(first)), 0, 0}}, 2),
                    Catch::Contains("no derivatives by the light"));
}
