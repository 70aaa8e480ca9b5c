// The request of a data set, and the plan that follows from it.
#include "network/dataset/plan.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>
#include <set>
#include <tuple>

#include "itn/error.h"
#include "itn/exr.h"
#include "itn/file.h"
#include "tests/support/temporary_folder.h"

using namespace itn;
using Split = Manifest::Split;

namespace {

std::map<Split, int> splits(const Manifest& set) {
  std::map<Split, int> count;
  for (const Manifest::Image& image : set.images) ++count[image.split];
  return count;
}

DatasetPlan plan_of(const DatasetConfig& config) { return plan_dataset(config, "0", "device"); }

}  // namespace

TEST_CASE("the paper's data set: 20,000 images, training on six shapes under four lights") {
  const Manifest set = plan_of(read_dataset_config("paper")).manifest;
  CHECK(set.images.size() == 20000);
  CHECK(set.shapes.size() == 10);
  CHECK(set.lights.size() == 10);
  std::map<Split, int> count = splits(set);
  CHECK(count[Split::train] + count[Split::validation] == 6 * 4 * 200);
  CHECK(count[Split::validation] == 6 * 4 * 20);
  CHECK(count[Split::unseen_light] == 6 * 6 * 200);
  CHECK(count[Split::unseen_shape] == 4 * 4 * 200);
  CHECK(count[Split::unseen_both] == 4 * 6 * 200);
}

TEST_CASE("every preset's plan is a valid manifest with images for training, validation and test") {
  for (const std::string& preset : dataset_presets()) {
    CAPTURE(preset);
    const TemporaryFolder folder;
    const Manifest set = plan_of(read_dataset_config(preset)).manifest;
    write_manifest(folder / "", set);  // which refuses what is not valid
    std::map<Split, int> count = splits(set);
    CHECK(count[Split::train] > 0);
    CHECK(count[Split::validation] > 0);
    CHECK(count[Split::unseen_light] + count[Split::unseen_shape] + count[Split::unseen_both] > 0);
  }
}

TEST_CASE("a preset as JSON is the same configuration") {
  const TemporaryFolder folder;
  for (const std::string& preset : dataset_presets()) {
    const std::string text = to_json(read_dataset_config(preset));
    write_file(folder / "config.json", text);
    CHECK(to_json(read_dataset_config(folder / "config.json")) == text);
  }
}

TEST_CASE("materials cover their ranges evenly, sigma_t by its logarithm") {
  const Manifest set = plan_of(read_dataset_config("paper")).manifest;
  std::array<std::array<int, 10>, 3> bins{};
  for (const Manifest::Image& image : set.images) {
    const std::array<double, 3> u{std::log(image.sigma_t / 25) / std::log(12.0), (image.albedo - 0.3) / 0.65,
                                  image.g / 0.9};
    for (std::size_t k = 0; k < 3; ++k) {
      REQUIRE((u[k] >= 0 && u[k] <= 1));
      ++bins[k][std::min<std::size_t>(9, static_cast<std::size_t>(u[k] * 10))];
    }
  }
  // An additive sequence is off by a few points, random ones would be by 45.
  for (const auto& of_one : bins)
    for (const int count : of_one) CHECK(std::abs(count - 2000) < 20);
}

TEST_CASE("random shapes and lights: every image has its own, and test shapes are other shapes") {
  DatasetConfig config = read_dataset_config("varied");
  config.train.random_shapes = 50;
  config.train.materials = 1;
  config.test.shapes.clear();
  config.test.random_shapes = 50;
  const Manifest set = plan_of(config).manifest;
  std::set<std::uint64_t> seeds;
  for (const Manifest::Shape& shape : set.shapes) seeds.insert(std::get<Manifest::RandomMesh>(shape.mesh).seed);
  CHECK(seeds.size() == 100);
  std::set<int> lights;
  for (const Manifest::Image& image : set.images)
    if (image.split == Split::train || image.split == Split::validation) {
      lights.insert(image.light);
      const double azimuth = set.lights[static_cast<std::size_t>(image.light)].azimuth;
      CHECK((azimuth >= 0 && azimuth <= 90));
    }
  CHECK(lights.size() == 50);
  CHECK(splits(set)[Split::validation] == 5);
}

