// itn dataset as a user meets it: killed, damaged, contested, and with meshes of their own.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "itn/bitmap.h"
#include "itn/exr.h"
#include "itn/file.h"
#include "network/dataset/manifest.h"
#include "runtime/base/statistics.h"
#include "runtime/scene/mesh/mesh_file.h"
#include "runtime/scene/shapes/polygonise.h"
#include "tests/support/folder_files.h"
#include "tests/support/temporary_folder.h"
#include "tests/tool/process.h"

namespace {

// A small set of two meshes and an environment of the user's own, in which images with and without sun alternate.
std::string write_config(const TemporaryFolder& folder, int materials) {
  itn::write_ply(folder / "egg.ply", itn::shape_mesh(itn::ellipsoid({1, 1, 1.5}), 600));
  itn::write_ply(folder / "ring.ply", itn::shape_mesh(itn::torus(1, 0.4), 600));
  itn::ExrImage room{16, 9, {"R", "G", "B"}, std::vector<float>(3 * 16 * 9, 0.5F), {}};
  room.data[3 * (16 * 2 + 5)] = 30;
  itn::write_exr(folder / "room.exr", room);
  const nlohmann::json config{
      {"size", 16},
      {"spp", 16},
      {"boundary", {{"type", "rough"}, {"alpha", 0.3}, {"int_ior", 1.3}}},
      {"train", {{"shapes", {"egg.ply"}}, {"azimuths", {0}}, {"environments", {"room.exr"}}, {"materials", materials}}},
      {"test", {{"shapes", {"ring.ply"}}, {"azimuths", {30}}, {"materials", materials}}}};
  itn::write_file(folder / "config.json", config.dump());
  return folder / "config.json";
}

// The number of files in a folder, which need not be there yet.
std::ptrdiff_t entries_of(const std::string& folder) {
  std::error_code missing;
  return std::distance(std::filesystem::directory_iterator(folder, missing), {});
}

}  // namespace

TEST_CASE("a data set of one's own meshes: images with errors, buffers, a complete manifest") {
  const TemporaryFolder folder;
  const std::string config = write_config(folder, 10);
  const Result result = run_itn({"dataset", config, "-o", folder / "set", "--preview", "--json", "-"});
  INFO(result.error);
  REQUIRE(result.exit_code == 0);
  const auto json = nlohmann::json::parse(result.output);
  CHECK(json["schema"] == "itn.dataset.render/1");
  CHECK(json["images"] == 20 + 10 + 20 + 10);
  CHECK(json["rendered"] == 60);
  CHECK(json["splits"]["validation"] == 2);
  const itn::Manifest set = itn::read_complete_manifest(folder / "set");
  REQUIRE(set.images.size() == 60);
  REQUIRE(set.lights[1].environment);
  CHECK(itn::read_exr(folder / "set/" + set.lights[1].environment->file).width == 16);
  CHECK(set.hash == json["hash"]);
  for (const itn::Manifest::Image& image : set.images) {
    const itn::ExrImage exr = itn::read_exr(folder / "set" + "/" + image.file);
    CHECK((exr.width == 16 && exr.height == 16));
    CHECK(exr.header.at("hash") == set.hash);
    REQUIRE((exr.channel("Y") >= 0 && exr.channel("stderr.Y") >= 0));
  }
  const itn::ExrImage buffers = itn::read_exr(folder / "set" + "/" + set.shapes[0].buffers);
  CHECK(buffers.channels.size() == 5);
  const itn::Bitmap preview = itn::read_bitmap(folder / "set/preview.png");
  CHECK((preview.width == 10 * 96 && preview.height == 6 * 96));

  const Result again = run_itn({"dataset", config, "-o", folder / "set", "--json", "-"});
  REQUIRE(again.exit_code == 0);
  CHECK(nlohmann::json::parse(again.output)["rendered"] == 0);
}

