// itn shapes as a user meets it.
#include <sys/stat.h>

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "itn/bitmap.h"
#include "itn/file.h"
#include "runtime/scene/mesh/mesh_file.h"
#include "runtime/scene/mesh/mesh_topology.h"
#include "tests/support/temporary_folder.h"
#include "tests/tool/process.h"

TEST_CASE("itn shapes writes ten closed meshes, random ones and what they are; the same seed gives the same bytes") {
  const TemporaryFolder folder;
  const std::string output = folder / "made/shapes";
  const Result result = run_itn({"shapes", "-o", output, "--random", "2", "--seed", "5", "--json", "-"});
  INFO(result.error);
  REQUIRE(result.exit_code == 0);
  const auto json = nlohmann::json::parse(result.output);
  CHECK(json == nlohmann::json::parse(itn::read_file(output + "/shapes.json")));
  CHECK(json["schema"] == "itn.shapes/1");
  int train = 0, test = 0, random = 0;
  for (const auto& shape : json["shapes"]) {
    CAPTURE(shape["name"]);
    train += shape["role"] == "train";
    test += shape["role"] == "test";
    random += shape["role"] == "random";
    const itn::Mesh mesh = itn::read_mesh(output + "/" + shape["file"].get<std::string>());
    CHECK(mesh.triangle.size() == shape["triangles"].get<std::size_t>());
    const itn::Topology found = itn::topology(mesh);
    CHECK(found.closed());
    CHECK(found.volume == Approx(shape["volume"].get<double>()));
    CHECK(shape["genus"].get<int>() >= 0);
  }
  CHECK(train == 6);
  CHECK(test == 4);
  CHECK(random == 2);
  CHECK(json["shapes"][11]["seed"] == 6);

  const Result again = run_itn({"shapes", "-o", folder / "again", "--random", "1", "--seed", "6", "--quiet"});
  REQUIRE(again.exit_code == 0);
  CHECK(again.output.empty());
  for (const char* name : {"/random_6.ply", "/hare.ply"})
    CHECK((itn::read_file(output + name) == itn::read_file(folder / "again" + name)));
}

TEST_CASE("itn shapes --preview draws every shape") {
  const TemporaryFolder folder;
  const Result result = run_itn({"shapes", "-o", folder / "a", "--preview", "--spp", "1"});
  INFO(result.error);
  REQUIRE(result.exit_code == 0);
  CHECK_THAT(result.output, Catch::Contains("teapot.ply"));
  const itn::Bitmap sheet = itn::read_bitmap(folder / "a/shapes.png");
  CHECK(sheet.width == 800);
  CHECK(sheet.height == 320);
}

TEST_CASE("itn shapes says where it cannot write and what it cannot make") {
  const TemporaryFolder folder;
  const auto fails = [](const std::vector<std::string>& arguments, int code, const std::string& word,
                        const Process::Options& options = {}) {
    const Result result = run_itn(arguments, options);
    CAPTURE(result.error);
    CHECK(result.exit_code == code);
    CHECK_THAT(result.error, Catch::Contains(word));
  };
  itn::write_file(folder / "file", "");
  fails({"shapes", "-o", folder / "file"}, 2, "no folder");
  fails({"shapes", "-o", folder / "file/below"}, 1, "cannot be created");
  REQUIRE(chmod(folder.path().c_str(), 0555) == 0);
  fails({"shapes", "-o", folder / "below"}, 1, "cannot be created", {.ordinary_user = true});
  fails({"shapes"}, 2, "--output is required");
  fails({"shapes", "-o", folder / "a", "--random", "-1"}, 2, "--random");
  fails({"shapes", "-o", folder / "a", "--random", "2", "--seed", "18446744073709551615"}, 2, "2^64 - 1");
}
