// Data sets of scenes as people have them, from itn dataset to networks that see colours, a mask and a flash.
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "itn/exr.h"
#include "itn/file.h"
#include "network/dataset/manifest.h"
#include "tests/support/folder_files.h"
#include "tests/support/temporary_folder.h"
#include "tests/tool/process.h"

using Catch::Contains;
using Json = nlohmann::json;
using Strings = std::vector<std::string>;

namespace {

// A world of 26 small images, of all kinds of boundary and light.
std::string write_config(const TemporaryFolder& folder) {
  const Json config{{"preset", "world"},
                    {"size", 16},
                    {"spp", 8},
                    {"flash", 3},
                    {"train", {{"random_shapes", 10}, {"triangles", 600}, {"materials", 2}}},
                    {"test", {{"shapes", Json::array()}, {"random_shapes", 3}, {"triangles", 600}, {"materials", 2}}}};
  itn::write_file(folder / "world.json", config.dump());
  return folder / "world.json";
}

// Channels of an image as a picture of its own.
void write_sum(const itn::ExrImage& from, const std::vector<std::string>& prefixes, const std::string& file) {
  itn::ExrImage picture{from.width, from.height, {"R", "G", "B"}, {}, {}};
  const std::size_t count = from.channels.size();
  for (std::size_t i = 0; i < from.data.size(); i += count)
    for (const char* letter : {"R", "G", "B"}) {
      float sum = 0;
      for (const std::string& prefix : prefixes)
        sum += from.data[i + static_cast<std::size_t>(from.channel(prefix + letter))];
      picture.data.push_back(sum);
    }
  itn::write_exr(file, picture);
}

}  // namespace

TEST_CASE("a world is the same to the byte in parts, and where an image is rendered again") {
  const TemporaryFolder folder;
  const std::string config = write_config(folder), whole = folder / "whole", parts = folder / "parts";
  REQUIRE(run_itn({"dataset", config, "-o", whole, "--quiet"}).exit_code == 0);
  const auto files = files_of(whole);
  const itn::Manifest set = itn::read_complete_manifest(whole);
  REQUIRE(set.images.size() == 26);
  for (const char* part : {"2/2", "1/2"})
    REQUIRE(run_itn({"dataset", config, "-o", parts, "--part", part, "--quiet"}).exit_code == 0);
  REQUIRE(run_itn({"dataset", config, "-o", parts, "--merge", "--quiet"}).exit_code == 0);
  for (const itn::Manifest::Image& image : set.images) {
    CAPTURE(image.file);
    CHECK(itn::read_file(parts + "/" + image.file) == files.at(image.file));
  }
  for (const std::size_t k : {3, 17}) std::filesystem::remove(whole + "/" + set.images[k].file);
  REQUIRE(run_itn({"dataset", config, "-o", whole, "--quiet"}).exit_code == 0);
  CHECK((files_of(whole) == files));

  const itn::ExrImage image = itn::read_exr(whole + "/" + set.images[0].file);
  for (const char* channel : {"R", "stderr.B", "flash.G", "flash.stderr.G", "normal.X", "depth", "mask"})
    CHECK(image.channel(channel) >= 0);
  const Result preview = run_itn({"dataset", config, "-o", whole, "--preview", "--quiet"});
  CHECK(preview.exit_code == 0);
  CHECK(std::filesystem::exists(whole + "/preview.png"));
}