TEST_CASE("several albedos of a material: images of the same paths, one split, albedos all over the range") {
  const bool in_colours = GENERATE(false, true);
  DatasetConfig config = read_dataset_config(in_colours ? "world" : "varied");
  config.train.random_shapes = 20;
  config.train.materials = 2;
  const Manifest single = plan_of(config).manifest;
  config.train.albedos = 4;
  const Manifest set = plan_of(config).manifest;
  const auto trained = [](const Manifest& of) {
    return std::count_if(of.images.begin(), of.images.end(), [](const Manifest::Image& image) {
      return image.split == Split::train || image.split == Split::validation;
    });
  };
  CHECK(trained(single) == 40);
  REQUIRE(trained(set) == 160);
  for (std::size_t i = 0; i < 160; i += 4) {
    CAPTURE(in_colours, i);
    const Manifest::Image& first = set.images[i];
    const auto together = of_same_paths(set, set.images[i + 2]);
    REQUIRE((together.data() == &first && together.size() == 4));
    std::vector<double> albedos;
    for (const Manifest::Image& image : together) {
      CHECK((image.split == first.split && image.shape == first.shape && image.light == first.light));
      CHECK((image.sigma_t == first.sigma_t && image.g == first.g));
      if (in_colours) CHECK((image.colours->sigma_t == first.colours->sigma_t));
      albedos.push_back(in_colours ? image.colours->albedo[1] : image.albedo);
    }
    std::sort(albedos.begin(), albedos.end());
    for (std::size_t k = 1; k < 4; ++k)
      CHECK(albedos[k] - albedos[k - 1] == Approx((config.albedo[1] - config.albedo[0]) / 4));
    CHECK((albedos.front() >= config.albedo[0] && albedos.back() <= config.albedo[1]));
    // The first is as where there is one alone.
    CHECK(first.albedo == single.images[i / 4].albedo);
    CHECK((first.sigma_t == single.images[i / 4].sigma_t && first.seed == single.images[i / 4].seed));
  }
  CHECK(of_same_paths(set, set.images[160]).size() == 1);
}

TEST_CASE("the hash tells configurations, versions, devices and mesh files apart") {
  const TemporaryFolder folder;
  write_file(folder / "body.ply", "ply");
  DatasetConfig config = read_dataset_config("tiny");
  std::set<std::string> hashes{plan_of(config).manifest.hash};
  CHECK(plan_of(config).manifest.hash == *hashes.begin());
  hashes.insert(plan_dataset(config, "1", "device").manifest.hash);
  hashes.insert(plan_dataset(config, "0", "another").manifest.hash);
  config.seed = 1;
  hashes.insert(plan_of(config).manifest.hash);
  config.test.shapes = {folder / "body.ply"};
  hashes.insert(plan_of(config).manifest.hash);
  write_file(folder / "body.ply", "other");
  hashes.insert(plan_of(config).manifest.hash);
  CHECK(hashes.size() == 6);
}

