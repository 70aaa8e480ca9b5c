// itn invert as a user meets it.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "itn/exr.h"
#include "itn/file.h"
#include "itn/network_file.h"
#include "tests/support/temporary_folder.h"
#include "tests/tool/process.h"

namespace {

// The ball with another albedo, as a target.
std::string target_in(const TemporaryFolder& folder) {
  const Result result = run_itn(
      {"render", ball, "-D", "green=0.6", "--spp", "64", "--seed", "3", "--quiet", "-o", folder / "target.exr"});
  INFO(result.error);
  REQUIRE(result.exit_code == 0);
  return folder / "target.exr";
}

// With no method: posterior, or gauss-newton where a start is given.
std::vector<std::string> invert_by_itself(const TemporaryFolder& folder, const std::vector<std::string>& more = {}) {
  std::vector<std::string> arguments{"invert", ball, "--target", folder / "target.exr", "--parameter", "skin.albedo.G",
                                     "--spp",  "64", "-o",       folder / "fit"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

std::vector<std::string> invert(const TemporaryFolder& folder, std::vector<std::string> more = {}) {
  if (std::find(more.begin(), more.end(), "--method") == more.end())
    more.insert(more.end(), {"--method", "gauss-newton"});
  return invert_by_itself(folder, more);
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
    CHECK(std::filesystem::file_size(folder / ("fit/" + std::string(name))) > 60);
  CHECK(itn::read_exr(folder / "fit/rerender.exr").channel("residual.G") >= 0);
  const std::string lines = itn::read_file(folder / "fit/iterations.jsonl");
  int iterations = 0;
  for (const auto& start : json["starts"]) iterations += start["iterations"].get<int>();
  CHECK(std::count(lines.begin(), lines.end(), '\n') == iterations);
  // Other starts have checked it, and what is left of the photo is noise.
  CHECK(json["starts"].size() >= 4);
  CHECK(json["fit"]["fits"] == true);
  CHECK(json["fit"]["chi_square"].get<double>() == Approx(1).margin(0.3));
  CHECK(json["fit"]["chance"].get<double>() > 0.01);
}

TEST_CASE("itn invert says that a photo of another scene does not fit, with every method") {
  const TemporaryFolder folder;
  // of a ball that is much clearer than the inversion believes
  const Result photo = run_itn({"render", ball, "-D", "green=0.6", "-D", "sigma_t=2", "--spp", "64", "--seed", "3",
                                "--quiet", "-o", folder / "target.exr"});
  INFO(photo.error);
  REQUIRE(photo.exit_code == 0);
  const auto check_marks = [](const nlohmann::json& json) {
    CHECK(json["fit"]["fits"] == false);
    CHECK(json["converged"] == false);
    CHECK(json["misfit"]["words"].is_string());
    for (const char* kind : {"parameters", "coefficients"})
      for (const auto& interval : json[kind]) CHECK(interval["holds"] == false);
  };
  // The second call finds that it has ended, and says the same.
  for (int call = 0; call < 2; ++call) {
    const Result newton = run_itn(invert(folder, {"--json", folder / "newton.json"}));
    INFO(newton.error);
    CHECK(newton.exit_code == 1);
    CHECK_THAT(newton.error, Catch::Contains("not converged: the image found does not fit") &&
                                 Catch::Contains("the intervals do not hold"));
    CHECK(newton.output.find("NOT a fit") != std::string::npos);
    CHECK(newton.output.find(" (does not hold)\n") != std::string::npos);
    const std::string last = newton.output.substr(newton.output.rfind('\n', newton.output.size() - 2) + 1);
    CHECK(last.starts_with("NOT converged: the image found does not fit"));
    check_marks(nlohmann::json::parse(itn::read_file(folder / "newton.json")));
    check_marks(nlohmann::json::parse(itn::read_file(folder / "fit/result.json")));
    CHECK(itn::read_file(folder / "fit/report.html").find(" (does not hold)</td>") != std::string::npos);
  }
  const Result posterior =
      run_itn({"invert", ball, "--target", folder / "target.exr", "--parameter", "skin.albedo.G", "--method",
               "posterior", "--spp", "64", "--iterations", "2", "-o", folder / "posterior", "--json", "-"});
  INFO(posterior.error);
  CHECK(posterior.exit_code == 1);
  check_marks(nlohmann::json::parse(posterior.output));
  const std::string samples = itn::read_file(folder / "posterior/samples.csv");
  CHECK(samples.rfind("skin.albedo.G,log_density,peak,holds\n", 0) == 0);
  CHECK(samples.substr(samples.size() - 3) == ",0\n");
  const Result adam =
      run_itn({"invert", ball, "--target", folder / "target.exr", "--parameter", "skin.albedo.G", "--method", "adam",
               "--spp", "8", "--iterations", "10", "-o", folder / "adam", "--json", "-"});
  CHECK(adam.exit_code == 1);
  check_marks(nlohmann::json::parse(adam.output));
}

TEST_CASE("itn invert says what a misfit looks like: a camera that stood beside, a larger ball, noise that is none") {
  const TemporaryFolder folder;
  const std::string as_it_is = itn::read_file(ball);
  const auto photo_of = [&](const std::string& what, const std::string& instead) {
    std::string other = as_it_is;
    REQUIRE(other.find(what) != std::string::npos);
    itn::write_file(folder / "other.xml", other.replace(other.find(what), what.size(), instead));
    const Result photo = run_itn({"render", folder / "other.xml", "-D", "green=0.6", "--spp", "256", "--seed", "3",
                                  "--quiet", "-o", folder / "target.exr"});
    INFO(photo.error);
    REQUIRE(photo.exit_code == 0);
  };
  const auto misfit = [&](const std::vector<std::string>& more = {}) {
    std::filesystem::remove_all(folder / "fit");
    std::vector<std::string> with{"--starts", "1", "--json", "-"};
    with.insert(with.end(), more.begin(), more.end());
    const Result result = run_itn(invert(folder, with));
    CHECK(result.exit_code == 1);
    return nlohmann::json::parse(result.output)["misfit"];
  };
  // A pixel is 0.084 wide where the ball is.
  photo_of(R"(origin="0, 0, 5" target="0, 0, 0")", R"(origin="0.04, 0, 5" target="0.04, 0, 0")");
  const auto beside = misfit();
  CAPTURE(beside.dump());
  CHECK(beside["looks_like"] == "shift");
  CHECK(beside["x"].get<double>() == Approx(-0.48).margin(0.13));
  CHECK(std::fabs(beside["y"].get<double>()) < 0.1);
  const auto loud = misfit({"--noise", "10"});
  CHECK(loud["looks_like"] == "noise_too_large");
  photo_of(R"(<shape type="sphere">)", R"(<shape type="sphere"><float name="radius" value="1.04"/>)");
  const auto larger = misfit();
  CAPTURE(larger.dump());
  CHECK(larger["looks_like"] == "size");
  CHECK(larger["change"].get<double>() == Approx(0.04).margin(0.012));
}

TEST_CASE("itn invert of a few numbers is the posterior, and Gauss-Newton where a start or white balance asks for it") {
  const TemporaryFolder folder;
  target_in(folder);
  const auto answer = [&](const std::vector<std::string>& more, int exit_code = 0) {
    std::filesystem::remove_all(folder / "fit");
    std::vector<std::string> with{"--json", "-"};
    with.insert(with.end(), more.begin(), more.end());
    const Result result = run_itn(invert_by_itself(folder, with));
    INFO(result.error);
    REQUIRE(result.exit_code == exit_code);
    return exit_code > 1 ? nlohmann::json() : nlohmann::json::parse(result.output);
  };
  const auto by_itself = answer({});
  CHECK(by_itself["method"] == "posterior");
  CHECK(by_itself["converged"] == true);
  CHECK(by_itself == nlohmann::json::parse(itn::read_file(folder / "fit/result.json")));
  const auto& albedo = by_itself["parameters"]["skin.albedo.G"];
  CHECK(albedo["low"].get<double>() < 0.6);
  CHECK(albedo["high"].get<double>() > 0.6);
  for (const char* name : {"samples.csv", "report.html", "state.json", "renderings"})
    CHECK(std::filesystem::exists(folder / ("fit/" + std::string(name))));
  // The posterior takes a prior and a range, too.
  const auto known = answer({"--prior", "skin.albedo.G=0.55,0.65", "--exposure"});
  CHECK(known["method"] == "posterior");
  CHECK(known["prior"] == nlohmann::json{"skin.albedo.G=0.55,0.65"});
  CHECK(known["exposures"].contains("exposure 0"));

  const auto started = answer({"--start", "skin.albedo.G=0.5", "--starts", "1"});
  CHECK(started["method"] == "gauss-newton");
  // Both say the same of what the image tells well.
  const double error = albedo["stderr"], value = started["parameters"]["skin.albedo.G"]["value"];
  CHECK(std::fabs(albedo["value"].get<double>() - value) < 2 * error);
  CHECK(answer({"--white-balance", "--starts", "1"})["method"] == "gauss-newton");
  answer({"--start", "skin.albedo.G=0.5", "--range", "skin.albedo.G=0.3,0.9"}, 2);
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
  const Result result =
      run_itn(invert(folder, {"--start", "skin.albedo.G=0.05", "--starts", "1", "--iterations", "1"}));
  CHECK(result.exit_code == 1);
  CHECK(result.output.find("NOT converged") != std::string::npos);
  CHECK(std::filesystem::exists(folder / "fit/report.html"));
}

TEST_CASE("itn invert --prior: the result lies between what was known and what the image says, and is known better") {
  const TemporaryFolder folder;
  target_in(folder);
  const auto result = [&](const std::vector<std::string>& more) {
    std::filesystem::remove_all(folder / "fit");
    const Result end = run_itn(invert(folder, more));
    INFO(end.error);
    REQUIRE(end.exit_code == 0);
    return nlohmann::json::parse(itn::read_file(folder / "fit/result.json"));
  };
  const auto alone = result({}), both = result({"--prior", "skin.albedo.G=0.5,0.6"});
  const auto &from_image = alone["parameters"]["skin.albedo.G"], &found = both["parameters"]["skin.albedo.G"];
  CHECK(found["value"].get<double>() > 0.55);
  CHECK(found["value"].get<double>() < from_image["value"].get<double>());
  CHECK(found["stderr"].get<double>() < from_image["stderr"].get<double>());
  CHECK(alone["prior"].empty());
  CHECK(both["prior"] == nlohmann::json{"skin.albedo.G=0.5,0.6"});
  CHECK(run_itn(invert(folder)).exit_code == 2);  // the folder holds another question
}

TEST_CASE("itn invert --init starts from what a network sees in the target; --start goes first") {
  const TemporaryFolder folder;
  std::string xml = itn::read_file(ball);
  xml.replace(xml.find("value=\"24\""), 10, "value=\"32\"");  // the network's images are square
  xml.replace(xml.find("<rgb name=\"albedo\""), 0, "<float name=\"scale\" value=\"4\"/>");
  const std::string scene = folder / "ball.xml";
  itn::write_file(scene, xml);
  REQUIRE(run_itn({"render", scene, "--spp", "16", "--quiet", "-o", folder / "target.exr"}).exit_code == 0);

  // Its weights are 0: whatever it sees, it guesses the middle of each range, of bodies whose longest side is 1.
  itn::NetworkDescription description;
  description.size = 32;
  description.mm_per_unit = 10;
  description.outputs = {{"sigma_t", 1, 4, true}, {"albedo", 0.5, 0.7, false}, {"g", 0.2, 0.6, false}};
  const std::string network = folder / "network.safetensors";
  itn::write_network(network, itn::Network(description), itn::Precision::single);

  const auto invert = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"invert",       scene,   "--target", folder / "target.exr", "-o",
                                       folder / "fit", "--spp", "16",       "--iterations",        "1",
                                       "--init",       network, "--json",   folder / "fit.json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_itn(arguments);
  };
  const Result result = invert({"--parameter", "skin.sigma_t", "--parameter", "skin.albedo.G", "--parameter", "haze.g",
                                "--parameter", "glass.alpha", "--start", "haze.g=0.3", "--start", "glass.alpha=0.25"});
  INFO(result.error);
  REQUIRE(result.exit_code <= 1);  // one iteration need not converge
  const auto from = nlohmann::json::parse(itn::read_file(folder / "fit.json"))["starts"][0]["from"];
  CHECK(from["skin.sigma_t"].get<double>() == Approx(2.0 * 10 / 4 / 2));
  CHECK(from["skin.albedo.G"].get<double>() == Approx(0.6));
  CHECK(from["haze.g"].get<double>() == Approx(0.3));
  CHECK(from["glass.alpha"].get<double>() == Approx(0.25));

  // One that says a distribution hands it over as prior, but of a colour's components, of which it sees the mean alone.
  itn::NetworkDescription sure = description;
  sure.distribution = true;
  sure.spread = {0.2, 0.2, 0.2};
  itn::write_network(network, itn::Network(sure), itn::Precision::single);
  std::filesystem::remove_all(folder / "fit");
  const std::vector<std::string> both{"--parameter", "skin.sigma_t", "--parameter", "skin.albedo.G"};
  REQUIRE(invert(both).exit_code <= 1);
  const auto prior = nlohmann::json::parse(itn::read_file(folder / "fit.json"))["prior"];
  REQUIRE(prior.size() == 2);
  CHECK_THAT(prior[0].get<std::string>(), Catch::Contains("skin.sigma_t=2.1") && Catch::Contains(" (network)"));
  // The user's goes first.
  std::filesystem::remove_all(folder / "fit");
  std::vector<std::string> with_prior = both;
  with_prior.insert(with_prior.end(), {"--prior", "skin.albedo.G=0.5,0.7"});
  REQUIRE(invert(with_prior).exit_code <= 1);
  CHECK(nlohmann::json::parse(itn::read_file(folder / "fit.json"))["prior"] == nlohmann::json{"skin.albedo.G=0.5,0.7"});
  itn::write_network(network, itn::Network(description), itn::Precision::single);
  std::filesystem::remove_all(folder / "fit");

  const auto error_of = [&](const std::vector<std::string>& more, int code) {
    const Result refused = invert(more);
    CHECK(refused.exit_code == code);
    return refused.error;
  };
  CHECK(error_of({"--parameter", "glass.alpha"}, 2).find("does not guess glass.alpha") != std::string::npos);
  description.channels = 6;
  itn::write_network(network, itn::Network(description), itn::Precision::single);
  CHECK(error_of({"--parameter", "skin.albedo.G"}, 2).find("needs meshes") != std::string::npos);
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
  CHECK(error_of({"--prior", "skin.sigma_t=1,2"}, 2).find("prior skin.sigma_t=1,2") != std::string::npos);
  for (const char* prior : {"skin.albedo.G", "nothing"})
    CHECK(error_of({"--prior", prior}, 2).find("--prior: got " + std::string(prior)) != std::string::npos);
  for (const char* numbers : {"", "0.5", "0.5,", "0.6,0.5", "0.5,1.5", "0.5,0.6,0.7", "a,b"})
    CHECK(error_of({"--prior", "skin.albedo.G=" + std::string(numbers)}, 2).find("LOW,HIGH") != std::string::npos);
  CHECK(error_of({"--prior", "skin.albedo.G=0.5,0.6", "--method", "adam"}, 2).find("gauss-newton") !=
        std::string::npos);
  CHECK(error_of({"--parameter", "skin.nothing"}, 2).find("none of that name") != std::string::npos);
}

TEST_CASE("itn invert --init: a network of six channels knows the scene's shape and light as a data set's") {
  const TemporaryFolder folder;
  itn::write_file(folder / "config.json",
                  R"({"size": 16, "spp": 8, "train": {"shapes": ["cup"], "azimuths": [30], "materials": 10},
                      "test": {"shapes": ["hare"], "azimuths": [70], "materials": 1}})");
  const std::string set = folder / "set";
  REQUIRE(run_itn({"dataset", folder / "config.json", "-o", set, "--quiet"}).exit_code == 0);
  itn::NetworkDescription description;
  description.channels = 6;
  description.size = 16;
  itn::Network network(description);
  network.initialise(1);
  itn::write_network(folder / "six.safetensors", network, itn::Precision::single);

  const auto manifest = nlohmann::json::parse(itn::read_file(set + "/manifest.json"));
  const auto& image = manifest["images"][0];
  const std::string file = set + "/" + image["file"].get<std::string>();
  REQUIRE(run_itn({"predict", folder / "six.safetensors", file, "--dataset", set, "--json", folder / "guess.json"})
              .exit_code == 0);
  const auto guess = nlohmann::json::parse(itn::read_file(folder / "guess.json"))["images"][0];

  REQUIRE(run_itn({"shapes", "-o", folder / "shapes", "--quiet"}).exit_code == 0);
  const auto sun = manifest["lights"][0]["direction"];
  const std::string direction = sun[0].dump() + ", " + sun[1].dump() + ", " + sun[2].dump();
  const Result result = run_itn({"invert",       ITN_SOURCE_DIR "/scenes/dataset/scene.xml",
                                 "-D",           "mesh=" + (folder / "shapes/cup.ply"),
                                 "-D",           "size=16",
                                 "-D",           "sun=" + direction,
                                 "--target",     file,
                                 "--parameter",  "medium.sigma_t",
                                 "--parameter",  "medium.albedo",
                                 "--parameter",  "phase.g",
                                 "--init",       folder / "six.safetensors",
                                 "--spp",        "4",
                                 "--iterations", "1",
                                 "-o",           folder / "fit",
                                 "--json",       folder / "fit.json"});
  INFO(result.error);
  REQUIRE(result.exit_code <= 1);
  const auto from = nlohmann::json::parse(itn::read_file(folder / "fit.json"))["starts"][0]["from"];
  CHECK(from["medium.sigma_t"].get<double>() == Approx(guess["sigma_t"]["value"].get<double>()).epsilon(1e-3));
  CHECK(from["medium.albedo"].get<double>() == Approx(guess["albedo"]["value"].get<double>()).epsilon(1e-3));
  CHECK(from["phase.g"].get<double>() == Approx(guess["g"]["value"].get<double>()).epsilon(1e-3).margin(1e-3));

  const auto predict = [&](const std::string& size) {
    return run_itn({"predict", folder / "six.safetensors", file, "--scene", ITN_SOURCE_DIR "/scenes/dataset/scene.xml",
                    "-D", "mesh=" + (folder / "shapes/cup.ply"), "-D", "size=" + size, "-D", "sun=" + direction,
                    "--json", "-"})
        .output;
  };
  const std::string of_its_size = predict("16");
  const auto in_scene = nlohmann::json::parse(of_its_size);
  CHECK(in_scene["unit_of_sigma_t"] == "1/scene unit");
  for (const char* name : {"sigma_t", "albedo", "g"})
    CHECK(in_scene["images"][0][name]["value"].get<double>() ==
          Approx(guess[name]["value"].get<double>()).epsilon(1e-3).margin(1e-3));
  CHECK(predict("32") == of_its_size);  // the network looks with its own pixels
}

TEST_CASE("itn invert finds a texture texel by texel, goes on where it was, and refuses what is of numbers alone") {
  const TemporaryFolder folder;
  const std::string scene = ITN_SOURCE_DIR "/scenes/test/mitsuba/sunsky_null_floor.xml";
  REQUIRE(
      run_itn({"render", scene, "-o", folder / "target.exr", "--spp", "4", "--size", "32x24", "--quiet"}).exit_code ==
      0);
  std::vector<std::string> arguments{"invert",       scene,
                                     "--target",     folder / "target.exr",
                                     "--size",       "32x24",
                                     "--parameter",  "diffuse0.reflectance",
                                     "-o",           folder / "fit",
                                     "--spp",        "2",
                                     "--iterations", "3",
                                     "--smoothness", "0.1",
                                     "--json",       "-"};
  const Result result = run_itn(arguments);
  INFO(result.error);
  REQUIRE(result.exit_code == 1);  // three iterations of two samples lead away from the truth
  CHECK(result.error.find("not converged: the image found does not fit") != std::string::npos);
  const auto json = nlohmann::json::parse(result.output);
  CHECK(json["schema"] == "itn.invert/1");
  CHECK(json["converged"] == false);
  CHECK(json["fit"]["fits"] == false);
  CHECK(json["textures"]["diffuse0.reflectance"]["uncertainty"]["holds"] == false);
  CHECK(json["iterations"] == 3);
  const auto& texture = json["textures"]["diffuse0.reflectance"];
  const itn::ExrImage found = itn::read_exr(texture["file"].get<std::string>());
  CHECK(found.width == texture["width"]);
  CHECK(*std::min_element(found.data.begin(), found.data.end()) > 0);
  const itn::ExrImage errors = itn::read_exr(texture["uncertainty"]["file"].get<std::string>());
  CHECK(errors.data.size() == found.data.size());
  CHECK(*std::min_element(errors.data.begin(), errors.data.end()) >= 0);
  CHECK(texture["uncertainty"]["rms"].get<double>() > 0);
  for (const char* name : {"diffuse0.reflectance.png", "diffuse0.reflectance.uncertainty.png", "target.png",
                           "rerender.png", "residual.png", "result.json"})
    CHECK(std::filesystem::file_size(folder / ("fit/" + std::string(name))) > 60);
  const std::string lines = itn::read_file(folder / "fit/iterations.jsonl");
  CHECK(std::count(lines.begin(), lines.end(), '\n') == 3 + 4);  // and the repetitions
  const Result again = run_itn(arguments);                       // nothing left to do
  REQUIRE(again.exit_code == 1);
  CHECK(nlohmann::json::parse(again.output)["loss"] == json["loss"]);
  CHECK(itn::read_file(folder / "fit/iterations.jsonl") == lines);
  for (const auto& [option, value] : {std::pair{"--starts", "2"}, {"--range", "skin.albedo.G=0.3,0.9"}}) {
    std::vector<std::string> with = arguments;
    with.insert(with.end(), {option, value});
    const Result refused = run_itn(with);
    CHECK(refused.exit_code == 2);
    CHECK_THAT(refused.error, Catch::Contains(option) && Catch::Contains("textures"));
  }
}

TEST_CASE("a folder that another method or command has filled is no place for an inversion") {
  const TemporaryFolder folder;
  target_in(folder);
  const auto refused = [&](const std::string& file, const std::string& text, const std::string& words) {
    for (const char* method : {"gauss-newton", "adam", "posterior"}) {
      if (words.find(method) != std::string::npos) continue;
      std::filesystem::remove_all(folder / "fit");
      std::filesystem::create_directory(folder / "fit");
      itn::write_file(folder / ("fit/" + file), text);
      const Result result = run_itn(invert(folder, {"--method", method, "--iterations", "1"}));
      CAPTURE(file, method, result.error);
      CHECK(result.exit_code == 2);
      CHECK_THAT(result.error, Catch::Contains(words) && Catch::Contains("another folder"));
      CHECK(itn::read_file(folder / ("fit/" + file)) == text);
    }
  };
  const auto state = [](const std::string& schema) { return "{\"schema\": \"" + schema + "\", \"request\": {}}"; };
  refused("state.json", state("itn.invert.posterior.state/1"), "holds an inversion by method posterior");
  refused("state.json", state("itn.invert.state/3"), "holds an inversion by method gauss-newton or adam");
  refused("state.json", state("itn.invert.textures.state/3"), "holds an inversion of textures");
  refused("manifest.json", "{}", "holds a data set");
  refused("run.json", "{}", "holds a training");
  refused("result.json", "{\"schema\": \"itn.eval/1\"}", "holds an evaluation");
}

TEST_CASE("itn invert --method posterior needs no start, always answers, and keeps renderings for the next photo") {
  const TemporaryFolder folder;
  target_in(folder);
  const auto posterior = [&](const std::string& output, const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"invert",        ball,       "--target",  folder / "target.exr", "--parameter",
                                       "skin.albedo.G", "--method", "posterior", "--renderings",        folder / "kept",
                                       "--spp",         "32",       "-o",        folder / output};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_itn(arguments);
  };
  const Result result = posterior("one", {"--json", "-"});
  INFO(result.error);
  REQUIRE(result.exit_code == 0);
  const auto json = nlohmann::json::parse(result.output);
  CHECK(json["schema"] == "itn.invert/1");
  CHECK(json["method"] == "posterior");
  const auto& albedo = json["parameters"]["skin.albedo.G"];
  const double value = albedo["value"], low = albedo["low"], high = albedo["high"], error = albedo["stderr"];
  CHECK(low < value);
  CHECK(value < high);
  CHECK(std::fabs(value - 0.6) < 4 * error);
  CHECK(error < 0.08);
  CHECK(json["correlation"]["skin.albedo.G"]["skin.albedo.G"].get<double>() == Approx(1));
  CHECK(json["renderings"]["found"] == 0);
  CHECK(json["peaks"].size() == 1);
  const std::string samples = itn::read_file(folder / "one/samples.csv");
  CHECK(samples.rfind("skin.albedo.G,log_density,peak,holds\n", 0) == 0);
  CHECK(std::count(samples.begin(), samples.end(), '\n') == 2001);
  CHECK(itn::read_file(folder / "one/report.html").find("samples of the posterior") != std::string::npos);
  for (const char* name : {"target.png", "rerender.png", "residual.png", "rerender.exr"})
    CHECK(std::filesystem::file_size(folder / ("one/" + std::string(name))) > 60);

  // the same again is there already, another target of the same scene finds the renderings
  const auto before = std::filesystem::last_write_time(folder / "kept/renderings.json");
  CHECK(posterior("one", {}).exit_code == 0);
  CHECK(std::filesystem::last_write_time(folder / "kept/renderings.json") == before);
  const Result next = posterior("two", {"--noise", "0.01", "--json", "-"});
  REQUIRE(next.exit_code == 0);
  CHECK(nlohmann::json::parse(next.output)["renderings"]["found"] == json["renderings"]["made"]);
  // of another scene they are refused
  CHECK(posterior("three", {"-D", "green=0.5"}).exit_code == 2);
  CHECK(posterior("four", {"--start", "skin.albedo.G=0.5"}).exit_code == 2);
  CHECK(posterior("five", {"--range", "skin.albedo.G=0.5,2"}).exit_code == 2);
}
