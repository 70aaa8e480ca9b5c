// itn invert as a user meets it.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "runtime/image/exr.h"
#include "runtime/image/file.h"
#include "tests/support/temporary_folder.h"
#include "tests/tool/process.h"

namespace {

const std::string ball = ITN_SOURCE_DIR "/tests/tool/data/ball.xml";

// The ball with another albedo, as a target.
std::string target_in(const TemporaryFolder& folder) {
  const Result result = run_itn(
      {"render", ball, "-D", "green=0.6", "--spp", "64", "--seed", "3", "--quiet", "-o", folder / "target.exr"});
  INFO(result.error);
  REQUIRE(result.exit_code == 0);
  return folder / "target.exr";
}

std::vector<std::string> invert(const TemporaryFolder& folder, const std::vector<std::string>& more = {}) {
  std::vector<std::string> arguments{"invert", ball, "--target", folder / "target.exr", "--parameter", "skin.albedo.G",
                                     "--spp",  "64", "-o",       folder / "fit"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

}  // namespace

TEST_CASE("itn invert finds an albedo, says how well, and leaves pictures and a report") {
  const TemporaryFolder folder;
  target_in(folder);
  const Result result = run_itn(invert(folder, {"--json", "-"}));
  INFO(result.error);
  REQUIRE(result.exit_code == 0);
  const auto json = nlohmann::json::parse(result.output);
  CHECK(json["schema"] == "itn.invert/1");
  CHECK(json["converged"] == true);
  const auto& albedo = json["parameters"]["skin.albedo.G"];
  const double value = albedo["value"], low = albedo["low"], high = albedo["high"], error = albedo["stderr"];
  CHECK(low < value);
  CHECK(value < high);
  CHECK(std::fabs(value - 0.6) < 4 * error);
  CHECK(error < 0.05);
  CHECK(json["ambiguity"][0].contains("direction"));
  CHECK(json["ambiguity"][0].contains("relative_uncertainty"));
  CHECK(json["loss"].is_number());
  CHECK(json["time"].is_object());
  CHECK(json == nlohmann::json::parse(itn::read_file(folder / "fit/result.json")));
  for (const char* name : {"target.png", "rerender.png", "residual.png", "report.html"})
    CHECK(std::filesystem::file_size(folder / ("fit/" + std::string(name))) > 100);
  CHECK(itn::read_exr(folder / "fit/rerender.exr").channel("residual.G") >= 0);
  const std::string lines = itn::read_file(folder / "fit/iterations.jsonl");
  CHECK(std::count(lines.begin(), lines.end(), '\n') == json["iterations"].get<int>());
}

TEST_CASE("itn invert goes on with what the folder holds, and only with the same question") {
  const TemporaryFolder folder;
  target_in(folder);
  const Result first = run_itn(invert(folder));
  INFO(first.error);
  REQUIRE(first.exit_code == 0);
  const std::string state = itn::read_file(folder / "fit/state.json");
  CHECK(run_itn(invert(folder)).exit_code == 0);
  CHECK(itn::read_file(folder / "fit/state.json") == state);
  const Result other = run_itn(invert(folder, {"--seed", "4"}));
  CHECK(other.exit_code == 2);
  CHECK(other.error.find("another seed") != std::string::npos);
  itn::write_file(folder / "fit/state.json", "{");
  const Result broken = run_itn(invert(folder));
  CHECK(broken.exit_code == 3);
  CHECK(broken.error.find("state.json") != std::string::npos);
}

TEST_CASE("itn invert says that it has not converged") {
  const TemporaryFolder folder;
  target_in(folder);
  const Result result = run_itn(invert(folder, {"--start", "skin.albedo.G=0.05", "--iterations", "1"}));
  CHECK(result.exit_code == 1);
  CHECK(result.output.find("NOT converged") != std::string::npos);
  CHECK(std::filesystem::exists(folder / "fit/report.html"));
}

TEST_CASE("itn invert refuses starts that make no sense") {
  const TemporaryFolder folder;
  target_in(folder);
  const auto error_of = [&](const std::vector<std::string>& more, int code) {
    const Result result = run_itn(invert(folder, more));
    CHECK(result.exit_code == code);
    CHECK_FALSE(std::filesystem::exists(folder / "fit/report.html"));
    return result.error;
  };
  CHECK(error_of({"--start", "skin.albedo.G=1.5"}, 2).find("[0, 1]") != std::string::npos);
  CHECK(error_of({"--start", "skin.albedo.G=x"}, 2).find("need a number") != std::string::npos);
  CHECK(error_of({"--start", "skin.sigma_t=3"}, 2).find("--parameter") != std::string::npos);
  CHECK(error_of({"--parameter", "skin.nothing"}, 2).find("none of that name") != std::string::npos);
}
