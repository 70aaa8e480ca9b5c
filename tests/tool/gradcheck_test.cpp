// itn gradcheck as a user meets it: right derivatives pass, a wrong one is found.
#include <signal.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>

#include "itn/file.h"
#include "tests/support/temporary_folder.h"
#include "tests/tool/process.h"

namespace {

std::vector<std::string> gradcheck(const std::vector<std::string>& more) {
  std::vector<std::string> arguments{"gradcheck", ball};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

const std::vector<std::string> two{"--parameter", "haze.g", "--parameter", "skin.albedo.B",
                                   "--spp",       "128",    "--json",      "-"};

}  // namespace

TEST_CASE("itn gradcheck passes the derivatives of a scene and says what it compared") {
  const Result result = run_itn(gradcheck(two));
  INFO(result.output << result.error);
  REQUIRE(result.exit_code == 0);
  const auto json = nlohmann::json::parse(result.output);
  CHECK(json["schema"] == "itn.gradcheck/1");
  CHECK(json["passed"] == true);
  CHECK(json["spp"] == 128);
  CHECK(json["parameters"].size() == 2);
  CHECK(json["not_differentiable"].empty());
  for (const char* name : {"haze.g", "skin.albedo.B"}) {
    const auto& p = json["parameters"][name];
    CHECK(p["passed"] == true);
    for (const char* key : {"derivative", "derivative_stderr", "difference", "difference_stderr", "stderr", "z"})
      CHECK(p[key].size() == 3);
  }
  // A path's weight is a polynomial of the albedo: paths of the same random numbers differ by nothing else.
  const auto& albedo = json["parameters"]["skin.albedo.B"];
  CHECK(albedo["value"] == 0.7);
  CHECK(albedo["derivative"][2].get<double>() > 0);
  CHECK(albedo["difference"][2].get<double>() == Approx(albedo["derivative"][2].get<double>()).epsilon(0.01));
  CHECK(albedo["derivative"][0] == 0);
}

TEST_CASE("itn gradcheck checks a colour by its channels that can move, and lists one that is 0") {
  const Result result =
      run_itn(gradcheck({"-D", "green=0", "--parameter", "skin.albedo", "--spp", "64", "--json", "-"}));
  INFO(result.output << result.error);
  REQUIRE(result.exit_code == 0);
  const auto json = nlohmann::json::parse(result.output);
  CHECK((json["parameters"].size() == 2 && json["parameters"].contains("skin.albedo.B")));
  CHECK(json["not_differentiable"].contains("skin.albedo.G"));
  const Result alone = run_itn(gradcheck({"-D", "green=0", "--parameter", "skin.albedo.G"}));
  CHECK(alone.exit_code == 2);
  CHECK_THAT(alone.error, Catch::Contains("skin.albedo.G cannot be differentiated by"));
}

TEST_CASE("without --parameter itn gradcheck takes all, and lists what is not differentiable") {
  const Result result = run_itn({"gradcheck", ITN_SOURCE_DIR "/scenes/test/sphere_dielectric.xml", "--spp", "64"});
  INFO(result.output << result.error);
  REQUIRE(result.exit_code == 0);
  for (const char* name : {"medium.sigma_t", "medium.albedo", "medium.scale", "hg0.g", "constant0.radiance"})
    CHECK_THAT(result.output, Catch::Contains(name));
  CHECK_THAT(result.output, Catch::Contains("dielectric0.int_ior") && Catch::Contains("not differentiable: "));
}

TEST_CASE("itn gradcheck finds a derivative that is wrong, with exit code 1 and its name") {
  // The same kernels but for one line: the score of the phase function's g has the wrong sign.
  const TemporaryFolder folder;
  std::string text = itn::read_file(ITN_SOURCE_DIR "/kernels/scattering/phase_score.h");
  const std::string right = "score_##name(phase->n, cosine, d);";
  REQUIRE(text.find(right) != std::string::npos);
  text.insert(text.find(right) + right.size(), " d[0] = -3.0f * d[0];");
  std::filesystem::create_directories(folder / "scattering");
  itn::write_file(folder / "scattering/phase_score.h", text);
  const Result result = run_itn(gradcheck(two), {.environment = {{"ITN_KERNEL_DIR", folder.path().string()}}});
  INFO(result.output);
  CHECK(result.exit_code == 1);
  CHECK_THAT(result.error, Catch::Contains("haze.g") && !Catch::Contains("skin.albedo.B"));
  const auto json = nlohmann::json::parse(result.output);
  CHECK(json["passed"] == false);
  CHECK(json["parameters"]["haze.g"]["passed"] == false);
  CHECK(json["parameters"]["skin.albedo.B"]["passed"] == true);
}

TEST_CASE("itn gradcheck: parameters that are unknown, not differentiable or named twice are usage errors") {
  const std::vector<std::pair<std::vector<std::string>, std::string>> wrong{
      {{"--parameter", "skin.colour"}, "need one of: skin.sigma_t"},
      {{"--parameter", "skin.sigma_t", "-D", "sigma_t=0"}, "cannot be differentiated by"},
      {{"--parameter", "haze.g", "--parameter", "haze.g"}, "named twice"},
      {{"--sensor", "1"}, "--sensor 1"}};
  for (const auto& [options, message] : wrong) {
    const Result result = run_itn(gradcheck(options));
    INFO(result.error);
    CHECK(result.exit_code == 2);
    CHECK_THAT(result.error, Catch::Contains(message));
  }
  CHECK(run_itn({"gradcheck", "no_such_scene.xml"}).exit_code == 3);
}

TEST_CASE("Ctrl-C ends itn gradcheck within a second with exit code 130", "[alone]") {
  REQUIRE(run_itn(gradcheck({"--spp", "2"})).error.empty());  // from here on the device's compiler has nothing to do
  Process process(gradcheck({"--spp", "10000000"}), {});
  wait_until([&] { return process.cpu_seconds() > 2; });  // it renders
  const auto start = std::chrono::steady_clock::now();
  process.send(SIGINT);
  const Result result = process.wait();
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
  CHECK(result.exit_code == 130);
  CHECK(taken.count() < 1);
}
