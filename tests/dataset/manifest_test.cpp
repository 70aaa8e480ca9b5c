#include "network/dataset/manifest.h"

#include <catch2/catch.hpp>
#include <functional>
#include <nlohmann/json.hpp>

#include "itn/error.h"
#include "itn/file.h"
#include "tests/support/temporary_folder.h"

namespace {

using namespace itn;
using Catch::Contains;
using Json = nlohmann::ordered_json;

Manifest example() {
  Manifest manifest;
  manifest.version = "1.2.3";
  manifest.hash = "0123456789abcdef";
  manifest.complete = true;
  manifest.config = R"({"materials":3})";
  manifest.size = 64;
  manifest.spp = 256;
  manifest.mm_per_unit = 10;
  manifest.boundary = {true, 0.25, 1.33};
  manifest.shapes = {
      {"knot", Manifest::Role::train, "shapes/knot.exr", Manifest::NamedMesh{"knot"}},
      {"random_7", Manifest::Role::train, "shapes/random_7.exr", Manifest::RandomMesh{18446744073709551615U, 40000}},
      {"mine", Manifest::Role::test, "shapes/mine.exr", Manifest::FileMesh{"shapes/mine.ply"}}};
  manifest.lights = {{30, 60, {0.75, 0.4330127018922193, 0.5}, {}},
                     {0, 0, {0, 0, 1}, {}},
                     {-90, 0, {0.6, 0, 0.8}, Manifest::Environment{"environments/room.exr", 0.1}}};
  manifest.images = {{"images/000000.exr", Manifest::Split::train, 1, 0, 0.1, 0.95, -0.3, 18446744073709551615U},
                     {"images/000001.exr", Manifest::Split::unseen_both, 2, 1, 300, 0, 0.9, 0}};
  return manifest;
}

// The example's JSON, changed, as a file; what reading it says.
std::string message(const std::function<void(Json&)>& change) {
  const TemporaryFolder folder;
  write_manifest(folder.path(), example());
  const std::string file = manifest_file(folder.path());
  Json json = Json::parse(read_file(file));
  change(json);
  write_file(file, json.dump());
  try {
    read_complete_manifest(folder.path());
  } catch (const InputError& error) {
    CHECK_THAT(error.what(), Catch::StartsWith(file + ": "));
    return std::string(error.what()).substr(file.size() + 2);
  }
  return "accepted";
}

}  // namespace

TEST_CASE("A manifest comes back as written, every number to the bit") {
  const TemporaryFolder folder;
  const Manifest written = example();
  write_manifest(folder.path(), written);
  const Manifest read = read_manifest(folder.path());
  CHECK(read.version == written.version);
  CHECK(read.hash == written.hash);
  CHECK(read.complete);
  CHECK(read.config == written.config);
  CHECK(read.size == 64);
  CHECK(read.spp == 256);
  CHECK(read.mm_per_unit == 10);
  CHECK(read.boundary.rough);
  CHECK(read.boundary.alpha == 0.25);
  CHECK(read.boundary.int_ior == 1.33);
  REQUIRE(read.shapes.size() == 3);
  CHECK(read.shapes[2].name == "mine");
  CHECK(read.shapes[2].role == Manifest::Role::test);
  CHECK(read.shapes[2].buffers == "shapes/mine.exr");
  CHECK(std::get<Manifest::NamedMesh>(read.shapes[0].mesh).name == "knot");
  CHECK(std::get<Manifest::RandomMesh>(read.shapes[1].mesh).seed == 18446744073709551615U);
  CHECK(std::get<Manifest::RandomMesh>(read.shapes[1].mesh).triangles == 40000);
  CHECK(std::get<Manifest::FileMesh>(read.shapes[2].mesh).file == "shapes/mine.ply");
  REQUIRE(read.lights.size() == 3);
  CHECK(read.lights[0].azimuth == 30);
  CHECK(read.lights[0].zenith == 60);
  CHECK(read.lights[0].direction == written.lights[0].direction);
  CHECK_FALSE(read.lights[0].environment);
  CHECK(read.lights[2].azimuth == -90);
  CHECK(read.lights[2].direction == written.lights[2].direction);
  REQUIRE(read.lights[2].environment);
  CHECK(read.lights[2].environment->file == "environments/room.exr");
  CHECK(read.lights[2].environment->scale == 0.1);
  REQUIRE(read.images.size() == 2);
  CHECK(read.images[0].file == "images/000000.exr");
  CHECK(read.images[1].split == Manifest::Split::unseen_both);
  CHECK(read.images[1].shape == 2);
  CHECK(read.images[1].light == 1);
  CHECK(read.images[0].sigma_t == 0.1);
  CHECK(read.images[0].albedo == 0.95);
  CHECK(read.images[0].g == -0.3);
  CHECK(read.images[0].seed == 18446744073709551615U);
}