TEST_CASE("environments are lights beside the sun's, each turned to every azimuth, and copied once") {
  const TemporaryFolder folder;
  // A lamp in the middle of the picture, a bit above the horizon.
  ExrImage room{8, 9, {"R", "G", "B"}, std::vector<float>(3 * 8 * 9, 0), {}};
  for (const std::size_t i : {8 * 3 + 3, 8 * 3 + 4}) room.data[3 * i] = 5;
  write_exr(folder / "room.exr", room);
  write_exr(folder / "yard.exr", room);
  write_file(folder / "config.json", R"({"environment_scale": 0.5,
    "train": {"shapes": ["knot"], "azimuths": [10], "materials": 10,
              "environments": ["room.exr"], "environment_azimuths": [0, 90]},
    "test": {"shapes": ["hare"], "azimuths": [], "environments": ["yard.exr", "room.exr"],
             "environment_azimuths": [45], "materials": 2}})");
  const DatasetConfig config = read_dataset_config(folder / "config.json");
  const DatasetPlan plan = plan_of(config);
  const Manifest& set = plan.manifest;
  CHECK(plan.environment_files == std::map<std::string, std::string>{{"environments/room.exr", folder / "room.exr"},
                                                                     {"environments/yard.exr", folder / "yard.exr"}});
  REQUIRE(set.lights.size() == 3 + 2);
  CHECK_FALSE(set.lights[0].environment);
  for (const auto& [light, azimuth, file] :
       {std::tuple{1, 0, "room"}, {2, 90, "room"}, {3, 45, "yard"}, {4, 45, "room"}}) {
    const Manifest::Light& l = set.lights[static_cast<std::size_t>(light)];
    REQUIRE(l.environment);
    CHECK(l.environment->file == std::string("environments/") + file + ".exr");
    CHECK(l.environment->scale == 0.5);
    CHECK(l.azimuth == azimuth);
    const double a = azimuth * std::numbers::pi / 180;
    CHECK(l.direction[0] * std::cos(a) == Approx(l.direction[1] * std::sin(a)).margin(1e-9));
    CHECK(l.direction[0] * std::sin(a) + l.direction[1] * std::cos(a) > 0.5);
  }
  std::map<Split, int> count = splits(set);
  CHECK(count[Split::train] == 27);
  CHECK(count[Split::validation] == 3);
  CHECK(count[Split::unseen_light] == 2 * 2);
  CHECK(count[Split::unseen_shape] == 3 * 2);
  CHECK(count[Split::unseen_both] == 2 * 2);
  write_file(folder / "again.json", to_json(config));
  CHECK(to_json(read_dataset_config(folder / "again.json")) == to_json(config));

  room.data[0] = 1;
  write_exr(folder / "yard.exr", room);
  CHECK(plan_of(config).manifest.hash != set.hash);
  room.data[0] = -1;
  write_exr(folder / "yard.exr", room);
  CHECK_THROWS_WITH(plan_of(config), Catch::Contains("yard.exr: column 0, row 0, channel 0 is -1"));
  std::filesystem::remove(folder / "yard.exr");
  CHECK_THROWS_WITH(plan_of(config), Catch::Contains("yard.exr: cannot be read"));
  std::filesystem::create_directory(folder / "other");
  write_exr(folder / "other/room.exr", room);
  DatasetConfig twice = config;
  twice.test.environments = {folder / "other/room.exr"};
  CHECK_THROWS_WITH(plan_of(twice), Catch::Contains("two environments of one name"));
}

TEST_CASE("where the training's suns are drawn, environments are unseen light and other suns are not") {
  const TemporaryFolder folder;
  write_exr(folder / "room.exr", {4, 3, {"Y"}, std::vector<float>(12, 1), {}});
  DatasetConfig config = read_dataset_config("varied");
  config.train.random_shapes = 0;
  config.train.shapes = {"knot"};
  config.test.shapes = {"hare"};
  config.test.azimuths = {20};
  config.test.environments = {folder / "room.exr"};
  config.train.materials = config.test.materials = 1;
  const Manifest set = plan_of(config).manifest;
  REQUIRE(set.images.size() == 4);
  const std::array<std::tuple<Split, int, bool>, 4> wanted{{{Split::train, 0, false},
                                                            {Split::unseen_light, 0, true},
                                                            {Split::unseen_shape, 1, false},
                                                            {Split::unseen_both, 1, true}}};
  for (std::size_t i = 0; i < 4; ++i) {
    const Manifest::Image& image = set.images[i];
    const bool environment = set.lights[static_cast<std::size_t>(image.light)].environment.has_value();
    CHECK((std::tuple(image.split, image.shape, environment) == wanted[i]));
  }
}

TEST_CASE("what is said of environments is no part of a set, nor of its hash, where there are none") {
  DatasetConfig config = read_dataset_config("tiny");
  CHECK(to_json(config).find("environment") == std::string::npos);
  const std::string hash = plan_of(config).manifest.hash;
  config.environment_scale = 2;
  config.train.environment_azimuths = {0, 90};
  CHECK(plan_of(config).manifest.hash == hash);
}

