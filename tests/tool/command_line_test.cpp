// Exit codes and messages of commands that do not render.
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "itn/device.h"
#include "tests/support/temporary_folder.h"
#include "tests/tool/process.h"

namespace {}

TEST_CASE("a missing or unknown sub-command is a usage error that names those there are") {
  for (const auto& arguments : std::vector<std::vector<std::string>>{{}, {"rendr"}, {"--foo"}}) {
    const Result result = run_itn(arguments);
    CHECK(result.exit_code == 2);
    CHECK_THAT(result.error, Catch::Contains("devices") && Catch::Contains("render") && Catch::Contains("parameters"));
    CHECK(result.output.empty());
  }
}

TEST_CASE("--help and --version succeed on standard output") {
  for (const auto& arguments :
       std::vector<std::vector<std::string>>{{"--help"}, {"--version"}, {"devices", "--help"}, {"render", "--help"}}) {
    const Result result = run_itn(arguments);
    CHECK(result.exit_code == 0);
    CHECK(!result.output.empty());
    CHECK(result.error.empty());
  }
  CHECK_THAT(run_itn({"--version"}).output, Catch::StartsWith("itn "));
}

TEST_CASE("itn devices lists every device, for people and as JSON") {
  const std::vector<itn::DeviceInfo> devices = itn::list_devices();
  const Result text = run_itn({"devices"});
  CHECK(text.exit_code == 0);
  const Result json = run_itn({"devices", "--json", "-"});
  REQUIRE(json.exit_code == 0);
  const auto parsed = nlohmann::json::parse(json.output);
  CHECK(parsed["schema"] == "itn.devices/1");
  REQUIRE(parsed["devices"].size() == devices.size());
  for (std::size_t i = 0; i < devices.size(); ++i) {
    CHECK_THAT(text.output, Catch::Contains(devices[i].name) && Catch::Contains(devices[i].platform));
    CHECK(parsed["devices"][i]["name"] == devices[i].name);
    CHECK(parsed["devices"][i]["usable"] == devices[i].unusable.empty());
  }
}

TEST_CASE("itn parameters lists names, values and ranges, for people and as JSON") {
  const Result text = run_itn({"parameters", ball, "-D", "sigma_t=25"});
  CHECK(text.exit_code == 0);
  CHECK_THAT(text.output, Catch::Contains("skin.sigma_t") && Catch::Contains("25") && Catch::Contains("[0, inf)"));
  const Result json = run_itn({"parameters", ball, "-D", "sigma_t=25", "--json", "-"});
  REQUIRE(json.exit_code == 0);
  const auto first = nlohmann::json::parse(json.output)["parameters"][0];
  CHECK(first["name"] == "skin.sigma_t");
  CHECK(first["value"] == 25);
  CHECK(first["low"] == 0);
  CHECK(first["high"].is_null());
  CHECK(first["differentiable"].is_boolean());
}

TEST_CASE("--quiet prints nothing") {
  const Result result = run_itn({"parameters", ball, "--quiet"});
  CHECK(result.exit_code == 0);
  CHECK(result.output.empty());
  CHECK(result.error.empty());
}

TEST_CASE("definitions without a value or without use are usage errors") {
  const Result no_value = run_itn({"parameters", ball, "-D", "sigma_t"});
  CHECK(no_value.exit_code == 2);
  CHECK_THAT(no_value.error, Catch::Contains("-D sigma_t") && Catch::Contains("name=value"));
  const Result unused = run_itn({"parameters", ball, "-D", "sigma=3"});
  CHECK(unused.exit_code == 2);
  CHECK_THAT(unused.error, Catch::Contains("sigma"));
}

TEST_CASE("a missing or wrong scene is an input error that says where") {
  CHECK(run_itn({"parameters", "missing.xml"}).exit_code == 3);
  const Result negative = run_itn({"parameters", ball, "-D", "sigma_t=-1"});
  CHECK(negative.exit_code == 3);
  CHECK_THAT(negative.error, Catch::Contains("ball.xml:31:") && Catch::Contains("sigma_t"));
}

TEST_CASE("JSON that cannot be written is a result error") {
  const TemporaryFolder folder;
  CHECK(run_itn({"devices", "--json", folder / "missing/a.json"}).exit_code == 1);
  CHECK(run_itn({"devices", "--json", "/dev/full"}).exit_code == 1);
  CHECK(run_itn({"devices", "--json", "-"}, {.output_file = "/dev/full"}).exit_code == 1);
  CHECK(run_itn({"devices"}, {.output_file = "/dev/full"}).exit_code == 1);
}
