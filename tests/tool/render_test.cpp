// itn render as a user meets it: what it writes, and how it fails.
#include <signal.h>
#include <sys/stat.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>

#include "itn/device.h"
#include "itn/exr.h"
#include "itn/file.h"
#include "tests/support/temporary_folder.h"
#include "tests/tool/process.h"

namespace {

std::vector<std::string> render(const std::string& output, const std::vector<std::string>& more = {}) {
  std::vector<std::string> arguments{"render", ball, "-o", output};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

}  // namespace

TEST_CASE("itn render writes image, standard error and what they were made from") {
  const TemporaryFolder folder;
  const Result result = run_itn(render(folder / "a.exr", {"--seed", "7", "-D", "sigma_t=25", "--preview"}));
  INFO(result.error);
  REQUIRE(result.exit_code == 0);
  CHECK_THAT(result.output, Catch::Contains("a.exr") && Catch::Contains("32 x 24") && Catch::Contains("mean"));
  CHECK(result.error.empty());  // no progress where there is no terminal
  const itn::ExrImage image = itn::read_exr(folder / "a.exr");
  CHECK(image.width == 32);
  CHECK(image.height == 24);
  for (const char* name : {"R", "G", "B", "stderr.R", "stderr.G", "stderr.B"}) CHECK(image.channel(name) >= 0);
  CHECK(image.header.at("spp") == "16");
  CHECK(image.header.at("seed") == "7");
  CHECK(image.header.at("operator") == "full");
  CHECK(image.header.at("scene") == ball);
  CHECK(nlohmann::json::parse(image.header.at("parameters"))["skin.sigma_t"] == 25);
  CHECK_THAT(image.header.at("version"), Catch::StartsWith("itn "));
  CHECK(image.header.at("software") == image.header.at("version"));
  CHECK(!image.header.at("device").empty());
  CHECK(itn::read_file(folder / "a.png").substr(1, 3) == "PNG");
  CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 2);
}

TEST_CASE("--size replaces the film's size") {
  const TemporaryFolder folder;
  const Result result = run_itn(render(folder / "a.exr", {"--size", "8x6"}));
  INFO(result.error);
  REQUIRE(result.exit_code == 0);
  const itn::ExrImage image = itn::read_exr(folder / "a.exr");
  CHECK(image.width == 8);
  CHECK(image.height == 6);
  for (const std::string size : {"8", "x6", "8x", "0x6", "8x6x1", "8x99999", "-8x6"}) {
    const Result refused = run_itn(render(folder / "b.exr", {"--size=" + size}));
    CHECK(refused.exit_code == 2);
    CHECK_THAT(refused.error, Catch::Contains("--size " + size + ": need WIDTHxHEIGHT"));
  }
}

TEST_CASE("--derivative: channels in the EXR, means in the JSON, and with --preview a picture each") {
  const TemporaryFolder folder;
  const Result result =
      run_itn(render(folder / "a.exr", {"--derivative", "skin.sigma_t", "--derivative", "haze.g", "--preview"}));
  INFO(result.error);
  REQUIRE(result.exit_code == 0);
  CHECK_THAT(result.output, Catch::Contains("derivative by skin.sigma_t: mean"));
  CHECK_THAT(result.output, Catch::Contains("a.haze.g.png: blue -"));  // the scale of the colours
  const itn::ExrImage image = itn::read_exr(folder / "a.exr");
  CHECK(image.channels.size() == 18);
  for (const std::string parameter : {"skin.sigma_t", "haze.g"})
    for (const std::string channel : {".R", ".G", ".B"}) {
      CHECK(image.channel("derivative." + parameter + channel) >= 0);
      CHECK(image.channel("derivative_stderr." + parameter + channel) >= 0);
    }
  for (const char* name : {"a.png", "a.skin.sigma_t.png", "a.haze.g.png"})
    CHECK(itn::read_file(folder / name).substr(1, 3) == "PNG");
  CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 4);

  const Result json_result =
      run_itn(render(folder / "b.exr", {"--derivative", "skin.sigma_t", "--derivative", "haze.g", "--json", "-"}));
  REQUIRE(json_result.exit_code == 0);
  const auto json = nlohmann::json::parse(json_result.output);
  CHECK(json["derivatives"].size() == 2);
  for (const char* parameter : {"skin.sigma_t", "haze.g"})
    for (std::size_t c = 0; c < 3; ++c) {
      INFO(parameter << " " << c);
      double sum = 0;
      const auto channel =
          static_cast<std::size_t>(image.channel(std::string("derivative.") + parameter + "." + "RGB"[c]));
      for (std::size_t i = channel; i < image.data.size(); i += image.channels.size())
        sum += static_cast<double>(image.data[i]);
      const double error = json["derivatives"][parameter]["stderr"][c].get<double>();
      CHECK(error > 0);
      CHECK(json["derivatives"][parameter]["mean"][c].get<double>() == Approx(sum / (32 * 24)).margin(1e-3 * error));
    }
}

