// Setting scene parameters by name. (Listing them: tests/tool/parameters_test.cpp.)
#include "runtime/scene/parameters.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <set>

#include "runtime/error.h"

namespace {

// One scene an environment; together they have parameters of every kind.
itn::Scene scene_of_every_kind(itn::Emitter::Kind environment) {
  itn::Scene scene;
  scene.media.resize(2);
  scene.media[0].id = "fog";
  scene.media[0].phase_id = "haze";
  scene.media[0].isotropic = false;
  scene.media[1].id = "skin";
  scene.media[1].phase_id = "none";
  scene.media[1].sigma_t_is_rgb = scene.media[1].albedo_is_rgb = true;
  scene.bsdfs.resize(4);
  const char* const ids[] = {"paint", "glass", "frost", "tiles"};
  for (std::size_t i = 0; i < 4; ++i) scene.bsdfs[i].id = ids[i];
  scene.bsdfs[0].kind = scene.bsdfs[3].kind = itn::BsdfKind::diffuse;
  scene.bsdfs[0].reflectance.value = {0.1, 0.2, 0.3};
  scene.bsdfs[1].kind = itn::BsdfKind::dielectric;
  scene.bsdfs[2].kind = itn::BsdfKind::roughdielectric;
  scene.bsdfs[3].reflectance.bitmap = std::make_shared<itn::Bitmap>();
  scene.environment.emplace();
  scene.environment->id = "light";
  scene.environment->kind = environment;
  return scene;
}

const itn::Emitter::Kind environments[] = {itn::Emitter::Kind::constant, itn::Emitter::Kind::envmap,
                                           itn::Emitter::Kind::sunsky};

// Two values inside of the range, neither the default of any parameter.
std::vector<double> inside(const itn::Parameter& p) {
  if (std::isinf(p.high)) return {p.low + 0.37, p.low + 7.3};
  return {p.low + 0.37 * (p.high - p.low), p.low + 0.83 * (p.high - p.low)};
}

}  // namespace

TEST_CASE("a parameter that is set has the value, and every other keeps its own") {
  std::set<itn::ParameterKind> kinds;
  for (const auto environment : environments) {
    const itn::Scene scene = scene_of_every_kind(environment);
    const auto before = itn::list_parameters(scene);
    for (std::size_t i = 0; i < before.size(); ++i) {
      if (std::isnan(before[i].value)) continue;  // a texture
      INFO(before[i].name);
      kinds.insert(before[i].kind);
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
  CHECK(kinds.size() == static_cast<std::size_t>(itn::ParameterKind::sky_scale) + 1);
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
  itn::Scene scene = scene_of_every_kind(itn::Emitter::Kind::constant);
  const itn::Parameter p = itn::find_parameter(itn::list_parameters(scene), "tiles.reflectance");
  CHECK_THROWS_WITH(itn::set_parameter(scene, p, 0.5),
                    Catch::Contains("tiles.reflectance") && Catch::Contains("texture"));
}

TEST_CASE("a colour listed as one number is set in all components, one listed by component in that") {
  itn::Scene scene = scene_of_every_kind(itn::Emitter::Kind::constant);
  const auto all = itn::list_parameters(scene);
  itn::set_parameter(scene, itn::find_parameter(all, "fog.albedo"), 0.5);
  itn::set_parameter(scene, itn::find_parameter(all, "skin.albedo.G"), 0.4);
  CHECK(scene.media[0].albedo == itn::Rgb{0.5, 0.5, 0.5});
  CHECK(scene.media[1].albedo == itn::Rgb{0.75, 0.4, 0.75});
}
