// What a data set is asked for with, and the plan that follows from it.
#include "runtime/dataset/plan.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <set>

#include "runtime/error.h"
#include "runtime/image/file.h"
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
  CHECK_THROWS_WITH(read_dataset_config("huge"), Contains("need a JSON file, or one of the presets"));
}