TEST_CASE("--derivative by what cannot be, or is named twice, is a usage error and writes nothing") {
  const TemporaryFolder folder;
  const std::vector<std::pair<std::vector<std::string>, std::string>> wrong{
      {{"--derivative", "skin.colour"}, "need one of: skin.sigma_t"},
      {{"--derivative", "skin.sigma_t", "-D", "sigma_t=0"}, "cannot be differentiated by"},
      {{"--derivative", "haze.g", "--derivative", "haze.g"}, "named twice"}};
  for (const auto& [options, message] : wrong) {
    const Result result = run_itn(render(folder / "a.exr", options));
    INFO(result.error);
    CHECK(result.exit_code == 2);
    CHECK_THAT(result.error, Catch::Contains(message));
  }
  CHECK(folder.empty());
}

TEST_CASE("--json - gives the result and nothing else on standard output") {
  const TemporaryFolder folder;
  const Result result = run_itn(render(folder / "a.exr", {"--json", "-", "--spp", "4", "--operator", "single"}));
  REQUIRE(result.exit_code == 0);
  const auto json = nlohmann::json::parse(result.output);
  CHECK(json["schema"] == "itn.render/1");
  CHECK(json["scene"] == ball);
  CHECK(json["operator"] == "single");
  CHECK(json["width"] == 32);
  CHECK(json["height"] == 24);
  CHECK(json["spp"] == 4);
  CHECK(json["seed"] == 0);
  CHECK(json["device"].contains("platform"));
  for (const char* time : {"scene_s", "build_s", "render_s", "write_s"}) CHECK(json["time"][time] >= 0);
  CHECK(json["paths"] == 32 * 24 * 4);
  CHECK(json["misplaced"] == 0);
  CHECK(json["paths_per_s"] > 0);
  CHECK(json["mean"].size() == 3);
  CHECK(json["mean_stderr"].size() == 3);
  CHECK(json["derivatives"].is_object());
}

TEST_CASE("the file has the same bits whatever the number of threads") {
  const TemporaryFolder folder;
  std::string files[2];
  for (const int threads : {1, 2}) {
    const std::string name = folder / (std::to_string(threads) + ".exr");
    const Result result = run_itn(render(name), {.environment = {{"POCL_MAX_PTHREAD_COUNT", std::to_string(threads)}}});
    INFO(result.error);
    REQUIRE(result.exit_code == 0);
    files[threads - 1] = itn::read_file(name);
  }
  CHECK(files[0] == files[1]);
}

TEST_CASE("too little device memory: fewer paths at a time and the same bits, or exit 4 with what is missing") {
  const TemporaryFolder folder;
  REQUIRE(run_itn(render(folder / "roomy.exr")).exit_code == 0);
  const Result tight = run_itn(render(folder / "tight.exr"), {.environment = {{"ITN_MEMORY_LIMIT", "10"}}});
  INFO(tight.error);
  REQUIRE(tight.exit_code == 0);
  CHECK(itn::read_file(folder / "roomy.exr") == itn::read_file(folder / "tight.exr"));
  const std::string large = ITN_SOURCE_DIR "/scenes/gallery/jade_knot.xml";  // some MiB of geometry
  const Result failed =
      run_itn({"render", large, "-o", folder / "none.exr"}, {.environment = {{"ITN_MEMORY_LIMIT", "1"}}});
  CHECK(failed.exit_code == 4);
  CHECK_THAT(failed.error, Catch::Contains("no room for") && Catch::Contains("of 1024 KiB are free"));
  CHECK(!std::filesystem::exists(folder / "none.exr"));
  CHECK(run_itn(render(folder / "none.exr"), {.environment = {{"ITN_MEMORY_LIMIT", "lots"}}}).exit_code == 2);
}

TEST_CASE("paths inside a shape whose medium the camera does not name are counted and warned about") {
  const TemporaryFolder folder;
  std::string scene = itn::read_file(ball);
  const std::string outside = "origin=\"0, 0, 5\" target=\"0, 0, 0\"";
  REQUIRE(scene.find(outside) != std::string::npos);
  scene.replace(scene.find(outside), outside.size(), "origin=\"0, 0, 0\" target=\"0, 0, 1\"");
  std::ofstream(folder / "inside.xml") << scene;
  const Result result = run_itn({"render", folder / "inside.xml", "-o", folder / "a.exr", "--json", "-"});
  REQUIRE(result.exit_code == 0);
  const auto json = nlohmann::json::parse(result.output);
  CHECK(json["misplaced"] == json["paths"]);  // each path once: it is on its logical side from then on
  CHECK_THAT(result.error, Catch::Contains("warning") && Catch::Contains("from the side where they cannot be"));
}

