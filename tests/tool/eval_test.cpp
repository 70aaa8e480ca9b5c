// itn eval as a user meets it: three tables of a small rendered set, stopped and gone on, and errors that say what to
// do.
#include <signal.h>  // NOLINT(modernize-deprecated-headers): SIGINT is POSIX
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "itn/file.h"
#include "itn/network_file.h"
#include "network/dataset/manifest.h"
#include "runtime/scene/mesh/mesh_file.h"
#include "runtime/scene/shapes/polygonise.h"
#include "tests/support/temporary_folder.h"
#include "tests/tool/process.h"

namespace {

using Catch::Contains;
using Strings = std::vector<std::string>;

// One training shape under two lights, another shape and another light for tests; and a network of each kind that has
// learnt nothing.
struct Small {
  TemporaryFolder folder;
  std::string set = folder / "set";

  Small() {
    itn::write_ply(folder / "egg.ply", itn::shape_mesh(itn::ellipsoid({1, 1, 1.5}), 600));
    itn::write_ply(folder / "ring.ply", itn::shape_mesh(itn::torus(1, 0.4), 600));
    const nlohmann::json config{{"size", 16},
                                {"spp", 16},
                                {"train", {{"shapes", {"egg.ply"}}, {"azimuths", {0, 60}}, {"materials", 10}}},
                                {"test", {{"shapes", {"ring.ply"}}, {"azimuths", {30}}, {"materials", 6}}}};
    itn::write_file(folder / "config.json", config.dump());
    const Result result = run_itn({"dataset", folder / "config.json", "-o", set, "--quiet"});
    INFO(result.error);
    REQUIRE(result.exit_code == 0);
    network("rn", 1, 16);
    network("itn", 2, 16);
    network("ssn", 3, 16);
  }

  void network(const std::string& kind, std::uint64_t seed, int size) const {
    itn::NetworkDescription description;
    description.kind = kind;
    description.size = size;
    description.width = 1;
    description.mm_per_unit = 1;
    itn::Network network(description);
    network.initialise(seed);
    std::filesystem::create_directories(folder / kind);
    itn::write_network(folder / (kind + "/network.safetensors"), network, itn::Precision::single);
  }

