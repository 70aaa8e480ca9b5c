// --device with several devices: a process for each, and the bytes of one.
#include <catch2/catch.hpp>
#include <filesystem>

#include "itn/device.h"
#include "itn/file.h"
#include "tests/support/temporary_folder.h"
#include "tests/tool/process.h"

namespace {

using Catch::Contains;

void run(const std::vector<std::string>& arguments, const Process::Options& options = {}) {
  const Result result = run_itn(arguments, options);
  INFO(result.error);
  REQUIRE(result.exit_code == 0);
}

// The device of the tests, as if there were several of it.
std::string devices(int count) {
  const std::string index = std::to_string(itn::Device().info().index);
  std::string list = index;
  for (int i = 1; i < count; ++i) list += "," + index;
  return list;
}

}  // namespace

TEST_CASE("an image by several devices has the bytes of one's, whether --device or the environment names them") {
  const TemporaryFolder folder;
  const auto render = [&](const std::string& to) {
    return std::vector<std::string>{"render", ball, "--spp", "4", "--size", "17x9", "--quiet", "-o", folder / to};
  };
  std::vector<std::string> several = render("several.exr");
  several.insert(several.end(), {"--device", devices(2), "--json", folder / "several.json"});
  run(render("one.exr"));
  run(several);
  run(render("environment.exr"), {{{"ITN_DEVICE", devices(3)}}});
  const std::string bytes = itn::read_file(folder / "one.exr");
  CHECK(itn::read_file(folder / "several.exr") == bytes);
  CHECK(itn::read_file(folder / "environment.exr") == bytes);
  CHECK_THAT(itn::read_file(folder / "several.json"), Contains("\"count\": 2"));
}

TEST_CASE("a data set by several devices has the bytes of one's") {
  const TemporaryFolder folder;
  itn::write_file(folder / "config.json",
                  R"({"preset": "tiny", "size": 8, "spp": 16, "boundary": {"type": "matched"},
                      "train": {"shapes": ["knot"], "azimuths": [0], "materials": 6},
                      "test": {"shapes": ["hare"], "azimuths": [30], "materials": 1}})");
  run({"dataset", folder / "config.json", "-o", folder / "one", "--quiet"});
  run({"dataset", folder / "config.json", "-o", folder / "several", "--quiet", "--device=" + devices(2)});
  int images = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder / "one/images")) {
    CHECK(itn::read_file(entry.path().string()) ==
          itn::read_file(folder / "several/images/" + entry.path().filename().string()));
    ++images;
  }
  CHECK(images >= 7);
  CHECK(itn::read_file(folder / "one/manifest.json") == itn::read_file(folder / "several/manifest.json"));
}

TEST_CASE("several devices: errors end all processes, with the exit code of what went wrong") {
  const TemporaryFolder folder;
  const Result check = run_itn({"gradcheck", ball, "--device", devices(2)});
  CHECK(check.exit_code == 2);
  CHECK_THAT(check.error, Contains("is no work for several processes"));
  const std::string one = devices(1);
  for (const auto& [list, code] : {std::pair{one + ",nowhere", 4}, {"nowhere," + one, 4}, {one + ",", 2}}) {
    CAPTURE(list);
    const Result result = run_itn({"render", ball, "--device", list, "-o", folder / "a.exr"});
    CHECK(result.exit_code == code);
    CHECK_FALSE(itn::is_there(folder / "a.exr"));
  }
}
