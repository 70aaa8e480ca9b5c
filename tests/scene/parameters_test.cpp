// Setting scene parameters by name. (Listing them: tests/tool/parameters_test.cpp.)
#include "itn/parameters.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <set>

#include "itn/error.h"

namespace {

// One scene an environment; together they have parameters of every kind.
itn::Scene scene_of_every_kind(const std::string& environment) {
  itn::Scene scene;
  scene.media.resize(2);
  scene.media[0].id = "fog";
  scene.media[0].phase.become(*itn::find_model(itn::phase_models(), "hg"));
  scene.media[0].phase.id = "haze";
  scene.media[1].id = "skin";
  scene.media[1].phase.id = "none";
  for (const char* name : {"sigma_t", "albedo"}) scene.media[1].value(name).by_component = true;
  for (const char* type : {"diffuse", "dielectric", "roughdielectric", "diffuse", "diffuse", "diffuse"})
    scene.bsdfs.push_back(itn::make_bsdf(type));
  const char* const ids[] = {"paint", "glass", "frost", "tiles", "wall", "floor"};
  for (std::size_t i = 0; i < 6; ++i) scene.bsdfs[i].id = ids[i];
  scene.bsdfs[0].value("reflectance").value = {0.1, 0.2, 0.3};
  scene.bsdfs[3].value("reflectance") =
      itn::make_bitmap(std::make_shared<itn::Bitmap>(itn::Bitmap{1, 1, 3, {0.5F, 0.5F, 0.5F}}));
  for (const std::size_t i : {4, 5}) {  // share a texture
    scene.bsdfs[i].value("reflectance").become(*itn::find_texture("checkerboard"));
    scene.bsdfs[i].value("reflectance").id = "board";
    scene.bsdfs[i].value("reflectance").colours[1] = {0.1, 0.2, 0.3};
  }
  scene.lights.resize(2);
  for (std::size_t i = 0; i < 2; ++i) {
    scene.lights[i].become(*itn::find_model(itn::light_models(), i == 0 ? "spot" : "directional"));
    scene.lights[i].id = i == 0 ? "lamp" : "window";
  }
  scene.lights[0].value("intensity").value = {0.1, 0.2, 0.3};
  scene.environment = itn::make_environment(environment);
  scene.environment->id = "light";
  return scene;
}

const char* const environments[] = {"constant", "envmap", "sunsky"};

// Two values inside of the range, neither the default of any parameter.
std::vector<double> inside(const itn::Parameter& p) {
  if (std::isinf(p.high)) return {p.low + 0.37, p.low + 7.3};
  return {p.low + 0.37 * (p.high - p.low), p.low + 0.83 * (p.high - p.low)};
}

}  // namespace

TEST_CASE("a parameter that is set has the value, and every other keeps its own") {
  std::set<std::string> members;
  for (const auto environment : environments) {
    const itn::Scene scene = scene_of_every_kind(environment);
    const auto before = itn::list_parameters(scene);
    for (std::size_t i = 0; i < before.size(); ++i) {
      if (std::isnan(before[i].value)) continue;  // a texture
      INFO(before[i].name);
      members.insert((itn::is_of_light(before[i]) ? "light " : "") + before[i].member);
      for (const double value : inside(before[i])) {
        itn::Scene changed = scene;
        itn::set_parameter(changed, before[i], value);
        const auto after = itn::list_parameters(changed);
        REQUIRE(after.size() == before.size());
        for (std::size_t k = 0; k < before.size(); ++k) {
          if (std::isnan(before[k].value)) continue;
          CHECK(after[k].name == before[k].name);
          CHECK(after[k].value == (k == i ? value : before[k].value));
        }
      }
    }
  }
  CHECK(members == std::set<std::string>{"sigma_t", "albedo", "scale", "g", "alpha", "int_ior", "ext_ior",
                                         "reflectance", "color0", "color1", "light radiance", "light scale",
                                         "light turbidity", "light albedo", "light sun_scale", "light sky_scale",
                                         "light intensity", "light irradiance"});
}

