#include "runtime/scene/parameters.h"

#include <catch2/catch.hpp>

#include "runtime/scene/load.h"

namespace {

const itn::Parameter& find(const std::vector<itn::Parameter>& all, const std::string& name) {
  for (const itn::Parameter& p : all)
    if (p.name == name) return p;
  FAIL("no parameter " << name);
  throw 0;
}

}  // namespace

TEST_CASE("every parameter of a scene is listed with value and range") {
  const itn::Scene scene = itn::load_scene(ITN_SOURCE_DIR "/tests/tool/data/ball.xml", {{"sigma_t", "25"}});
  const auto all = itn::list_parameters(scene);
  CHECK(find(all, "skin.sigma_t").value == 25);
  CHECK(find(all, "skin.sigma_t").range() == "[0, inf)");
  CHECK(find(all, "skin.sigma_t").unit == "1/scene unit");
  CHECK(find(all, "skin.albedo.R").value == 0.9);
  CHECK(find(all, "skin.albedo.B").value == 0.7);
  CHECK(find(all, "skin.albedo.B").range() == "[0, 1]");
  CHECK(find(all, "haze.g").range() == "(-1, 1)");
  CHECK(find(all, "glass.alpha").value == 0.2);
  CHECK(find(all, "glass.alpha").range() == "(0, 1]");
  CHECK(find(all, "glass.int_ior").value > 1);
}

TEST_CASE("a colour with equal components that was not given as rgb is one parameter") {
  itn::Scene scene;
  scene.media.push_back({});
  scene.media[0].id = "fog";
  const auto all = itn::list_parameters(scene);
  CHECK(find(all, "fog.albedo").value == 0.75);
  scene.media[0].albedo_is_rgb = true;
  CHECK(find(itn::list_parameters(scene), "fog.albedo.G").value == 0.75);
}

TEST_CASE("a smooth interface is not differentiable and the remedy is named") {
  itn::Scene scene;
  scene.bsdfs.push_back({});
  scene.bsdfs[0].id = "glass";
  scene.bsdfs[0].kind = itn::BsdfKind::dielectric;
  CHECK_THAT(find(itn::list_parameters(scene), "glass.int_ior").not_differentiable, Catch::Contains("roughdielectric"));
}