TEST_CASE("The same manifest gives the same bytes, also after it was read") {
  const TemporaryFolder folder;
  write_manifest(folder.path(), example());
  const std::string bytes = read_file(manifest_file(folder.path()));
  write_manifest(folder.path(), read_manifest(folder.path()));
  CHECK(read_file(manifest_file(folder.path())) == bytes);
}

TEST_CASE("A plan can be read; who needs the images is told that it is not complete") {
  const TemporaryFolder folder;
  Manifest plan = example();
  plan.complete = false;
  write_manifest(folder.path(), plan);
  CHECK_FALSE(read_manifest(folder.path()).complete);
  CHECK_THROWS_WITH(read_complete_manifest(folder.path()), Contains("not complete"));
}

TEST_CASE(
    "A manifest that says nothing of use is an input error that names the place, what is there and what is needed") {
  CHECK(message([](Json&) {}) == "accepted");
  CHECK(message([](Json& j) { j["added"] = 1; }) == "accepted");
  CHECK_THAT(message([](Json& j) { j = 3; }), Contains("got 3, need an object"));
  CHECK_THAT(message([](Json& j) { j["schema"] = "itn.dataset/2"; }),
             Contains("schema: got \"itn.dataset/2\", need \"itn.dataset/1\""));
  for (const char* key : {"schema", "version", "hash", "complete", "config", "size", "spp", "mm_per_unit", "boundary",
                          "shapes", "lights", "images"})
    CHECK(message([&](Json& j) { j.erase(key); }) == "has no \"" + std::string(key) + "\"");
  for (const char* key : {"file", "split", "shape", "light", "sigma_t", "albedo", "g", "seed"})
    CHECK(message([&](Json& j) { j["images"][1].erase(key); }) == "images[1]: has no \"" + std::string(key) + "\"");
  for (const char* key : {"name", "role", "buffers", "mesh"})
    CHECK(message([&](Json& j) { j["shapes"][2].erase(key); }) == "shapes[2]: has no \"" + std::string(key) + "\"");
  for (const char* key : {"azimuth", "zenith", "direction"})
    CHECK(message([&](Json& j) { j["lights"][0].erase(key); }) == "lights[0]: has no \"" + std::string(key) + "\"");
  for (const char* key : {"scale", "azimuth", "direction"})
    CHECK(message([&](Json& j) { j["lights"][2].erase(key); }) == "lights[2]: has no \"" + std::string(key) + "\"");

  CHECK_THAT(message([](Json& j) { j["hash"] = "0123456789ABCDEF"; }), Contains("hash: got"));
  CHECK_THAT(message([](Json& j) { j["hash"] = "012345678"; }), Contains("hash: got"));
  CHECK_THAT(message([](Json& j) { j["complete"] = "yes"; }), Contains("complete: got \"yes\", need true or false"));
  CHECK_THAT(message([](Json& j) { j["config"] = 1; }), Contains("config: got 1, need an object"));
  CHECK_THAT(message([](Json& j) { j["size"] = 0; }), Contains("size: got 0, need a whole number from 1"));
  CHECK_THAT(message([](Json& j) { j["size"] = 64.5; }), Contains("size: got 64.5"));
  CHECK_THAT(message([](Json& j) { j["spp"] = "4"; }), Contains("spp: got \"4\""));
  CHECK_THAT(message([](Json& j) { j["mm_per_unit"] = 0; }), Contains("mm_per_unit: got 0, need a number above 0"));
  CHECK_THAT(message([](Json& j) { j["boundary"]["type"] = "glass"; }), Contains("boundary.type: got \"glass\""));
  CHECK_THAT(message([](Json& j) { j["boundary"]["alpha"] = 0; }), Contains("boundary.alpha: got 0"));
  CHECK_THAT(message([](Json& j) { j["boundary"].erase("int_ior"); }), Contains("boundary: has no \"int_ior\""));
  CHECK_THAT(message([](Json& j) { j["images"] = {}; }), Contains("images: got null, need a list"));
  CHECK_THAT(message([](Json& j) { j["shapes"][0]["name"] = ""; }), Contains("shapes[0].name: got \"\", need a text"));
  CHECK_THAT(message([](Json& j) { j["shapes"][1]["name"] = "knot"; }),
             Contains("shapes[1].name: \"knot\" is there twice"));
  CHECK_THAT(message([](Json& j) { j["shapes"][0]["role"] = "both"; }), Contains("need one of train, test"));
  CHECK_THAT(message([](Json& j) { j["shapes"][0]["mesh"] = Json::object(); }),
             Contains("\"named\", \"random\" or \"file\""));
  CHECK_THAT(message([](Json& j) { j["shapes"][1]["mesh"]["random"] = -1; }),
             Contains("shapes[1].mesh.random: got -1"));
  CHECK_THAT(message([](Json& j) { j["shapes"][1]["mesh"].erase("triangles"); }), Contains("has no \"triangles\""));
  CHECK_THAT(message([](Json& j) { j["lights"][0]["zenith"] = 91; }), Contains("lights[0].zenith: got 91"));
  CHECK_THAT(message([](Json& j) { j["lights"][0]["direction"] = {0, 1}; }), Contains("need three numbers"));
  CHECK_THAT(message([](Json& j) { j["lights"][0]["direction"] = {0, 1, 1}; }), Contains("length 1"));
  CHECK_THAT(message([](Json& j) { j["lights"][2]["environment"] = "../room.exr"; }),
             Contains("lights[2].environment: got \"../room.exr\", need a file below the data set's folder"));
  CHECK_THAT(message([](Json& j) { j["lights"][2]["scale"] = 0; }),
             Contains("lights[2].scale: got 0, need a number above 0"));
  CHECK_THAT(message([](Json& j) { j["lights"][2].erase("environment"); }), Contains("lights[2]: has no \"zenith\""));
  CHECK_THAT(message([](Json& j) { j["images"][0]["split"] = "test"; }), Contains("images[0].split: got \"test\""));
  CHECK_THAT(message([](Json& j) { j["images"][0]["shape"] = 3; }),
             Contains("got 3, need the index of one of 3 shapes"));
  CHECK_THAT(message([](Json& j) { j["images"][0]["light"] = -1; }), Contains("images[0].light: got -1"));
  CHECK_THAT(message([](Json& j) { j["images"][0]["light"] = 0.5; }), Contains("images[0].light: got 0.5"));
  CHECK_THAT(message([](Json& j) { j["images"][0]["sigma_t"] = 0; }), Contains("images[0].sigma_t: got 0"));
  CHECK_THAT(message([](Json& j) { j["images"][0]["sigma_t"] = nullptr; }), Contains("images[0].sigma_t: got null"));
  CHECK_THAT(message([](Json& j) { j["images"][0]["albedo"] = 1.01; }), Contains("images[0].albedo: got 1.01"));
  CHECK_THAT(message([](Json& j) { j["images"][0]["g"] = 1; }), Contains("images[0].g: got 1"));
  CHECK_THAT(message([](Json& j) { j["images"][0]["seed"] = 1.5; }), Contains("images[0].seed: got 1.5"));
  CHECK_THAT(message([](Json& j) { j["images"][1]["file"] = "images/000000.exr"; }), Contains("is there twice"));
  CHECK_THAT(message([](Json& j) { j["images"][1]["file"] = "/etc/passwd"; }), Contains("below the data set's folder"));
  CHECK_THAT(message([](Json& j) { j["images"][1]["file"] = "images/../../a.exr"; }),
             Contains("below the data set's folder"));
}