TEST_CASE(
    "photos of an object alone: the same answers wherever it stands and whatever is around, sigma_t for its size") {
  const TemporaryFolder folder;
  const std::string config = write_config(folder), data = folder / "set", run = folder / "run";
  REQUIRE(run_itn({"dataset", config, "-o", data, "--quiet"}).exit_code == 0);
  const Result training =
      run_itn({"train", data, "--network", "rn", "--inputs", "image,flash,mask", "--cut-out", "--exposure", "--epochs",
               "1", "--batch", "8", "--threads", "1", "-o", run, "--quiet"});
  INFO(training.error);
  REQUIRE(training.exit_code == 0);
  const itn::Manifest set = itn::read_complete_manifest(data);
  const itn::ExrImage image = itn::read_exr(data + "/" + set.images[0].file);
  // The image with its object, and the floor of another colour, some way to the side in a larger picture.
  const auto said = [&](int width, int height, int left, int top, float floor, const std::vector<std::string>& more) {
    const auto picture = [&](const std::vector<std::string>& prefixes, bool mask) {
      itn::ExrImage all{width, height, {"R", "G", "B"}, {}, {}};
      for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
          for (const char* letter : {"R", "G", "B"}) {
            const int u = x - left, v = y - top;
            const bool within = u >= 0 && u < image.width && v >= 0 && v < image.height;
            const auto at = [&](const std::string& name) {
              return image.data[static_cast<std::size_t>(v * image.width + u) * image.channels.size() +
                                static_cast<std::size_t>(image.channel(name))];
            };
            float value = 0;
            if (mask)
              value = within ? at("mask") : 0;
            else
              for (const std::string& prefix : prefixes)
                value += within && at("mask") == 1 ? at(prefix + letter) : floor;
            all.data.push_back(value);
          }
      return all;
    };
    itn::write_exr(folder / "photo.exr", picture({""}, false));
    itn::write_exr(folder / "flash.exr", picture({"", "flash."}, false));
    itn::write_exr(folder / "mask.exr", picture({}, true));
    std::vector<std::string> command{
        "predict", run, folder / "photo.exr", "--flash", folder / "flash.exr", "--mask", folder / "mask.exr",
        "--json",  "-"};
    command.insert(command.end(), more.begin(), more.end());
    const Result result = run_itn(command);
    INFO(result.error);
    REQUIRE(result.exit_code == 0);
    return Json::parse(result.output)["images"][0];
  };
  const Json here = said(70, 60, 20, 30, 0.1F, {}), there = said(60, 90, 22, 40, 5.0F, {"--longest-side", "10"});
  for (const char* name : {"albedo.R", "albedo.G", "g"})
    CHECK(there[name]["value"].get<double>() == Approx(here[name]["value"].get<double>()).epsilon(1e-5));
  CHECK(10 * there["sigma_t.G"]["value"].get<double>() ==
        Approx(here["sigma_t.G"]["value"].get<double>() * set.mm_per_unit).epsilon(1e-5));

  const auto refusal = [&](const std::vector<std::string>& arguments) {
    const Result result = run_itn(arguments);
    CHECK(result.exit_code == 2);
    return result.error;
  };
  CHECK_THAT(refusal({"predict", run, "--dataset", data, "--longest-side", "3"}), Contains("leave it out"));
  const Result dark =
      run_itn({"predict", run, folder / "flash.exr", "--flash", folder / "photo.exr", "--mask", folder / "mask.exr"});
  CHECK(dark.exit_code == 3);
  CHECK_THAT(dark.error, Contains("photo.exr: is no brighter than"));
  CHECK_THAT(refusal({"train", data, "--network", "rn", "--inputs", "image", "--cut-out", "-o", folder / "b"}),
             Contains("needs a mask"));

  // A judge of what that network sees.
  const std::string judge = folder / "judge";
  const Result judging =
      run_itn({"train", data, "--network", "judge", "--inputs", "image,flash,mask", "--cut-out", "--exposure",
               "--width", "2", "--epochs", "1", "--batch", "8", "--threads", "1", "-o", judge});
  INFO(judging.error);
  REQUIRE(judging.exit_code == 0);
  CHECK_THAT(judging.output, Contains("5 % have a doubt above") && Contains("moved"));
  const Json record = Json::parse(itn::read_file(judge + "/run.json"));
  CHECK(record["found"].size() == 8);
  CHECK(record["limit"].get<double>() > 0);
  const Result judged = run_itn({"predict", run, folder / "photo.exr", "--flash", folder / "flash.exr", "--mask",
                                 folder / "mask.exr", "--judge", judge, "--json", "-"});
  INFO(judged.error);
  REQUIRE(judged.exit_code == 0);
  const Json verdict = Json::parse(judged.output);
  CHECK(verdict["doubt_limit"] == record["limit"]);
  const double doubt = verdict["images"][0]["doubt"];
  CHECK(verdict["images"][0]["doubted"] == (doubt > record["limit"].get<double>()));
  CHECK(here.count("doubt") == 0);
  CHECK_THAT(refusal({"predict", run, folder / "photo.exr", "--flash", folder / "flash.exr", "--mask",
                      folder / "mask.exr", "--judge", run}),
             Contains("is no judge"));
  const Result test = run_itn({"predict", judge, "--dataset", data, "--json", "-"});
  INFO(test.error);
  REQUIRE(test.exit_code == 0);
  CHECK(Json::parse(test.output)["found"].size() == 8);
  CHECK_THAT(refusal({"train", data, "--network", "rn", "--init", judge, "-o", folder / "c"}),
             Contains("begin with their own kind"));
  CHECK_THAT(refusal({"train", data, "--network", "judge", "--distribution", "-o", folder / "c"}),
             Contains("only rn learns one"));
}