TEST_CASE("killed at 20 moments and gone on with, a data set has the same bytes") {
  const TemporaryFolder folder;
  const std::string config = write_config(folder, 150);
  REQUIRE(run_itn({"dataset", config, "-o", folder / "whole", "--quiet"}).exit_code == 0);
  for (int k = 0; k < 20; ++k) {
    Process process({"dataset", config, "-o", folder / "broken", "--quiet"}, {});
    wait_until([&] { return entries_of(folder / "broken/images") >= 30 * k; });
    process.send(SIGKILL);
    CHECK(process.wait().exit_code == -SIGKILL);
  }
  REQUIRE(run_itn({"dataset", config, "-o", folder / "broken", "--quiet"}).exit_code == 0);
  std::map<std::string, std::string> whole = files_of(folder / "whole"), broken = files_of(folder / "broken");
  for (const auto& [name, bytes] : whole) {
    CAPTURE(name);
    CHECK((broken.count(name) == 1 && broken[name] == bytes));
  }
}

TEST_CASE("images that are missing, damaged or of another set are rendered again") {
  const TemporaryFolder folder;
  const std::string config = write_config(folder, 2), set = folder / "set";
  REQUIRE(run_itn({"dataset", config, "-o", set, "--quiet"}).exit_code == 0);
  const auto before = files_of(set);
  std::filesystem::remove(set + "/images/000000.exr");
  itn::write_file(set + "/images/000001.exr", before.at("images/000001.exr").substr(0, 300));
  REQUIRE(run_itn({"dataset", config, "-o", folder / "other", "--seed", "1", "--quiet"}).exit_code == 0);
  std::filesystem::copy_file(folder / "other/images/000002.exr", set + "/images/000002.exr",
                             std::filesystem::copy_options::overwrite_existing);
  std::filesystem::remove(set + "/shapes/ring.exr");
  REQUIRE(run_itn({"dataset", config, "-o", set, "--quiet"}).exit_code == 0);
  CHECK((files_of(set) == before));
  for (const char* image : {"/images/000001.exr", "/images/000003.exr"}) {  // under the sun, and in an environment
    CAPTURE(image);
    std::filesystem::remove(set + image);
    REQUIRE(run_itn({"dataset", config, "-o", set, "--quiet"}).exit_code == 0);
    CHECK((files_of(set) == before));
  }
}

TEST_CASE("a folder belongs to one configuration and one writer") {
  const TemporaryFolder folder;
  const std::string config = write_config(folder, 2);
  REQUIRE(run_itn({"dataset", config, "-o", folder / "set", "--quiet"}).exit_code == 0);
  const auto before = files_of(folder / "set");
  const Result other = run_itn({"dataset", config, "-o", folder / "set", "--spp", "8"});
  CHECK(other.exit_code == 2);
  CHECK_THAT(other.error, Catch::Contains("another configuration"));
  CHECK((files_of(folder / "set") == before));

  const std::string large = write_config(folder, 2000);
  Process first({"dataset", large, "-o", folder / "contested", "--quiet"}, {});
  wait_until([&] { return std::filesystem::exists(folder / "contested/manifest.json"); });
  const Result second = run_itn({"dataset", large, "-o", folder / "contested", "--quiet"});
  first.send(SIGINT);
  CHECK(first.wait().exit_code == 130);
  CHECK(second.exit_code == 1);
  CHECK_THAT(second.error, Catch::Contains("another process"));
}

