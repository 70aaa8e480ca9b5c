// Commands that are asked for what would lose or mix up something, and surroundings that are broken.
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "itn/exr.h"
#include "itn/file.h"
#include "tests/support/made_up_dataset.h"
#include "tests/support/temporary_folder.h"
#include "tests/tool/process.h"

using Catch::Contains;

namespace {

// A scene of its own, which a test may lose.
struct OwnScene {
  TemporaryFolder folder;
  std::string file = folder / "ball.xml";
  OwnScene() { std::filesystem::copy_file(ball, file); }
};

}  // namespace

TEST_CASE("no output goes over an input or another output") {
  const OwnScene scene;
  const std::string before = itn::read_file(scene.file);
  std::filesystem::create_symlink(scene.file, scene.folder / "link.exr");
  const std::string a = scene.folder / "a.exr";
  for (const auto& arguments : std::vector<std::vector<std::string>>{
           {"render", scene.file, "-o", scene.file},
           {"render", scene.file, "-o", scene.folder / "link.exr"},
           {"render", scene.file, "-o", a, "--json", a},
           {"render", scene.file, "-o", a, "--json", scene.folder / "./a.exr"},
           {"render", scene.file, "-o", a, "--json", scene.file},
           {"parameters", scene.file, "--json", scene.file},
           {"gradcheck", scene.file, "--json", scene.file},
           {"render", scene.file, "-o", ""},
           // folders
           {"shapes", "-o", scene.file},
           {"dataset", "tiny", "-o", scene.file},
           {"train", "set", "--network", "rn", "-o", scene.file},
           {"eval", "set", "run", "-o", scene.file},
           {"gradient", scene.file, "--target", "x", "--parameter", "y", "-o", scene.file},
           {"invert", scene.file, "--target", "x", "--parameter", "y", "-o", scene.file},
           {"shapes", "-o", ""},
           {"dataset", "tiny", "-o", ""}}) {
    const Result result = run_itn(arguments);
    CAPTURE(arguments.front(), result.error);
    CHECK(result.exit_code == 2);
    CHECK_THAT(result.error, Contains("choose another name"));
    CHECK(itn::read_file(scene.file) == before);
    CHECK_FALSE(itn::is_there(a));
  }
}

TEST_CASE("what is said of a network does not go over it, or over the data set that a prediction reads") {
  const TemporaryFolder folder;
  const std::string network = folder / "net.safetensors";
  std::filesystem::copy_file(ITN_SOURCE_DIR "/network/weights/network.safetensors", network);
  const std::string before = itn::read_file(network);
  const Result exported = run_itn({"export", network, "-o", folder / "net.onnx", "--json", network});
  CHECK(exported.exit_code == 2);
  CHECK((itn::read_file(network) == before));
  const Result predicted = run_itn({"predict", network, "a.exr", "--dataset", folder.path(), "--json", network});
  CHECK(predicted.exit_code == 2);
  CHECK(run_itn({"eval", "set", network, "-o", folder / "report", "--json", network}).exit_code == 2);
  CHECK((itn::read_file(network) == before));
}

TEST_CASE("a trained network does not go over a data set") {
  const TemporaryFolder folder;
  const MadeUpDataset set(folder / "set", 2, 1);
  set.write_manifest();
  const std::string before = itn::read_file(folder / "set/manifest.json");
  for (const char* option : {"--export", "--json"}) {
    const Result result = run_itn(
        {"train", folder / "set", "--network", "rn", "-o", folder / "run", option, folder / "set/manifest.json"});
    CHECK(result.exit_code == 2);
    CHECK_THAT(result.error, Contains("choose a place outside"));
    CHECK(itn::read_file(folder / "set/manifest.json") == before);
  }
}

TEST_CASE("an id too long for a channel's name is refused before anything is rendered") {
  const OwnScene scene;
  std::string text = itn::read_file(scene.file);
  const std::string id(240, 'x');
  for (std::size_t at = 0; (at = text.find("\"skin\"", at)) != std::string::npos; at += id.size())
    text.replace(at, 6, "\"" + id + "\"");
  itn::write_file(scene.file, text);
  const Result result = run_itn({"render", scene.file, "-o", scene.folder / "a.exr", "--derivative", id + ".sigma_t"});
  CHECK(result.exit_code == 3);
  CHECK_THAT(result.error, Contains("shorter id"));
}

TEST_CASE("an argument that is no UTF-8 is refused, and messages hold no terminal controls and have an end") {
  CHECK(run_itn({"parameters", "a\xff.xml"}).exit_code == 2);
  const Result controls = run_itn({"parameters", "a\x1b[2J.xml"});
  CHECK(controls.exit_code == 3);
  CHECK_THAT(controls.error, Contains("\\x1b[2J") && !Contains("\x1b"));
  const OwnScene scene;
  itn::write_file(scene.file, "<scene version=\"3.0.0\"><shape type=\"" + std::string(1000000, 'x') + "\"/></scene>");
  const Result result = run_itn({"parameters", scene.file});
  CHECK(result.exit_code == 3);
  CHECK(result.error.size() < 5000);
}

