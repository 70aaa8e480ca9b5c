// itn dataset as a user meets it: killed, damaged, contested, and with meshes of their own.
#include <catch2/catch.hpp>
#include <csignal>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "runtime/base/file.h"
#include "runtime/dataset/manifest.h"
#include "runtime/image/bitmap.h"
#include "runtime/image/exr.h"
#include "runtime/scene/mesh/mesh_file.h"
#include "runtime/shapes/polygonise.h"
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

// How many files a folder holds, which need not be there yet.
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

TEST_CASE("a data set with curvatures has the same images, and says of each what errors of its material are worth") {
  const TemporaryFolder folder;
  auto config = nlohmann::json::parse(itn::read_file(write_config(folder, 2)));
  REQUIRE(run_itn({"dataset", folder / "config.json", "-o", folder / "plain"}).exit_code == 0);
  config["curvature"] = true;
  itn::write_file(folder / "config.json", config.dump());
  REQUIRE(run_itn({"dataset", folder / "config.json", "-o", folder / "set"}).exit_code == 0);
  const itn::Manifest set = itn::read_complete_manifest(folder / "set");
  CHECK(set.curvature);
  for (const itn::Manifest::Image& image : set.images) {
    const std::string file = "/" + image.file;
    const itn::ExrImage with = itn::read_exr(folder / "set" + file), without = itn::read_exr(folder / "plain" + file);
    REQUIRE(with.channels == without.channels);
    for (std::size_t i = 0; i < with.data.size(); ++i)
      REQUIRE(with.data[i] == Approx(without.data[i]).epsilon(1e-4).margin(1e-6));
    const auto curvature = nlohmann::json::parse(with.header.at("curvature"));
    CHECK(curvature.size() == 6);
    CHECK(curvature[3] > 0);  // the albedo shows
    CHECK(without.header.count("curvature") == 0);
  }
  config["colours"] = "rgb";
  itn::write_file(folder / "config.json", config.dump());
  const Result colours = run_itn({"dataset", folder / "config.json", "-o", folder / "c"});
  CHECK(colours.exit_code == 3);
  CHECK_THAT(colours.error, Catch::Contains("curvature is true; need false where images are in colours"));
  config.erase("colours");
  config["spp"] = 7;
  itn::write_file(folder / "config.json", config.dump());
  const Result odd = run_itn({"dataset", folder / "config.json", "-o", folder / "c"});
  CHECK(odd.exit_code == 3);
  CHECK_THAT(odd.error, Catch::Contains("spp is 7; need an even number"));
  CHECK(run_itn({"dataset", folder / "config.json", "-o", folder / "c", "--spp", "3"}).exit_code == 3);
  config["spp"] = 8;
  itn::write_file(folder / "config.json", config.dump());
  CHECK(run_itn({"dataset", folder / "config.json", "-o", folder / "c", "--spp", "3"}).exit_code == 2);
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