TEST_CASE("the JSON's mean is the mean of the file's pixels") {
  const TemporaryFolder folder;
  const Result result = run_itn(render(folder / "a.exr", {"--json", "-"}));
  REQUIRE(result.exit_code == 0);
  const auto json = nlohmann::json::parse(result.output);
  const itn::ExrImage image = itn::read_exr(folder / "a.exr");
  const char* names[] = {"R", "G", "B"};
  for (std::size_t c = 0; c < 3; ++c) {
    double sum = 0;
    const auto channel = static_cast<std::size_t>(image.channel(names[c]));
    for (std::size_t i = channel; i < image.data.size(); i += image.channels.size())
      sum += static_cast<double>(image.data[i]);
    CHECK(json["mean"][c].get<double>() == Approx(sum / (32 * 24)).epsilon(1e-5));
  }
}

TEST_CASE("the same command gives the same file, another seed another") {
  const TemporaryFolder folder;
  for (const char* name : {"a.exr", "b.exr"}) REQUIRE(run_itn(render(folder / name)).exit_code == 0);
  REQUIRE(run_itn(render(folder / "c.exr", {"--seed", "1"})).exit_code == 0);
  CHECK(itn::read_file(folder / "a.exr") == itn::read_file(folder / "b.exr"));
  CHECK(itn::read_file(folder / "a.exr") != itn::read_file(folder / "c.exr"));
}

TEST_CASE("wrong options are usage errors and name the option") {
  const TemporaryFolder folder;
  const std::vector<std::vector<std::string>> wrong{{"--spp", "0"},         {"--spp", "-1"},     {"--spp", "many"},
                                                    {"--operator", "half"}, {"--sensor", "3"},   {"--seed", "-1"},
                                                    {"--seed", "x"},        {"-D", "no_equals"}, {"--unknown", "1"}};
  for (const auto& options : wrong) {
    const Result result = run_itn(render(folder / "a.exr", options));
    INFO(options[0] << " " << options[1] << ": " << result.error);
    CHECK(result.exit_code == 2);
    CHECK_THAT(result.error, Catch::Contains(options[0]));
  }
  CHECK(run_itn({"render", ball}).exit_code == 2);
  CHECK(run_itn({"render", "-o", folder / "a.exr"}).exit_code == 2);
  const Result picture = run_itn(render(folder / "a.png"));
  CHECK(picture.exit_code == 2);
  CHECK_THAT(picture.error, Catch::Contains("--preview"));
  CHECK(folder.empty());
}

TEST_CASE("--derivative by a smooth index, a texture or an albedo of 0 is a usage error that says why") {
  const TemporaryFolder folder;
  const std::string scene = itn::read_file(ball);
  const auto replaced = [&](std::string text, const std::string& from, const std::string& to) {
    REQUIRE(text.find(from) != std::string::npos);
    return text.replace(text.find(from), from.size(), to);
  };
  std::ofstream(folder / "smooth.xml") << replaced(replaced(scene, "<float name=\"alpha\" value=\"0.2\"/>", ""),
                                                   "roughdielectric", "dielectric");
  std::ofstream(folder / "black.xml") << replaced(scene, "$green", "0");
  const std::string textured = ITN_SOURCE_DIR "/scenes/test/mitsuba/sunsky_null_floor.xml";
  struct Wrong {
    std::string scene, parameter, message;
  };
  const std::vector<Wrong> wrong{{folder / "smooth.xml", "glass.int_ior", "roughdielectric"},
                                 {folder / "black.xml", "skin.albedo.G", "start from a small value"},
                                 {textured, "diffuse0.reflectance", "a texture, not a number"}};
  for (const auto& [file, parameter, message] : wrong) {
    const Result result =
        run_itn({"render", file, "-o", folder / "a.exr", "--spp", "1", "--derivative", parameter, "--quiet"});
    INFO(parameter << ": " << result.error);
    CHECK(result.exit_code == 2);
    CHECK_THAT(result.error, Catch::Contains(parameter) && Catch::Contains(message));
    CHECK(!std::filesystem::exists(folder / "a.exr"));
  }
  // A component that is not 0 beside a 0 stays differentiable.
  const Result beside =
      run_itn({"render", folder / "black.xml", "-o", folder / "a.exr", "--spp", "1", "--derivative", "skin.albedo.R"});
  INFO(beside.error);
  CHECK(beside.exit_code == 0);
}