TEST_CASE("ends of lines in names are written out, so that messages have the lines that they were given") {
  CHECK_THAT(run_itn({"parameters", "a\nitn: b.xml"}).error, Contains("a\\nitn: b.xml"));
  CHECK_THAT(run_itn({"export", "a\nb", "-o", "a.onnx"}).error, Contains("a\\nb"));
  const OwnScene scene;
  itn::write_file(scene.file, R"(<scene version="3.0.0"><shape type="a&#10;b"/><bsdf type="c"/></scene>)");
  const Result result = run_itn({"parameters", scene.file});
  CHECK(result.exit_code == 3);
  CHECK_THAT(result.error, Contains("\"a\\nb\"") && Contains("\"c\""));
  CHECK(std::count(result.error.begin(), result.error.end(), '\n') == 2);
}

TEST_CASE("--spp 1 makes no data set") {
  const TemporaryFolder folder;
  const Result result = run_itn({"dataset", "tiny", "-o", folder / "set", "--spp", "1"});
  CHECK(result.exit_code == 2);
  CHECK_FALSE(itn::is_there(folder / "set/manifest.json"));
}

TEST_CASE("a reader that is gone is reported, not died of") {
  int ends[2];
  REQUIRE(pipe(ends) == 0);
  close(ends[0]);
  const std::string name = "/proc/self/fd/" + std::to_string(ends[1]);
  const Result result = run_itn({"parameters", ball}, {.output_file = name});
  close(ends[1]);
  CHECK(result.exit_code == 1);
  CHECK_THAT(result.error, Contains("standard output"));
}

TEST_CASE("a cache of kernels that cannot be written is named, with what to do") {
  const TemporaryFolder folder;
  itn::write_file(folder / "file", "");
  const Result result =
      run_itn({"render", ball, "-o", folder / "a.exr"}, {.environment = {{"POCL_CACHE_DIR", folder / "file"}}});
  if (result.exit_code == 0) return;  // a driver that needs none
  CHECK(result.exit_code == 4);
  CHECK_THAT(result.error, Contains(folder / "file") && Contains("POCL_CACHE_DIR"));
}

TEST_CASE("where standard files are closed, no other file gets in their place") {
  const TemporaryFolder folder;
  const MadeUpDataset set(folder / "set", 16, 4);
  set.write_manifest();
  const auto train = [&](const std::string& run, const std::vector<int>& closed) {
    return run_itn(
        {"train", set.folder, "--network", "rn", "--width", "2", "--epochs", "1", "--batch", "8", "-o", folder / run},
        {.environment = {{"OMP_NUM_THREADS", "1"}}, .closed = closed});
  };
  REQUIRE(train("open", {}).exit_code == 0);
  CHECK(train("closed", {0, 1, 2}).exit_code == 1);  // its words find no reader
  for (const char* file : {"network.safetensors", "checkpoint.safetensors", "curve.jsonl", "run.json"})
    CHECK((itn::read_file(folder / ("closed/" + std::string(file))) ==
           itn::read_file(folder / ("open/" + std::string(file)))));
  for (const auto& entry : std::filesystem::directory_iterator(folder / "closed"))  // the lock, too
    CHECK_THAT(itn::read_file(entry.path().string()), !Contains("epoch 1"));
}

TEST_CASE("damaged files in the cache of kernels end with the name of the folder that is to be removed") {
  const TemporaryFolder folder;
  itn::write_file(folder / "empty.xml", R"(<scene version="3.0.0"><emitter type="constant"/>
<sensor type="perspective"><film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="4"/></film>
</sensor></scene>)");
  const auto render = [&] {
    return run_itn({"render", folder / "empty.xml", "-o", folder / "a.exr", "--spp", "2"},
                   {.environment = {{"POCL_CACHE_DIR", folder / "cache"}}});
  };
  REQUIRE(render().exit_code == 0);
  if (!itn::is_there(folder / "cache")) return;  // a driver that needs none
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder / "cache"))
    if (entry.is_regular_file()) std::filesystem::resize_file(entry.path(), entry.file_size() / 2);
  const Result result = render();
  INFO(result.error);
  CHECK((result.exit_code == 0 || result.exit_code == 4));
  if (result.exit_code != 0) CHECK_THAT(result.error, Contains("rm -r " + (folder / "cache")));
}

TEST_CASE("a film that does not fit into memory is refused before anything is rendered") {
  const TemporaryFolder folder;
  const Result result = run_itn({"render", ball, "-o", folder / "a.exr", "--size", "32768x32768"});
  if (result.exit_code == 0) return;  // a machine that has the memory
  CHECK(result.exit_code == 3);
  CHECK_THAT(result.error, Contains("of memory"));
  CHECK(folder.empty());
}

TEST_CASE("paths that never end are stopped and said to be") {
  const TemporaryFolder folder;
  itn::write_file(folder / "white.xml", R"(<scene version="3.0.0"><integrator type="volpath"/>
<medium type="homogeneous" id="milk"><float name="sigma_t" value="$sigma_t"/><float name="albedo" value="1"/></medium>
<sensor type="perspective">
  <film type="hdrfilm"><integer name="width" value="4"/><integer name="height" value="4"/></film>
  <ref id="milk"/>
</sensor>
<emitter type="constant"/>
<shape type="sphere"><bsdf type="null"/><ref id="milk" name="interior"/></shape>
</scene>)");
  const std::vector<std::string> arguments{
      "render", folder / "white.xml", "-o", folder / "a.exr", "--size", "4x4", "--spp", "16", "--json", "-", "-D"};
  std::vector<std::string> dense = arguments, thin = arguments;
  dense.push_back("sigma_t=1e12");  // flights of less than a bit of single precision
  thin.push_back("sigma_t=10");
  const Result stopped = run_itn(dense), whole = run_itn(thin);
  CHECK(stopped.exit_code == 0);
  CHECK_THAT(stopped.error, Contains("found no end") && Contains("too dark"));
  CHECK(nlohmann::json::parse(stopped.output)["endless"] > 0);
  CHECK(nlohmann::json::parse(whole.output)["endless"] == 0);
  CHECK(whole.error.empty());
}
