// itn gradient as a user meets it.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "itn/exr.h"
#include "itn/file.h"
#include "runtime/image/png.h"
#include "runtime/scene/volume/volume_file.h"
#include "tests/support/temporary_folder.h"
#include "tests/tool/process.h"

namespace {

using Catch::Contains;

std::vector<std::string> gradient(const std::string& target, const std::vector<std::string>& more = {}) {
  std::vector<std::string> arguments{"gradient", ball, "--target", target, "--parameter", "skin.albedo.G"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

// 32 x 24, as the ball's film.
itn::ExrImage constant_image(float value, int width = 32) {
  return {width, 24, {"R", "G", "B"}, std::vector<float>(static_cast<std::size_t>(width) * 24 * 3, value), {}};
}

}  // namespace

TEST_CASE("itn gradient: the loss from a darker target falls with the albedo") {
  const TemporaryFolder folder;
  itn::write_exr(folder / "target.exr", constant_image(0));
  const Result result = run_itn(gradient(folder / "target.exr", {"--json", "-"}));
  INFO(result.error);
  REQUIRE(result.exit_code == 0);
  const auto json = nlohmann::json::parse(result.output);
  CHECK(json["schema"] == "itn.gradient/1");
  CHECK(json["loss"].get<double>() > 0);
  CHECK(json["loss_stderr"].get<double>() > 0);
  const auto& albedo = json["gradient"]["skin.albedo.G"];
  CHECK(albedo["value"].get<double>() > 3 * albedo["stderr"].get<double>());
  CHECK(json["time"].contains("render_s"));
}

TEST_CASE("itn gradient: both modes give the same gradient") {
  const TemporaryFolder folder;
  itn::write_exr(folder / "target.exr", constant_image(0.4F));
  const auto run = [&](const std::string& mode) {
    const Result result = run_itn(gradient(folder / "target.exr", {"--spp", "8", "--mode", mode, "--json", "-"}));
    INFO(result.error);
    REQUIRE(result.exit_code == 0);
    return nlohmann::json::parse(result.output);
  };
  const auto images = run("images"), adjoint = run("adjoint");
  CHECK(images["mode"] == "images");
  CHECK(adjoint["mode"] == "adjoint");
  CHECK(images["loss"] == adjoint["loss"]);
  const auto &a = images["gradient"]["skin.albedo.G"], &b = adjoint["gradient"]["skin.albedo.G"];
  // Baselines make derivative images quieter: the same but for noise.
  CHECK(std::abs(a["value"].get<double>() - b["value"].get<double>()) <
        2 * std::hypot(a["stderr"].get<double>(), b["stderr"].get<double>()));
}

TEST_CASE("itn gradient: a mask leaves pixels out, whatever they hold") {
  const TemporaryFolder folder;
  itn::ExrImage target = constant_image(0.5F), mask = constant_image(1);
  itn::write_exr(folder / "whole.exr", target);
  target.data[0] = std::numeric_limits<float>::quiet_NaN();
  mask.data[0] = 0;
  itn::write_exr(folder / "target.exr", target);
  itn::write_exr(folder / "mask.exr", mask);
  const auto loss = [](const Result& result) { return nlohmann::json::parse(result.output)["loss"].get<double>(); };
  const Result masked = run_itn(gradient(folder / "target.exr", {"--mask", folder / "mask.exr", "--json", "-"}));
  INFO(masked.error);
  REQUIRE(masked.exit_code == 0);
  const Result whole = run_itn(gradient(folder / "whole.exr", {"--json", "-"}));
  CHECK(loss(masked) != loss(whole));
  CHECK(loss(masked) == Approx(loss(whole)).epsilon(0.05));
}

TEST_CASE("itn gradient refuses targets, masks and parameters that make no sense") {
  const TemporaryFolder folder;
  itn::ExrImage bad = constant_image(0.5F);
  itn::write_exr(folder / "good.exr", bad);
  itn::write_exr(folder / "black.exr", constant_image(0));
  itn::write_exr(folder / "wide.exr", constant_image(0.5F, 33));
  bad.data[3 * (32 * 2 + 5) + 1] = -1;
  itn::write_exr(folder / "negative.exr", bad);
  bad.data[3 * (32 * 2 + 5) + 1] = std::numeric_limits<float>::quiet_NaN();
  itn::write_exr(folder / "nan.exr", bad);
  itn::write_exr(folder / "grey.exr", {32, 24, {"Y"}, std::vector<float>(32 * 24, 0.5F), {}});
  const auto fails = [&](const std::vector<std::string>& arguments, int code, const std::vector<std::string>& words) {
    const Result result = run_itn(arguments);
    CAPTURE(result.error);
    CHECK(result.exit_code == code);
    for (const std::string& word : words) CHECK_THAT(result.error, Catch::Contains(word));
  };
  fails(gradient(folder / "wide.exr"), 3, {"wide.exr", "33 x 24", "32 x 24"});
  fails(gradient(folder / "negative.exr"), 3, {"pixel (5, 2)", "channel G", "-1", "mask"});
  fails(gradient(folder / "nan.exr"), 3, {"pixel (5, 2)", "nan"});
  fails(gradient(folder / "grey.exr"), 3, {"channels Y", "need R G B"});
  fails(gradient(folder / "missing.exr"), 3, {"missing.exr"});
  const std::string good = folder / "good.exr";
  fails(gradient(good, {"--mask", folder / "black.exr"}), 3, {"black.exr", "every pixel is 0"});
  fails(gradient(good, {"--parameter", "skin.gloss"}), 2, {"skin.gloss", "skin.albedo.G"});
  fails(gradient(good, {"--parameter", "skin.albedo.G"}), 2, {"named twice"});
  fails(gradient(good, {"--spp", "1"}), 2, {"--spp 1", "2 or more"});
  fails(gradient(good, {"--sensor", "0", "--sensor", "0"}), 2, {"2 --sensor and 1 --target"});
}

TEST_CASE("itn gradient --exposure: a target of twice the light is the same target") {
  const TemporaryFolder folder;
  itn::write_exr(folder / "once.exr", constant_image(0.5F));
  itn::write_exr(folder / "twice.exr", constant_image(1));
  const auto result = [&](const std::string& target) {
    const Result run = run_itn(gradient(folder / target, {"--exposure", "--json", "-"}));
    INFO(run.error);
    REQUIRE(run.exit_code == 0);
    return nlohmann::json::parse(run.output);
  };
  const auto once = result("once.exr"), twice = result("twice.exr");
  CHECK(twice["exposures"][0].get<double>() == Approx(2 * once["exposures"][0].get<double>()));
  CHECK(twice["loss"].get<double>() == Approx(4 * once["loss"].get<double>()));
}

TEST_CASE("itn gradient: by a texture it is an image of the texture's size") {
  const TemporaryFolder folder;
  const std::string scene = ITN_SOURCE_DIR "/scenes/test/mitsuba/sunsky_null_floor.xml";
  REQUIRE(
      run_itn({"render", scene, "-o", folder / "target.exr", "--spp", "4", "--size", "32x24", "--quiet"}).exit_code ==
      0);
  std::vector<std::string> arguments{
      "gradient", scene, "--target",    folder / "target.exr",  "--size", "32x24",
      "--spp",    "4",   "--parameter", "diffuse0.reflectance", "-o",     folder / "made",
      "--json",   "-"};
  const Result result = run_itn(arguments);
  INFO(result.error);
  REQUIRE(result.exit_code == 0);
  const auto json = nlohmann::json::parse(result.output);
  CHECK(json["mode"] == "adjoint");
  const auto& gradient = json["gradient"]["diffuse0.reflectance"];
  const itn::ExrImage image = itn::read_exr(folder / "made/gradient.diffuse0.reflectance.exr");
  CHECK(gradient["texels"]["file"] == folder / "made/gradient.diffuse0.reflectance.exr");
  CHECK(gradient["texels"]["width"] == image.width);
  CHECK(image.channels.size() == gradient["texels"]["channels"].size());
  CHECK(image.header.at("parameter") == "diffuse0.reflectance");
  double sum = 0, square = 0;
  for (const float v : image.data) {
    sum += static_cast<double>(v);
    square += static_cast<double>(v) * static_cast<double>(v);
  }
  CHECK(square > 0);
  CHECK(gradient["texels"]["norm"].get<double>() == Approx(std::sqrt(square)));
  CHECK(gradient["value"].get<double>() == Approx(sum).epsilon(1e-4));
  std::vector<std::string> repeated = arguments;
  repeated.insert(repeated.end(), {"--repeats", "3"});
  REQUIRE(run_itn(repeated).exit_code == 0);
  const itn::ExrImage mean = itn::read_exr(folder / "made/gradient.diffuse0.reflectance.exr");
  REQUIRE(mean.channels.size() == 2 * image.channels.size());
  const auto error = static_cast<std::size_t>(mean.channel("stderr." + mean.channels[0]));
  double errors = 0;
  for (std::size_t i = error; i < mean.data.size(); i += mean.channels.size())
    errors += static_cast<double>(mean.data[i]);
  CHECK(errors > 0);
  arguments.insert(arguments.end(), {"--mode", "images"});
  const Result refused = run_itn(arguments);
  CHECK(refused.exit_code == 2);
  CHECK_THAT(refused.error, Catch::Contains("--mode images") && Catch::Contains("diffuse0.reflectance"));
}

TEST_CASE("itn gradient: by a grid it is a grid of the same size") {
  const TemporaryFolder folder;
  const std::string scene = ITN_SOURCE_DIR "/scenes/test/mitsuba/grid_null.xml";
  REQUIRE(
      run_itn({"render", scene, "-o", folder / "target.exr", "--spp", "4", "--size", "24x16", "--quiet"}).exit_code ==
      0);
  const Result parameters = run_itn({"parameters", scene, "--quiet", "--json", "-"});
  const auto listed = nlohmann::json::parse(parameters.output)["parameters"];
  const auto found = std::find_if(listed.begin(), listed.end(), [](const auto& p) { return p.contains("voxels"); });
  REQUIRE(found != listed.end());
  const std::string name = (*found)["name"];
  const Result result = run_itn({"gradient", scene, "--target", folder / "target.exr", "--size", "24x16", "--spp", "4",
                                 "--parameter", name, "-o", folder / "made", "--json", "-"});
  INFO(result.error);
  REQUIRE(result.exit_code == 0);
  const auto gradient = nlohmann::json::parse(result.output)["gradient"][name];
  const itn::VoxelGrid grid =
      itn::read_volume_file(folder / ("made/gradient." + name + ".vol"), itn::VoxelValues::of_any_sign);
  CHECK(gradient["voxels"]["file"] == folder / ("made/gradient." + name + ".vol"));
  CHECK(gradient["voxels"]["depth"] == grid.depth);
  CHECK((*found)["voxels"]["width"] == grid.width);
  double sum = 0;
  for (const float v : grid.data) sum += static_cast<double>(v);
  CHECK(sum != 0);
  CHECK(gradient["value"].get<double>() == Approx(sum).epsilon(1e-3));
}

TEST_CASE("photos as targets: what was done is told, wrong curves and damaged files end with a message") {
  const TemporaryFolder folder;
  std::vector<std::uint8_t> samples(3 * 64 * 48, 150);
  itn::write_png(folder / "photo.png", 64, 48, samples);
  const Result run = run_itn(gradient(folder / "photo.png", {"--spp", "4", "--exposure"}));
  INFO(run.error);
  REQUIRE(run.exit_code == 0);
  CHECK_THAT(run.output, Contains("photo.png: 64 x 48 pixels, averaged down to 32 x 24") && Contains("exposure "));
  const Result curve = run_itn(gradient(folder / "photo.png", {"--curve", "film"}));
  CHECK(curve.exit_code == 2);
  CHECK_THAT(curve.error, Contains("curve film: need auto, srgb, linear, or an exponent"));
  const std::string whole = itn::read_file(folder / "photo.png");
  itn::write_file(folder / "cut.png", whole.substr(0, whole.size() / 2));
  itn::write_file(folder / "cut.jpg", "\xff\xd8\xff\xe0 and no more");
  itn::write_file(folder / "cut.tif", std::string("II*\0\x08\0\0\0\x09\0", 10));
  itn::write_png(folder / "square.png", 48, 48, std::vector<std::uint8_t>(3 * 48 * 48, 150));
  itn::write_png(folder / "white.png", 32, 24, std::vector<std::uint8_t>(3 * 32 * 24, 255));
  for (const auto& [file, message] : std::map<std::string, std::string>{{"cut.png", "is damaged"},
                                                                        {"cut.jpg", "is damaged"},
                                                                        {"cut.tif", "is damaged"},
                                                                        {"square.png", "need 32 x 24"},
                                                                        {"white.png", "is saturated"}}) {
    CAPTURE(file);
    for (const std::vector<std::string>& command :
         {gradient(folder / file), std::vector<std::string>{"view", ball, "--target", folder / file}}) {
      const Result refused = run_itn(command);
      CHECK(refused.exit_code == 3);
      CHECK_THAT(refused.error, Contains(file) && Contains(message));
    }
  }
}