TEST_CASE("a network of colours, a flash and a mask: from training to errors, and photos with files of their own") {
  const TemporaryFolder folder;
  const std::string config = write_config(folder), data = folder / "set", run = folder / "run";
  REQUIRE(run_itn({"dataset", config, "-o", data, "--quiet"}).exit_code == 0);
  const Result training =
      run_itn({"train", data, "--network", "rn", "--inputs", "image,flash,mask", "--width", "16", "--epochs", "2",
               "--noise", "1", "--mirror", "--threads", "1", "-o", run, "--quiet"});
  INFO(training.error);
  REQUIRE(training.exit_code == 0);

  const Result tested = run_itn({"predict", run, "--dataset", data, "--json", "-"});
  INFO(tested.error);
  REQUIRE(tested.exit_code == 0);
  const Json json = Json::parse(tested.output);
  const itn::Manifest set = itn::read_complete_manifest(data);
  std::vector<itn::Manifest::Image> images;
  double mean = 0, learnt = 0;
  for (const itn::Manifest::Image& image : set.images) {
    if (image.split == itn::Manifest::Split::unseen_shape) images.push_back(image);
    if (image.split == itn::Manifest::Split::train) {
      mean += image.colours->albedo[1];
      ++learnt;
    }
  }
  mean /= learnt;
  REQUIRE(json["images"].size() == images.size());
  double squares = 0, absolute = 0, constant = 0;
  for (std::size_t i = 0; i < images.size(); ++i) {
    const double truth = images[i].colours->albedo[1];
    const double error = json["images"][i]["albedo.G"]["value"].get<double>() - truth;
    squares += error * error;
    absolute += std::fabs(error);
    constant += std::fabs(mean - truth);
  }
  const auto count = static_cast<double>(images.size());
  const Json& errors = json["errors"]["albedo.G"];
  CHECK(errors["root_mean_square"].get<double>() == Approx(std::sqrt(squares / count)));
  CHECK(errors["mean_absolute"].get<double>() == Approx(absolute / count));
  CHECK(errors["constant"].get<double>() == Approx(constant / count));
  CHECK(errors["held"].is_null());
  CHECK(json["errors"].size() == 7);

  // The same image from pictures: without and with the flash, and a mask.
  const std::string file = data + "/" + images[0].file;
  const itn::ExrImage image = itn::read_exr(file);
  write_sum(image, {""}, folder / "photo.exr");
  write_sum(image, {"", "flash."}, folder / "flash.exr");
  itn::ExrImage mask{image.width, image.height, {"Y"}, {}, {}};
  for (std::size_t i = 0; i < image.data.size(); i += image.channels.size())
    mask.data.push_back(image.data[i + static_cast<std::size_t>(image.channel("mask"))]);
  itn::write_exr(folder / "mask.exr", mask);
  const Result photo = run_itn({"predict", run, folder / "photo.exr", "--flash", folder / "flash.exr", "--mask",
                                folder / "mask.exr", "--json", "-"});
  INFO(photo.error);
  REQUIRE(photo.exit_code == 0);
  const Json said = Json::parse(photo.output)["images"][0];
  for (const char* name : {"sigma_t.R", "albedo.B", "g"})
    CHECK(said[name]["value"].get<double>() == Approx(json["images"][0][name]["value"].get<double>()).epsilon(1e-4));

  const auto refusal = [&](const std::vector<std::string>& arguments) {
    const Result result = run_itn(arguments);
    CHECK(result.exit_code == 2);
    return result.error;
  };
  CHECK_THAT(refusal({"predict", run, folder / "photo.exr", "--flash", folder / "flash.exr"}), Contains("give mask"));
  CHECK_THAT(refusal({"predict", run, folder / "photo.exr", "--mask", folder / "mask.exr"}), Contains("give flash"));
  CHECK_THAT(refusal({"predict", run, folder / "photo.exr", folder / "photo.exr", "--flash", folder / "flash.exr",
                      "--mask", folder / "mask.exr"}),
             Contains("flash: 1 files for 2 images"));
  REQUIRE(run_itn({"train", data, "--network", "rn", "--inputs", "image,mask", "--epochs", "1", "--batch", "8",
                   "--threads", "1", "-o", folder / "masked", "--quiet"})
              .exit_code == 0);
  CHECK_THAT(refusal({"predict", folder / "masked", folder / "photo.exr", "--flash", folder / "flash.exr", "--mask",
                      folder / "mask.exr"}),
             Contains("flash: the network sees none"));
  // A scene gives the mask, in whatever light.
  for (const char* name : {"object.xml", "floor.exr", "star.ply"})
    std::filesystem::copy_file(std::string(ITN_SOURCE_DIR "/scenes/dataset/") + name, folder / name);
  itn::write_file(folder / "scene.xml", R"(<scene version="3.0.0"><include filename="object.xml"/>
    <emitter type="constant"/></scene>)");
  const Result by_scene =
      run_itn({"predict", folder / "masked", folder / "photo.exr", "--scene", folder / "scene.xml", "--json", "-"});
  INFO(by_scene.error);
  REQUIRE(by_scene.exit_code == 0);
  CHECK(Json::parse(by_scene.output)["unit_of_sigma_t"] == "1/scene unit");

  CHECK_THAT(refusal({"train", data, "--network", "itn", "-o", folder / "itn"}), Contains("rn learns from such a set"));
  CHECK_THAT(refusal({"eval", data, run, "-o", folder / "report"}), Contains("predict with this set as dataset"));
  CHECK_THAT(refusal({"train", data, "--network", "rn", "--inputs", "image", "--channels", "1", "-o", folder / "b"}),
             Contains("give either"));
}