  Strings eval(const std::string& report, const Strings& more) const {
    Strings arguments{"eval", set, folder / "rn", folder / "itn", folder / "ssn", "-o", folder / report};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
};

// Without what differs from one run to the next.
nlohmann::json result_of(const std::string& report) {
  nlohmann::json json = nlohmann::json::parse(itn::read_file(report + "/result.json"));
  json.erase("time");
  return json;
}

void fails(const Strings& arguments, int code, const std::string& word) {
  const Result result = run_itn(arguments);
  INFO(result.error);
  CHECK(result.exit_code == code);
  CHECK_THAT(result.error, Contains(word));
}

}  // namespace

TEST_CASE("itn eval: three tables of a rendered set, in JSON, on the terminal and as a page") {
  const Small small;
  const Result result = run_itn(small.eval(
      "report", {"--images", "8", "--inversions", "1", "--iterations", "20", "--json", small.folder / "result.json"}));
  INFO(result.error);
  REQUIRE(result.exit_code == 0);
  for (const char* text : {"Table 1, training", "Table 1, unseen_both", "Table 2, testing", "Table 3", "ITN / RN",
                           "information limit", "What holds here"})
    CHECK_THAT(result.output, Contains(text));
  const auto json = nlohmann::json::parse(itn::read_file(small.folder / "result.json"));
  CHECK(json["schema"] == "itn.eval/1");
  CHECK(json["table1"]["training"]["images"] == 18);
  CHECK(json["table1"]["testing"]["images"] == 6 + 12 + 6);
  CHECK(json["table1"]["testing"]["paper"]["itn"][0] == 57.44);

  // Table 1 by hand, from what itn predict says.
  const itn::Manifest set = itn::read_complete_manifest(small.set);
  Strings arguments{"predict", small.folder / "rn", "--json", small.folder / "predictions.json"};
  std::vector<double> truth;
  for (const itn::Manifest::Image& image : set.images)
    if (image.split == itn::Manifest::Split::unseen_shape) {
      arguments.push_back(small.set + "/" + image.file);
      truth.push_back(image.albedo);
    }
  REQUIRE(run_itn(arguments).exit_code == 0);
  const auto predictions = nlohmann::json::parse(itn::read_file(small.folder / "predictions.json"));
  double square = 0;
  for (std::size_t i = 0; i < truth.size(); ++i)
    square += std::pow(predictions["images"][i]["albedo"]["value"].get<double>() - truth[i], 2);
  CHECK(json["table1"]["unseen_shape"]["rn"]["albedo"]["value"].get<double>() ==
        Approx(std::sqrt(square / static_cast<double>(truth.size()))));

  CHECK(json["table2"]["images"].size() == 8 + 2);
  // Rendered from the truth an image differs by noise, from a guess by more.
  CHECK(json["table2"]["testing"]["truth"]["rmse"]["value"] < json["table2"]["testing"]["rn"]["rmse"]["value"]);
  CHECK(json["table2"]["testing"]["truth"]["1-ms_ssim"]["value"] <
        json["table2"]["testing"]["rn"]["1-ms_ssim"]["value"]);
  for (const auto& image : json["table2"]["images"]) CHECK(image["limit"]["albedo"]["with_prior"] < 0.2);
  CHECK(json["table3"]["medians"]["rn"].size() == 3);
  CHECK(json["table3"]["medians"]["truth"][0]["albedo"] == 0);
  CHECK(json["table3"]["limit"].contains("log_sigma_t"));
  CHECK(json["claims"].size() > 20);

  const std::string page = itn::read_file(small.folder / "report/report.html");
  CHECK_THAT(page, Contains("<svg") && Contains("data:image/png;base64,") && Contains("What holds here"));
  CHECK(page.find("src=\"images") == std::string::npos);
}

TEST_CASE("itn eval says how often the intervals of networks that give some hold the truth") {
  const Small small;
  itn::NetworkDescription description;
  description.size = 16;
  description.width = 1;
  description.distribution = true;
  description.spread = {1, 1, 0.05};  // far too sure of g
  std::filesystem::create_directories(small.folder / "sure");
  itn::write_network(small.folder / "sure/network.safetensors", itn::Network(description), itn::Precision::single);
  const Result result =
      run_itn({"eval", small.set, small.folder / "sure", small.folder / "itn", "-o", small.folder / "report",
               "--images", "0", "--inversions", "0", "--json", small.folder / "result.json"});
  INFO(result.error);
  REQUIRE(result.exit_code == 0);
  CHECK_THAT(result.output, Contains("Coverage, testing") && Contains("jointly"));
  const auto coverage = nlohmann::json::parse(itn::read_file(small.folder / "result.json"))["coverage"]["testing"];
  CHECK_FALSE(coverage.contains("itn"));
  // Its weights are 0: it says the middle of every range, and as deviation that of an even share times spread.
  CHECK(coverage["rn"]["sigma_t"]["value"] == 1);
  const itn::Manifest set = itn::read_complete_manifest(small.set);
  double held = 0, count = 0;
  for (const itn::Manifest::Image& image : set.images)
    if (image.split != itn::Manifest::Split::train && image.split != itn::Manifest::Split::validation) {
      const double share =
          (image.g - description.outputs[2].low) / (description.outputs[2].high - description.outputs[2].low);
      held += std::fabs(share - 0.5) < 1.959964 * 0.05 / std::sqrt(12.0);
      count += 1;
    }
  CHECK(coverage["rn"]["g"]["value"].get<double>() == Approx(held / count));
  CHECK(coverage["rn"]["jointly"]["value"].get<double>() <= coverage["rn"]["sigma_t"]["value"].get<double>());
  int ranked = 0;
  for (const auto& tenth : coverage["rn"]["albedo"]["ranks"]) ranked += tenth.get<int>();
  CHECK(ranked == count);
}

TEST_CASE("stopped in its inversions, itn eval goes on to the same result") {
  const Small small;
  const Strings more{"--images", "0", "--inversions", "6", "--iterations", "60"};
  const Result whole = run_itn(small.eval("whole", more));
  INFO(whole.error);
  REQUIRE(whole.exit_code == 0);
  Process first(small.eval("broken", more), {});
  const std::string state = small.folder / "broken/inversions_itn.json";
  wait_until([&] { return std::filesystem::exists(state); });
  first.send(SIGINT);
  CHECK(first.wait().exit_code == 130);
  CHECK_FALSE(std::filesystem::exists(small.folder / "broken/report.html"));
  const auto stored = nlohmann::json::parse(itn::read_file(state));
  CHECK(stored["state"]["iteration"] < 60);
  small.network("itn", 9, 16);
  fails(small.eval("broken", more), 2, "holds inversions of itn eval with another network");
  small.network("itn", 2, 16);
  REQUIRE(run_itn(small.eval("broken", more)).exit_code == 0);
  CHECK(result_of(small.folder / "broken") == result_of(small.folder / "whole"));
}

TEST_CASE("itn eval says what is wrong with a data set or a run") {
  const Small small;
  const std::string report = small.folder / "report";
  fails({"eval", small.set, "-o", report}, 2, "runs");
  fails({"eval", small.folder / "nowhere", small.folder / "rn", "-o", report}, 3,
        "make the data set first: itn dataset");
  fails({"eval", small.set, small.folder / "nowhere", "-o", report}, 3, "train it first: itn train");
  std::filesystem::create_directory(small.folder / "empty");
  fails({"eval", small.set, small.folder / "empty", "-o", report}, 3, "network.safetensors");
  small.network("itn", 2, 32);
  fails({"eval", small.set, small.folder / "itn", "-o", report}, 3, "32 x 32 pixels");
  itn::Manifest set = itn::read_manifest(small.set);
  // No derivative by the material: the file is wrong for it, not the command line.
  itn::Manifest white = set;
  white.images.front().albedo = 0;
  itn::write_manifest(small.set, white);
  fails({"eval", small.set, small.folder / "rn", "-o", report, "--images", "1", "--inversions", "0"}, 3, "albedo is 0");
  set.complete = false;
  itn::write_manifest(small.set, set);
  fails({"eval", small.set, small.folder / "rn", "-o", report}, 3, "complete");
  CHECK_FALSE(std::filesystem::exists(report + "/report.html"));
}
