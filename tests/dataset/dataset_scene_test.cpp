// The scene of a data set's images, and the scene file that says the same.
#include "network/dataset/dataset_scene.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>

#include "itn/load_scene.h"
#include "itn/parameters.h"
#include "itn/renderer.h"
#include "runtime/scene/mesh/mesh_file.h"
#include "runtime/scene/shapes/polygonise.h"
#include "tests/support/temporary_folder.h"

using namespace itn;

namespace {

void check_near(const Transform& a, const Transform& b) {
  for (std::size_t i = 0; i < 16; ++i) CHECK(a.m[i] == Approx(b.m[i]).margin(1e-12));
}

// All that both scenes show, but for the light.
void check_same_object(const Scene& loaded, const Scene& made) {
  CHECK(loaded.warnings.empty());
  REQUIRE(loaded.sensors.size() == 1);
  const Sensor &camera = loaded.sensors[0], &own = made.sensors[0];
  check_near(camera.to_world, own.to_world);
  CHECK(camera.fov_x == Approx(own.fov_x));
  CHECK((camera.crop_width == 32 && camera.crop_height == 32 && camera.spp == 64));
  CHECK((camera.luminance && camera.filter == own.filter));
  CHECK((loaded.integrator.rr_depth == made.integrator.rr_depth && loaded.integrator.max_depth == -1));
  REQUIRE(loaded.shapes.size() == 2);
  for (std::size_t s = 0; s < 2; ++s) {
    CHECK(loaded.shapes[s].mesh->position == made.shapes[s].mesh->position);
    const auto &normal = loaded.shapes[s].mesh->normal, &own_normal = made.shapes[s].mesh->normal;
    REQUIRE(normal.size() == own_normal.size());
    float worst = 0;  // files' normals are normalised again
    for (std::size_t i = 0; i < normal.size(); ++i)
      for (std::size_t k = 0; k < 3; ++k) worst = std::max(worst, std::fabs(normal[i][k] - own_normal[i][k]));
    CHECK(worst < 1e-6F);
    CHECK(loaded.shapes[s].mesh->triangle == made.shapes[s].mesh->triangle);
    CHECK(loaded.shapes[s].interior == made.shapes[s].interior);
  }
  CHECK(loaded.shapes[0].mesh->texcoord == made.shapes[0].mesh->texcoord);
  const Texture &floor = loaded.bsdfs[static_cast<std::size_t>(loaded.shapes[0].bsdf)].value("reflectance"),
                &pattern = made.bsdfs[0].value("reflectance");
  REQUIRE((floor.bitmap && floor.bitmap->width == 16 && floor.bitmap->height == 16 && floor.bitmap->channels == 1));
  CHECK(floor.bitmap->data == pattern.bitmap->data);
  CHECK((floor.nearest && floor.wrap == pattern.wrap));
  for (std::size_t i = 0; i < 6; ++i) CHECK(floor.to_uv[i] == Approx(pattern.to_uv[i]).margin(1e-12));
  CHECK(loaded.bsdfs[static_cast<std::size_t>(loaded.shapes[1].bsdf)].type() == "null");
  std::vector<std::string> names;
  for (const Parameter& p : list_parameters(made)) names.push_back(p.name);
  std::vector<std::string> loaded_names;
  for (const Parameter& p : list_parameters(loaded)) loaded_names.push_back(p.name);
  for (const char* name : {dataset_sigma_t, dataset_albedo, dataset_g}) {
    CHECK(std::find(names.begin(), names.end(), name) != names.end());
    CHECK(find_parameter(list_parameters(made), name).value == find_parameter(list_parameters(loaded), name).value);
  }
}

// A ring as a mesh file and as it is, and what the scene files need to know of it.
struct Ring {
  TemporaryFolder folder;
  std::shared_ptr<const Mesh> mesh = std::make_shared<const Mesh>(shape_mesh(torus(1, 0.4), 600));
  Manifest set;
  DatasetMaterial material{60, 0.7, 0.2};

  Ring() {
    write_ply(folder / "ring.ply", *mesh);
    set.size = 32;
    set.spp = 64;
  }
  Scene load(const std::string& file, std::map<std::string, std::string> more) const {
    more.merge(std::map<std::string, std::string>{{"mesh", folder / "ring.ply"},
                                                  {"size", "32"},
                                                  {"spp", "64"},
                                                  {"sigma_t", "60"},
                                                  {"albedo", "0.7"},
                                                  {"g", "0.2"}});
    return load_scene(ITN_SOURCE_DIR "/scenes/dataset/" + file, more);
  }
};

}  // namespace

TEST_CASE("scenes/dataset/scene.xml is the scene of a data set under sun and sky") {
  const Ring ring;
  const Scene made =
      dataset_scene(ring.set, ring.mesh, sun_and_sky({0.25, 0.4330127018922193, 0.8660254037844386}), ring.material);
  const Scene loaded = ring.load("scene.xml", {{"sun", "0.25, 0.4330127018922193, 0.8660254037844386"}});
  check_same_object(loaded, made);
  CHECK(loaded.environment->type() == "sunsky");
  CHECK(loaded.environment->slots() == made.environment->slots());
  const Sun &sun = loaded.environment->sun, &own_sun = made.environment->sun;
  CHECK(sun.aperture == Approx(own_sun.aperture));
  for (std::size_t k = 0; k < 3; ++k) CHECK(sun.direction[k] == Approx(own_sun.direction[k]).margin(1e-12));
}

TEST_CASE("scenes/dataset/environment.xml is the scene of a data set in an environment, and renders the same image") {
  const Ring ring;
  const std::string file = ITN_SOURCE_DIR "/scenes/gallery/studio.exr";
  const Scene made =
      dataset_scene(ring.set, ring.mesh, environment_light(read_environment(file), -35, 1.5), ring.material);
  const Scene loaded = ring.load("environment.xml", {{"map", file}, {"azimuth", "-35"}, {"scale", "1.5"}});
  check_same_object(loaded, made);
  const Environment &light = *loaded.environment, &own = *made.environment;
  CHECK((light.model == own.model && light.id == own.id && light.slots() == own.slots()));
  CHECK(light.bitmap->data == own.bitmap->data);
  CHECK(light.to_world.m == own.to_world.m);

  const Device device;
  RenderOptions options;
  const Rendering a = render(device, made, options);
  options.seed = 1;
  const Rendering b = render(device, loaded, options);
  double chi_square = 0;
  for (std::size_t i = 0; i < a.mean.size(); ++i)
    chi_square += std::pow(a.mean[i] - b.mean[i], 2) / (std::pow(a.stderr_[i], 2) + std::pow(b.stderr_[i], 2));
  // With 1024 pixels chi-square is within 5 of its standard deviations.
  CHECK(std::abs(chi_square - 1024) < 5 * std::sqrt(2 * 1024.0));
}
