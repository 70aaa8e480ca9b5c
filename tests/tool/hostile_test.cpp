// Commands that are asked for what would lose or mix up something, and surroundings that are broken.
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "runtime/base/file.h"
#include "runtime/image/exr.h"
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
  for (const auto& arguments :
       std::vector<std::vector<std::string>>{{"render", scene.file, "-o", scene.file},
                                             {"render", scene.file, "-o", scene.folder / "link.exr"},
                                             {"render", scene.file, "-o", a, "--json", a},
                                             {"render", scene.file, "-o", a, "--json", scene.folder / "./a.exr"},
                                             {"render", scene.file, "-o", a, "--json", scene.file},
                                             {"parameters", scene.file, "--json", scene.file},
                                             {"gradcheck", scene.file, "--json", scene.file}}) {
    const Result result = run_itn(arguments);
    CAPTURE(arguments.front(), result.error);
    CHECK(result.exit_code == 2);
    CHECK_THAT(result.error, Contains("choose another name"));
    CHECK(itn::read_file(scene.file) == before);
    CHECK_FALSE(itn::is_there(a));
  }
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
