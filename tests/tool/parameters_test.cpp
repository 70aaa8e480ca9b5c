#include "itn/parameters.h"

#include <algorithm>
#include <catch2/catch.hpp>

#include "itn/load_scene.h"

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
  scene.media[0].value("albedo").by_component = true;
  CHECK(find(itn::list_parameters(scene), "fog.albedo.G").value == 0.75);
}

TEST_CASE("a smooth interface is not differentiable and the remedy is named") {
  itn::Scene scene;
  scene.bsdfs = {itn::make_bsdf("dielectric")};
  scene.bsdfs[0].id = "glass";
  CHECK_THAT(find(itn::list_parameters(scene), "glass.int_ior").not_differentiable, Catch::Contains("roughdielectric"));
}

TEST_CASE("numbers whose score single precision loses are not differentiable, and say so") {
  itn::Scene scene;
  scene.media.resize(1);
  scene.media[0].id = "fog";
  scene.bsdfs = {itn::make_bsdf("roughdielectric")};
  scene.bsdfs[0].id = "frost";
  const auto reason = [&](const char* name) { return find(itn::list_parameters(scene), name).not_differentiable; };
  for (const char* name : {"fog.sigma_t", "fog.albedo", "fog.scale", "frost.alpha", "frost.int_ior", "frost.ext_ior"})
    CHECK(reason(name).empty());
  scene.media[0].set("albedo", 1e-40);
  CHECK_THAT(reason("fog.albedo"), Catch::Contains("below 1e-30"));
  scene.media[0].set("sigma_t", 1e-20);
  scene.media[0].set("scale", 1e-20);
  for (const char* name : {"fog.sigma_t", "fog.scale"}) CHECK_THAT(reason(name), Catch::Contains("below 1e-30"));
  scene.media[0].set("sigma_t", 1e20);
  scene.media[0].set("scale", 1e20);
  for (const char* name : {"fog.sigma_t", "fog.scale"}) CHECK_THAT(reason(name), Catch::Contains("above 1e30"));
  scene.media[0].phase.become(*itn::find_model(itn::phase_models(), "hg"));
  scene.media[0].phase.id = "peak";
  CHECK(reason("peak.g").empty());
  scene.media[0].phase.set("g", -0.9999999);
  CHECK_THAT(reason("peak.g"), Catch::Contains("beyond 0.999999"));
  scene.bsdfs[0].set("alpha", 1e-5);
  for (const char* name : {"frost.alpha", "frost.int_ior"}) CHECK_THAT(reason(name), Catch::Contains("below 0.0001"));
  scene.bsdfs[0].set("int_ior", scene.bsdfs[0].number("ext_ior"));
  for (const char* name : {"frost.alpha", "frost.ext_ior"}) CHECK_THAT(reason(name), Catch::Contains("null"));
  scene.bsdfs[0].set("int_ior", 5000 * scene.bsdfs[0].number("ext_ior"));
  CHECK_THAT(reason("frost.int_ior"), Catch::Contains("beyond 1000"));
}

TEST_CASE("the BSDF inside a twosided one is a parameter once, of the surface that shows it") {
  const itn::Scene scene = itn::load_scene(ITN_SOURCE_DIR "/scenes/test/mitsuba/camera_inside.xml");
  const auto all = itn::list_parameters(scene);
  const auto named = [](const itn::Parameter& p) { return p.name == "diffuse0.reflectance.R"; };
  REQUIRE(std::count_if(all.begin(), all.end(), named) == 1);
  const itn::Parameter& p = find(all, "diffuse0.reflectance.R");
  CHECK(p.not_differentiable.empty());
  CHECK(scene.bsdfs[static_cast<std::size_t>(p.indices.front())].twosided);
}

TEST_CASE("a colour's plain name stands for its components") {
  itn::Scene scene;
  scene.media.resize(1);
  scene.media[0].id = "skin";
  scene.media[0].set("albedo", itn::Rgb{0.9, 0.8, 0.7});
  const auto all = itn::list_parameters(scene);
  CHECK(itn::by_component(all, {"skin.sigma_t", "skin.albedo=0.5,0.9", "skin.albedo.G", "none"}) ==
        std::vector<std::string>{"skin.sigma_t", "skin.albedo.R=0.5,0.9", "skin.albedo.G=0.5,0.9",
                                 "skin.albedo.B=0.5,0.9", "skin.albedo.G", "none"});
}

TEST_CASE("a phase function that two media share is one parameter: of both") {
  itn::Scene scene;
  scene.media.resize(2);
  for (itn::Medium& medium : scene.media) {
    medium.phase.become(*itn::find_model(itn::phase_models(), "hg"));
    medium.phase.id = "haze";
  }
  scene.media[0].id = "fog";
  scene.media[1].id = "mist";
  const auto all = itn::list_parameters(scene);
  CHECK(std::count_if(all.begin(), all.end(), [](const itn::Parameter& p) { return p.name == "haze.g"; }) == 1);
  const itn::Parameter& haze = find(all, "haze.g");
  CHECK(haze.not_differentiable.empty());
  CHECK(haze.indices == std::vector<int>{0, 1});
  itn::set_parameter(scene, haze, 0.25);
  CHECK(scene.media[0].phase.number("g") == 0.25);
  CHECK(scene.media[1].phase.number("g") == 0.25);
}