TEST_CASE("configurations that cannot be are refused with the key, what is there, and what is needed") {
  const TemporaryFolder folder;
  const auto refusal = [&](const std::string& json) -> std::string {
    write_file(folder / "config.json", json);
    try {
      read_dataset_config(folder / "config.json");
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  };
  using Catch::Contains;
  CHECK_THAT(refusal("{"), Contains("no JSON"));
  CHECK_THAT(refusal("[]"), Contains("need an object"));
  CHECK_THAT(refusal(R"({"preset":"big"})"), Contains("preset is \"big\"") && Contains("laptop"));
  CHECK_THAT(refusal(R"({"sise":64})"), Contains("sise is not known") && Contains("size"));
  CHECK_THAT(refusal(R"({"size":65})"), Contains("size is 65; need 8, 16, 32, 64 or 128"));
  CHECK_THAT(refusal(R"({"spp":1})"), Contains("spp is 1; need a whole number from 2"));
  CHECK_THAT(refusal(R"({"spp":"many"})"), Contains("spp is \"many\""));
  CHECK_THAT(refusal(R"({"sigma_t":[3]})"), Contains("sigma_t is [3]; need two numbers"));
  CHECK_THAT(refusal(R"({"sigma_t":[30,3]})"), Contains("the smaller first"));
  CHECK_THAT(refusal(R"({"albedo":[0,1.1]})"), Contains("albedo is [0,1.1]"));
  CHECK_THAT(refusal(R"({"boundary":{"type":"shiny"}})"), Contains("boundary.type is \"shiny\""));
  CHECK_THAT(refusal(R"({"boundary":{"type":"rough"}})"), Contains("boundary.alpha is null"));
  CHECK_THAT(refusal(R"({"train":{"materials":0}})"), Contains("train.materials is 0"));
  CHECK_THAT(refusal(R"({"train":{"shapes":[]}})"), Contains("train.shapes is []; need at least one"));
  CHECK_THAT(refusal(R"({"test":{"shapes":["frog"]}})"), Contains("the shape frog is not known") && Contains("hare"));
  CHECK_THAT(refusal(R"({"test":{"colour":1}})"), Contains("test.colour is not known"));
  CHECK_THAT(refusal(R"({"train":{"environments":"a.exr"}})"),
             Contains("train.environments is \"a.exr\"; need a list"));
  CHECK_THAT(refusal(R"({"train":{"environments":["a.exr","a.exr"]}})"),
             Contains("train.environments") && Contains("each once"));
  CHECK_THAT(refusal(R"({"test":{"environment_azimuths":[]}})"), Contains("test.environment_azimuths is []"));
  CHECK_THAT(refusal(R"({"test":{"environment_azimuths":[200]}})"), Contains("angles from -180 to 180"));
  CHECK_THAT(refusal(R"({"environment_scale":0})"), Contains("environment_scale is 0; need a number from"));
  CHECK_THAT(refusal(R"({"environmentscale":1})"), Contains("is not known") && Contains("environment_scale"));
  CHECK_THROWS_WITH(read_dataset_config("huge"), Contains("need a JSON file, or one of the presets"));
}

TEST_CASE("numbers of a configuration are taken as they stand or refused, never rounded or wrapped") {
  const TemporaryFolder folder;
  const auto refusal = [&](const std::string& text) {
    write_file(folder / "config.json", text);
    try {
      read_dataset_config(folder / "config.json");
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  CHECK(refusal(R"({"size": 32, "seed": 18446744073709551615, "sigma_t": [1, 2]})").empty());
  for (const char* text : {R"({"size": 32.9})",
                           R"({"size": 4294967304})",
                           R"({"size": 48})",
                           R"({"size": true})",
                           R"({"seed": -5})",
                           R"({"seed": 1.5})",
                           R"({"spp": 1})",
                           R"({"spp": 1e9})",
                           R"({"zenith": true})",
                           R"({"sigma_t": [1, 2, 3]})",
                           R"({"sigma_t": [1, true]})",
                           R"({"sigma_t": 1})",
                           R"({"train": {"azimuths": [true]}})",
                           R"({"size": null})",
                           R"({"train": null})",
                           R"({"train": {"shapes": null}})",
                           R"({"boundary": null})",
                           R"({"boundary": {"type": null}})",
                           R"({"seed": null})",
                           R"({"albedo": null})",
                           R"(null)",
                           R"([1])",
                           "{",
                           R"({"train": {"materials": 1.5}})",
                           R"({"longest_side_mm": 1e999})"}) {
    CAPTURE(text);
    CHECK_THAT(refusal(text), Catch::Contains("config.json: "));
  }
  CHECK_THAT(refusal(std::string(50000, '[') + std::string(50000, ']')), Catch::Contains("deep"));
}

TEST_CASE("more than a million images or shapes are refused before they take the memory") {
  DatasetConfig config = read_dataset_config("tiny");
  config.train.materials = 10'000'000;
  CHECK_THROWS_WITH(plan_of(config), Catch::Contains("more than 1000000 images"));
  config = read_dataset_config("varied");
  config.train.random_shapes = 10'000'000;
  CHECK_THROWS_WITH(plan_of(config), Catch::Contains("more than 1000000 images"));
}