TEST_CASE("an unknown device is a device failure that names those there are") {
  const TemporaryFolder folder;
  const std::string name = itn::list_devices().at(0).name;
  const Result option = run_itn(render(folder / "a.exr", {"--device", "no such device"}));
  CHECK(option.exit_code == 4);
  CHECK_THAT(option.error, Catch::Contains("device no such device") && Catch::Contains(name));
  const Result variable = run_itn(render(folder / "a.exr"), {.environment = {{"ITN_DEVICE", "no such device"}}});
  CHECK(variable.exit_code == 4);
  CHECK_THAT(variable.error, Catch::Contains("ITN_DEVICE no such device") && Catch::Contains(name));
  CHECK(folder.empty());
}

TEST_CASE("without any OpenCL driver the remedy is named") {
  const TemporaryFolder folder;
  for (const auto& arguments : {render(folder / "a.exr"), std::vector<std::string>{"devices"}}) {
    const Result result = run_itn(arguments, {.environment = {{"OCL_ICD_VENDORS", folder.path().string()}}});
    CHECK(result.exit_code == 4);
    CHECK_THAT(result.error, Catch::Contains("pocl-opencl-icd"));
  }
}

TEST_CASE("a kernel that does not build is a device failure with the compiler's log") {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "shared");
  itn::write_file(folder / "shared/portable.h", "int broken_on_purpose = undeclared_name;\n");
  const Result result =
      run_itn(render(folder / "a.exr"), {.environment = {{"ITN_KERNEL_DIR", folder.path().string()}}});
  CHECK(result.exit_code == 4);
  CHECK_THAT(result.error, Catch::Contains("undeclared_name") && Catch::Contains("kernels/shared/portable.h:1"));
  CHECK(!std::filesystem::exists(folder / "a.exr"));
}

TEST_CASE("an output folder that is missing or read-only is refused before rendering") {
  const TemporaryFolder folder;
  const Result missing = run_itn(render(folder / "missing/a.exr", {"--spp", "1000000000"}));
  CHECK(missing.exit_code == 1);
  CHECK_THAT(missing.error, Catch::Contains("missing/a.exr") && Catch::Contains("create the folder"));
  std::filesystem::copy_file(ball, folder / "ball.xml");
  REQUIRE(chmod(folder.path().c_str(), 0555) == 0);
  const Result read_only =
      run_itn({"render", folder / "ball.xml", "-o", folder / "a.exr", "--spp", "1000000000"}, {.ordinary_user = true});
  CHECK(read_only.exit_code == 1);
  CHECK_THAT(read_only.error, Catch::Contains("choose a folder you may write to"));
  const Result json = run_itn(render(folder / "a.exr", {"--json", folder / "missing/a.json", "--spp", "1000000000"}));
  CHECK(json.exit_code == 1);
}

TEST_CASE("a full disk is a result error") {
  const Result result = run_itn(render("/dev/full"));
  CHECK(result.exit_code == 1);
  CHECK_THAT(result.error, Catch::Contains("No space left"));
}

TEST_CASE("Ctrl-C and SIGTERM end within a second, without a file, with exit code 130", "[alone]") {
  const TemporaryFolder folder;
  REQUIRE(run_itn(render("/dev/null")).exit_code == 0);  // from here on the device's compiler has nothing to do
  for (const int signal_number : {SIGINT, SIGTERM})
    for (const bool renders : {false, true}) {
      Process process(render(folder / "a.exr", {"--spp", "100000000"}), {});
      wait_until([&] { return process.handles(signal_number) && (!renders || process.cpu_seconds() > 2); });
      const auto start = std::chrono::steady_clock::now();
      process.send(signal_number);
      const Result result = process.wait();
      const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
      INFO("signal " << signal_number << " while " << (renders ? "rendering: " : "starting: ") << result.error);
      CHECK(result.exit_code == 130);
      CHECK(taken.count() < 1);
      CHECK_THAT(result.error, Catch::Contains("interrupted"));
      CHECK(folder.empty());
    }
}

TEST_CASE("a scene without light renders black and warns") {
  const TemporaryFolder folder;
  std::string text = itn::read_file(ball);
  const auto from = text.find("<emitter"), to = text.find("</emitter>") + 10;
  itn::write_file(folder / "dark.xml", text.erase(from, to - from));
  const Result result = run_itn({"render", folder / "dark.xml", "-o", folder / "a.exr", "--json", "-"});
  REQUIRE(result.exit_code == 0);
  CHECK_THAT(result.error, Catch::Contains("warning") && Catch::Contains("emitter"));
  const auto json = nlohmann::json::parse(result.output);
  for (const auto& mean : json["mean"]) CHECK(mean == 0);
}
