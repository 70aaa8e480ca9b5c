// itn predict with renderings of the scene that the network is shown (--exemplars), and with photos by the network that
// ships for them. What else it does is tested where networks are trained and inversions start from them.
#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <utility>

#include "runtime/base/file.h"
#include "runtime/image/exr.h"
#include "runtime/image/png.h"
#include "tests/support/temporary_folder.h"
#include "tests/tool/process.h"

namespace {

using Strings = std::vector<std::string>;

const std::string scene_file = ITN_SOURCE_DIR "/scenes/dataset/scene.xml";

Strings predict(const std::string& scene, const Strings& more) {
  Strings arguments{"predict", "--scene", scene, "-D", "size=64"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

}  // namespace

TEST_CASE("itn predict --exemplars: the shipped network's intervals in a scene that it is shown hold the truth") {
  const TemporaryFolder folder;
  struct Material {
    double sigma_t, albedo, g;
  };
  const std::vector<Material> truth{{40, 0.5, 0.2}, {60, 0.9, 0.6}, {100, 0.7, 0.4}, {200, 0.85, 0.1}};
  Strings photos;
  for (const Material& m : truth) {
    photos.push_back(folder / (std::to_string(photos.size()) + ".exr"));
    REQUIRE(run_itn({"render", scene_file, "-o", photos.back(), "--spp", "32", "-D", "size=64", "-D",
                     "sigma_t=" + std::to_string(m.sigma_t), "-D", "albedo=" + std::to_string(m.albedo), "-D",
                     "g=" + std::to_string(m.g), "--quiet"})
                .exit_code == 0);
  }
  Strings more{"--exemplars", "16", "--json", "-", "--quiet"};
  more.insert(more.end(), photos.begin(), photos.end());
  const Result result = run_itn(predict(scene_file, more));
  INFO(result.error);
  REQUIRE(result.exit_code == 0);
  const auto json = nlohmann::json::parse(result.output);
  CHECK(json["exemplars"]["count"] == 16);
  // As noisy as the photos, which have 32 samples; the brightest and the darkest differ.
  CHECK(json["exemplars"]["spp"].get<int>() >= 16);
  CHECK(json["exemplars"]["spp"].get<int>() <= 64);
  int held = 0;
  for (std::size_t k = 0; k < truth.size(); ++k)
    for (const auto& [name, value] :
         std::map<std::string, double>{{"sigma_t", truth[k].sigma_t}, {"albedo", truth[k].albedo}, {"g", truth[k].g}}) {
      const auto& said = json["images"][k][name];
      INFO(k << " " << said.dump());
      CHECK((said["low"] < said["value"] && said["value"] < said["high"]));
      held += said["low"] < value && value < said["high"];
    }
  CHECK(held >= 9);  // of 12; by chance fewer than once in 5,000
  for (const auto& image : json["images"]) CHECK(image["doubted"] == false);
  CHECK(run_itn(predict(scene_file, more)).output == result.output);
}

TEST_CASE(
    "itn predict --exemplars doubts a photo of another scene than it is shown, where the photo's noise is known") {
  const TemporaryFolder folder;
  const std::string photo = folder / "photo.exr", silent = folder / "silent.exr";
  REQUIRE(run_itn({"render", scene_file, "-o", photo, "--spp", "32", "-D", "size=64", "--quiet"}).exit_code == 0);
  itn::ExrImage image = itn::read_exr(photo);
  const auto told = std::find(image.channels.begin(), image.channels.end(), "stderr.Y");
  REQUIRE(told != image.channels.end());
  *told = "other";
  itn::write_exr(silent, image);

  // The sun was 30 degrees from there. More photos than are answered together.
  Strings more{"-D", "sun=0.25, 0.43301270189221935, 0.8660254037844386", "--exemplars", "12", "--json", "-", silent};
  constexpr std::size_t photos = 25;
  more.insert(more.end(), photos, photo);
  const Result result = run_itn(predict(scene_file, more));
  INFO(result.error);
  REQUIRE(result.exit_code == 1);
  CHECK(result.error.find("25 of 26 images are like no material in the scene") != std::string::npos);
  const auto json = nlohmann::json::parse(result.output);
  REQUIRE(json["images"].size() == 1 + photos);
  CHECK_FALSE(json["images"][0].contains("doubt"));
  for (std::size_t k = 1; k <= photos; ++k) {
    CHECK(json["images"][k]["file"] == photo);
    CHECK(json["images"][k]["doubted"] == true);
    CHECK(json["images"][k]["sigma_t"]["holds"] == false);
    CHECK(json["images"][k]["doubt"].get<double>() > json["doubt_limit"].get<double>());
  }
  CHECK(result.error.find("photo.exr: is unlike the scene") != std::string::npos);
}

TEST_CASE(
    "itn predict and itn invert --init: the shipped network's judge doubts a photo whose light is not the scene's") {
  const TemporaryFolder folder;
  const std::string photo = folder / "photo.exr";
  REQUIRE(run_itn({"render", scene_file, "-o", photo, "--spp", "64", "-D", "size=64", "--quiet"}).exit_code == 0);
  const auto said = [&](const Strings& more) {
    Strings arguments{photo, "--json", "-"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Result result = run_itn(predict(scene_file, arguments));
    INFO(result.error);
    REQUIRE(result.exit_code == 0);
    const auto json = nlohmann::json::parse(result.output);
    const bool doubted = json["images"][0]["doubted"];
    CHECK(doubted == (json["images"][0]["doubt"] > json["doubt_limit"]));
    CHECK(doubted ==
          (result.error.find("photo.exr: is unlike the images that the network learnt from") != std::string::npos));
    CHECK(doubted == (result.error.find("are shape and light those of the image") != std::string::npos));
    return doubted;
  };
  CHECK_FALSE(said({}));
  const Strings other_sun{"-D", "sun=0.5, 0, 0.8660254037844386"};  // by 90 degrees
  CHECK(said(other_sun));

  const auto warned = [&](const Strings& more) {
    // Parameters of which another case's exemplars have derivatives: the program is compiled then.
    Strings arguments{"invert",       scene_file, "-D",          "size=64",        "--target",    photo,
                      "--init",       "shipped",  "--parameter", "medium.sigma_t", "--parameter", "medium.albedo",
                      "--parameter",  "phase.g",  "--method",    "gauss-newton",   "--spp",       "4",
                      "--iterations", "1",        "-o",          folder / "fit"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Result result = run_itn(arguments);
    INFO(result.error);
    REQUIRE(result.exit_code <= 1);  // one iteration need not converge
    const bool in_result = itn::read_file(folder / "fit/result.json").find("is unlike the images") != std::string::npos;
    std::filesystem::remove_all(folder / "fit");
    CHECK(in_result == (result.error.find("is unlike the images") != std::string::npos));
    return result.error.find("photo.exr: is unlike the images that the network learnt from") != std::string::npos &&
           result.error.find("leave out --init") != std::string::npos;
  };
  CHECK_FALSE(warned({}));
  CHECK(warned(other_sun));
}

TEST_CASE("itn predict --exemplars refuses what it cannot be shown") {
  const TemporaryFolder folder;
  const std::string photo = folder / "photo.exr";
  REQUIRE(run_itn({"render", scene_file, "-o", photo, "--spp", "2", "-D", "size=64", "--quiet"}).exit_code == 0);
  const auto error_of = [&](const Strings& arguments) {
    const Result refused = run_itn(arguments);
    CHECK(refused.exit_code == 2);
    return refused.error;
  };
  CHECK(error_of({"predict", photo, "--exemplars", "24"}).find("which one (--scene)?") != std::string::npos);
  CHECK(error_of(predict(scene_file, {photo, "--exemplars", "5"})).find("--exemplars") != std::string::npos);
  CHECK(error_of(predict(scene_file, {photo, "--exemplars", "12", "--judge", "judge"})).find("--judge") !=
        std::string::npos);

  // A medium that scatters evenly has no g to show.
  std::string object = itn::read_file(ITN_SOURCE_DIR "/scenes/dataset/object.xml");
  const std::size_t at = object.find("<phase"), end = object.find("</phase>");
  object.replace(at, end - at, "<phase type=\"isotropic\" id=\"phase\">");
  itn::write_file(folder / "object.xml", object);
  for (const char* name : {"scene.xml", "floor.exr", "star.ply"})
    itn::write_file(folder / name, itn::read_file(std::string(ITN_SOURCE_DIR "/scenes/dataset/") + name));
  CHECK(error_of(predict(folder / "scene.xml", {photo, "--exemplars", "12"}))
            .find("media with one g, and the scene's has none") != std::string::npos);
}

TEST_CASE(
    "itn predict without a RUN and with a flash: of a figurine that the network has never seen its intervals hold the "
    "truth, and the judge doubts it only once the camera has moved") {
  const TemporaryFolder folder;
  REQUIRE(run_itn({"shapes", "-o", folder / "shapes", "--quiet"}).exit_code == 0);
  const std::string figurine = ITN_SOURCE_DIR "/docs/tutorials/figurine.xml";
  const auto photograph = [&](const char* spp) {
    for (const auto& [file, flash] : {std::pair("photo.exr", "0"), std::pair("flash.exr", "3")})
      REQUIRE(run_itn({"render", figurine, "-D", "shape=" + (folder / "shapes/hare.ply"), "-D",
                       std::string("flash=") + flash, "--spp", spp, "--seed", flash, "--quiet", "-o", folder / file})
                  .exit_code == 0);
  };
  const std::string mask = ITN_SOURCE_DIR "/docs/tutorials/figurine_mask.png";
  const auto said = [&](const Strings& more) {
    Strings arguments{"predict", folder / "photo.exr", "--flash", folder / "flash.exr", "--mask", mask, "--json", "-"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Result result = run_itn(arguments);
    INFO(result.error);
    REQUIRE(result.exit_code == 0);
    return nlohmann::json::parse(result.output);
  };
  photograph("512");  // as clean as a camera's: images of 48 samples are what the network itself has learnt from
  CHECK(said({})["images"][0]["doubted"] == false);
  photograph("64");
  const nlohmann::json json = said({});
  CHECK(json["run"] == "shipped-photos");
  CHECK(json["images"][0]["doubted"] == false);
  const std::map<std::string, double> truth{{"sigma_t.R", 40},  {"sigma_t.G", 55},  {"sigma_t.B", 80},
                                            {"albedo.R", 0.97}, {"albedo.G", 0.93}, {"albedo.B", 0.80},
                                            {"g", 0.5}};
  int held = 0;
  for (const auto& [name, value] : truth) {
    const auto& one = json["images"][0][name];
    INFO(name << " " << one.dump());
    CHECK((one["low"] <= one["value"] && one["value"] <= one["high"]));
    held += one["low"] <= value && value <= one["high"];
  }
  CHECK(held >= 5);  // of 7, which hang together
  const nlohmann::json longer = said({"--longest-side", "60"});
  for (const char* end : {"low", "value", "high"})
    CHECK(60 * longer["images"][0]["sigma_t.G"][end].get<double>() ==
          Approx(json["images"][0]["sigma_t.G"][end].get<double>()));

  // A camera that moved between the two is noticed.
  itn::ExrImage moved = itn::read_exr(folder / "flash.exr");
  const auto row = static_cast<std::ptrdiff_t>(moved.width) * static_cast<std::ptrdiff_t>(moved.channels.size());
  std::rotate(moved.data.begin(), moved.data.begin() + 10 * row, moved.data.end());
  itn::write_exr(folder / "moved.exr", moved);
  const Result doubted =
      run_itn({"predict", folder / "photo.exr", "--flash", folder / "moved.exr", "--mask", mask, "--json", "-"});
  INFO(doubted.error);
  REQUIRE(doubted.exit_code == 0);
  CHECK(nlohmann::json::parse(doubted.output)["images"][0]["doubted"] == true);
  CHECK(doubted.error.find("did the camera move") != std::string::npos);

  // Photos that are too bright are said to be so.
  const std::vector<std::uint8_t> grey(3 * 160 * 120, 128), white(3 * 160 * 120, 255);
  itn::write_png(folder / "grey.png", 160, 120, grey);
  itn::write_png(folder / "white.png", 160, 120, white);
  const Result bright = run_itn({"predict", folder / "grey.png", "--flash", folder / "white.png", "--mask", mask});
  CHECK(bright.exit_code == 0);
  CHECK(bright.error.find("100 % of what the network looks at is saturated") != std::string::npos);
}