TEST_CASE("No shape is learnt and then called unseen") {
  CHECK_THAT(message([](Json& j) { j["images"][0]["split"] = "unseen_shape"; }),
             Contains("images[0].split: is \"unseen_shape\", and the shape \"random_7\" has the role \"train\""));
  CHECK_THAT(message([](Json& j) { j["images"][1]["split"] = "validation"; }),
             Contains("the shape \"mine\" has the role \"test\""));
}

TEST_CASE("A missing, cut or foreign manifest is an input error, and one that could not be read is not written") {
  const TemporaryFolder folder;
  const std::string file = manifest_file(folder.path());
  CHECK_THROWS_WITH(read_manifest(folder.path()),
                    Contains("manifest.json: is not there; make the data set first: itn dataset"));
  Manifest wrong = example();
  wrong.images[0].g = 1.5;
  CHECK_THROWS_WITH(write_manifest(folder.path(), wrong), Contains("images[0].g: got 1.5"));
  CHECK(folder.empty());
  write_manifest(folder.path(), example());
  const std::string bytes = read_file(file);
  for (std::size_t length = 0; length + 2 < bytes.size(); length += 97) {
    write_file(file, std::string_view(bytes).substr(0, length));
    CHECK_THROWS_WITH(read_manifest(folder.path()), Contains("manifest.json: is no JSON"));
  }
}