TEST_CASE("a value outside of the range is refused with the range, and the scene stays as it was") {
  for (const auto environment : environments) {
    itn::Scene scene = scene_of_every_kind(environment);
    for (const itn::Parameter& p : itn::list_parameters(scene)) {
      if (std::isnan(p.value)) continue;
      INFO(p.name);
      constexpr double infinity = std::numeric_limits<double>::infinity();
      for (const double value : {p.low - 0.01, p.high + 0.01, std::nan(""), infinity, -infinity}) {
        CHECK_THROWS_AS(itn::set_parameter(scene, p, value), itn::UsageError);
        CHECK_THROWS_WITH(itn::set_parameter(scene, p, value),
                          Catch::Contains(p.name) && Catch::Contains("in " + p.range()));
        CHECK(itn::find_parameter(itn::list_parameters(scene), p.name).value == p.value);
      }
      // The ends themselves: as the range says.
      for (const auto& [end, included] : {std::pair{p.low, p.low_included}, {p.high, p.high_included}}) {
        itn::Scene copy = scene;
        if (included)
          CHECK_NOTHROW(itn::set_parameter(copy, p, end));
        else
          CHECK_THROWS_AS(itn::set_parameter(copy, p, end), itn::UsageError);
      }
    }
  }
}

TEST_CASE("a texture cannot be set to a number") {
  itn::Scene scene = scene_of_every_kind("constant");
  const itn::Parameter p = itn::find_parameter(itn::list_parameters(scene), "tiles.reflectance");
  CHECK_THROWS_WITH(itn::set_parameter(scene, p, 0.5),
                    Catch::Contains("tiles.reflectance") && Catch::Contains("texture"));
}

TEST_CASE("a bitmap is differentiated by its texels, and can be replaced wherever it is") {
  itn::Scene scene = scene_of_every_kind("constant");
  const itn::Parameter p = itn::find_parameter(itn::list_parameters(scene), "tiles.reflectance");
  CHECK(p.by_texels);
  CHECK_THAT(p.not_differentiable, Catch::Contains("texel by texel"));
  itn::Bitmap other = itn::texels_of(scene, p);
  other.data[0] = 0.125F;
  itn::set_texels(scene, p, other);
  CHECK(itn::texels_of(scene, p).data == other.data);
  CHECK(!itn::find_parameter(itn::list_parameters(scene), "wall.reflectance").by_texels);
}

TEST_CASE("the colours of a texture are parameters by its id, and set wherever it is") {
  itn::Scene scene = scene_of_every_kind("constant");
  const auto all = itn::list_parameters(scene);
  const itn::Parameter grey = itn::find_parameter(all, "board.color0");
  CHECK(grey.value == 0.4);
  CHECK(grey.range() == "[0, 1]");
  CHECK(grey.not_differentiable.empty());
  CHECK(grey.indices == std::vector<int>{4, 5});
  CHECK(itn::find_parameter(all, "wall.reflectance").not_differentiable == "a texture, not a number");
  itn::set_parameter(scene, grey, 0);
  itn::set_parameter(scene, itn::find_parameter(all, "board.color1.G"), 0.9);
  for (const std::size_t i : {4, 5}) {
    CHECK(scene.bsdfs[i].value("reflectance").colours[0] == itn::Rgb{0, 0, 0});
    CHECK(scene.bsdfs[i].value("reflectance").colours[1] == itn::Rgb{0.1, 0.9, 0.3});
  }
  CHECK_THAT(itn::find_parameter(itn::list_parameters(scene), "board.color0").not_differentiable,
             Catch::Contains("small value"));
}

TEST_CASE("a colour listed as one number is set in all components, one listed by component in that") {
  itn::Scene scene = scene_of_every_kind("constant");
  const auto all = itn::list_parameters(scene);
  itn::set_parameter(scene, itn::find_parameter(all, "fog.albedo"), 0.5);
  itn::set_parameter(scene, itn::find_parameter(all, "skin.albedo.G"), 0.4);
  CHECK(scene.media[0].colour("albedo") == itn::Rgb{0.5, 0.5, 0.5});
  CHECK(scene.media[1].colour("albedo") == itn::Rgb{0.75, 0.4, 0.75});
}