TEST_CASE("a data set with several albedos of a material has the images that each alone has, but for noise") {
  const TemporaryFolder folder;
  auto config = nlohmann::json::parse(itn::read_file(write_config(folder, 2)));
  config["train"].erase("environments");
  config["colours"] = "rgb";
  config["flash"] = 3;
  config["spp"] = 64;
  itn::write_file(folder / "config.json", config.dump());
  REQUIRE(run_itn({"dataset", folder / "config.json", "-o", folder / "single", "--quiet"}).exit_code == 0);
  config["train"]["albedos"] = 3;
  itn::write_file(folder / "config.json", config.dump());
  REQUIRE(run_itn({"dataset", folder / "config.json", "-o", folder / "set", "--quiet"}).exit_code == 0);
  const itn::Manifest set = itn::read_complete_manifest(folder / "set"),
                      single = itn::read_complete_manifest(folder / "single");
  std::vector<double> z;
  for (const itn::Manifest::Image& image : single.images) {  // which the set has, too, beside others
    const auto same = std::find_if(set.images.begin(), set.images.end(), [&](const itn::Manifest::Image& other) {
      return other.seed == image.seed && other.colours->albedo == image.colours->albedo;
    });
    if (same == set.images.end()) continue;
    const itn::ExrImage one = itn::read_exr(folder / "set/" + same->file),
                        other = itn::read_exr(folder / "single/" + image.file);
    REQUIRE((one.channels == other.channels && one.data.size() == other.data.size()));
    const std::size_t channels = one.channels.size();
    for (const char* name : {"R", "G", "B", "flash.R", "flash.G", "flash.B"}) {
      const std::string text = name, error = text.size() == 1 ? "stderr." + text : "flash.stderr." + text.substr(6);
      const auto value = static_cast<std::size_t>(one.channel(text)), of = static_cast<std::size_t>(one.channel(error));
      double difference = 0, variance = 0;
      for (std::size_t k = 0; k < one.data.size(); k += channels) {
        difference += one.data[k + value] - other.data[k + value];
        variance += std::pow(one.data[k + of], 2) + std::pow(other.data[k + of], 2);
      }
      z.push_back(difference / std::sqrt(variance));
    }
  }
  REQUIRE(z.size() >= 6 * single.images.size() / 3);
  for (const double score : z) CHECK(std::abs(score) < itn::largest_z_bound(z.size(), 1e-4));

  const auto before = files_of(folder / "set");
  std::filesystem::remove(folder / "set/images/000001.exr");
  REQUIRE(run_itn({"dataset", folder / "config.json", "-o", folder / "set", "--quiet"}).exit_code == 0);
  CHECK((files_of(folder / "set") == before));

  const auto refused = [&](const std::string& what) {
    itn::write_file(folder / "config.json", config.dump());
    const Result result = run_itn({"dataset", folder / "config.json", "-o", folder / "c"});
    CHECK(result.exit_code == 3);
    CHECK_THAT(result.error, Catch::Contains(what));
  };
  config["albedo"] = {0.5, 0.5};
  refused("albedo is [0.5,0.5]; need a range");
  config["albedo"] = {0.3, 0.9};
  config["train"]["albedos"] = 17;
  refused("train.albedos is 17; need a whole number from 1 to 16");
  config["train"]["albedos"] = 2;
  config.erase("colours");
}

TEST_CASE("itn dataset says what is wrong with a configuration or a mesh") {
  const TemporaryFolder folder;
  const Result unknown = run_itn({"dataset", "huge", "-o", folder / "a"});
  CHECK(unknown.exit_code == 3);
  CHECK_THAT(unknown.error, Catch::Contains("laptop"));
  itn::Mesh open = itn::shape_mesh(itn::ball({0, 0, 0}, 1), 600);
  open.triangle.resize(open.triangle.size() / 2);  // more than a hole that is closed
  itn::write_ply(folder / "open.ply", open);
  itn::write_file(folder / "config.json", R"({"test":{"shapes":["open.ply"]}})");
  const Result hole = run_itn({"dataset", folder / "config.json", "-o", folder / "b"});
  CHECK(hole.exit_code == 3);
  CHECK_THAT(hole.error, Catch::Contains("146 open edges") && Catch::Contains("must be closed"));
  CHECK_FALSE(std::filesystem::exists(folder / "b/manifest.json"));
  itn::write_file(folder / "config.json", R"({"test":{"environments":["nowhere.exr"]}})");
  const Result dark = run_itn({"dataset", folder / "config.json", "-o", folder / "c"});
  CHECK(dark.exit_code == 3);
  CHECK_THAT(dark.error, Catch::Contains("nowhere.exr: cannot be read"));
}
