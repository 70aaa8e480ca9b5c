// A folder's job goes on only as what it was begun as.
#include "runtime/base/stored_run.h"

#include <catch2/catch.hpp>
#include <filesystem>

#include "itn/error.h"
#include "itn/file.h"
#include "runtime/base/folder_owner.h"
#include "tests/support/temporary_folder.h"

using namespace itn;
using Catch::Contains;
using Json = StoredRun::Json;

namespace {

const Json request{{"seed", 1}, {"files", {{"a", "0a"}, {"b", "0b"}}}};

StoredRun open(const std::string& file) { return {file, "test/1", "a test"}; }

}  // namespace

TEST_CASE("a run that was stored goes on with the same request, in whatever order its keys stand") {
  const TemporaryFolder folder;
  const std::string file = folder / "run.json";
  const StoredRun before = open(file);
  CHECK(before.before("state").is_null());
  CHECK_NOTHROW(before.require_same(request));
  before.write(request, {{"state", {1, 2}}});
  CHECK_THAT(read_file(file),
             Catch::StartsWith(R"({"schema":"test/1","request":{"seed":1,"files":{"a":"0a","b":"0b"}},)"
                               R"("state":[1,2],"checksum":")"));
  const StoredRun after = open(file);
  CHECK(after.before("state") == Json{1, 2});
  for (const Json& same : {request, Json{{"files", {{"b", "0b"}, {"a", "0a"}}}, {"seed", 1}}, Json{{"seed", 1}}})
    CHECK_NOTHROW(after.require_same(same));
}

TEST_CASE("a run with a member twice is refused by its name") {
  const TemporaryFolder folder;
  const std::string file = folder / "run.json";
  write_file(file, R"({"schema": "test/1", "request": {"seed": 1, "seed": 2}})");
  CHECK_THROWS_WITH(open(file), Contains("\"seed\" twice"));
}

TEST_CASE("a run of which any character has changed is refused, or says the same") {
  const TemporaryFolder folder;
  const std::string file = folder / "run.json";
  const Json state{1.25, -0.1, "text", nullptr, true, {{"deep", 1e-300}}};
  open(file).write(request, {{"state", state}});
  const std::string whole = read_file(file);
  std::size_t refused = 0;
  for (std::size_t at = 0; at < whole.size(); ++at)
    for (const int bit : {1, 2, 4, 16, 32}) {
      std::string changed = whole;
      changed[at] = static_cast<char>(changed[at] ^ bit);
      write_file(file, changed);
      CAPTURE(changed);
      try {
        const StoredRun run = open(file);
        CHECK_NOTHROW(run.require_same(request));
        CHECK(run.before("state") == state);  // in the checksum's name: as from before there were any
      } catch (const InputError&) {
        ++refused;
      }
    }
  CHECK(refused > 5 * whole.size() - 60);
  write_file(file, Json::parse(whole).dump(2));  // set out in another way
  CHECK(open(file).before("state") == state);
  Json of_before = Json::parse(whole);
  of_before.erase("checksum");
  write_file(file, of_before.dump());
  CHECK(open(file).before("state") == state);
  write_file(file, whole.substr(0, whole.find("-0.1")) + "-0.2" + whole.substr(whole.find("-0.1") + 4));
  CHECK_THROWS_WITH(open(file), Contains("run.json: has changed since it was written: its checksum differs"));
}

TEST_CASE("a run of another request is refused with what differs") {
  const TemporaryFolder folder;
  open(folder / "run.json").write(request, Json::object());
  const StoredRun run = open(folder / "run.json");
  CHECK_THROWS_AS(run.require_same({{"seed", 2}}), UsageError);
  CHECK_THROWS_WITH(run.require_same({{"seed", 2}}), Contains("holds a test with another seed (1, now 2)"));
  CHECK_THROWS_WITH(run.require_same({{"seed", 1}, {"device", "x"}}), Contains("another device (null, now \"x\")"));
}

TEST_CASE("what is no run of this version is refused by name") {
  const TemporaryFolder folder;
  for (const char* text : {"", "{", "[]", "1", "{}", R"({"schema":"test/1"})", R"({"schema":"test/1","request":1})",
                           R"({"schema":"test/2","request":{}})", R"({"schema":["test/1"],"request":{}})"}) {
    write_file(folder / "run.json", text);
    CHECK_THROWS_AS(open(folder / "run.json"), InputError);
    CHECK_THROWS_WITH(open(folder / "run.json"), Contains("run.json: not a test by this version"));
  }
}

TEST_CASE("the file of another kind of job is a wrong command line, of whatever version") {
  const TemporaryFolder folder;
  const std::vector<std::string> schemas{"itn.invert.state/3", "itn.invert.posterior.state/1",
                                         "itn.invert.textures.state/3", "itn.run/1"};
  for (const std::string& there : schemas)
    for (const std::string& asked : schemas) {
      CAPTURE(there, asked);
      StoredRun(folder / "state.json", there, "a test").write(request, Json::object());
      if (there == asked)
        CHECK_NOTHROW(StoredRun(folder / "state.json", asked, "a test"));
      else
        CHECK_THROWS_AS(StoredRun(folder / "state.json", asked, "a test"), UsageError);
      std::filesystem::remove(folder / "state.json");
    }
  write_file(folder / "state.json", R"({"schema":"itn.invert.posterior.state/9","request":{}})");
  CHECK_THROWS_WITH(StoredRun(folder / "state.json", "itn.invert.state/3", "an inversion"),
                    Contains("holds an inversion by method posterior, not an inversion; give another folder"));
  CHECK_THROWS_AS(StoredRun(folder / "state.json", "itn.invert.posterior.state/1", "a test"), InputError);
}

TEST_CASE("a folder that another command has filled is refused by each kind of job") {
  for (const char* there : {"manifest.json", "run.json", "state.json", "renderings.json", "result.json"})
    for (const char* own : {"manifest.json", "run.json", "state.json", "renderings.json", "result.json"}) {
      CAPTURE(there, own);
      const TemporaryFolder folder;
      write_file(folder / there, "{\n  \"schema\": \"itn.eval/1\"");
      if (std::string(there) == own)
        CHECK_NOTHROW(refuse_folder_of_other(folder.path(), own));
      else
        CHECK_THROWS_AS(refuse_folder_of_other(folder.path(), own), UsageError);
      if (std::string(there) != own) CHECK_THROWS_AS(RunFolder(folder.path(), own, "test/1", "a test"), UsageError);
    }
  const TemporaryFolder folder;
  write_file(folder / "result.json", "{\n  \"schema\": \"itn.invert/1\"");  // of an inversion, whose state says so
  CHECK_NOTHROW(refuse_folder_of_other(folder.path(), "state.json"));
}

TEST_CASE("a run's folder is made, and has one writer") {
  const TemporaryFolder folder;
  {
    const RunFolder run(folder / "deep/er", "run.json", "test/1", "a test");
    CHECK(std::filesystem::is_directory(folder / "deep/er"));
    CHECK(run.file("run.json") == run.run().file());
    CHECK_THROWS_WITH(RunFolder(folder / "deep/er", "run.json", "test/1", "a test"), Contains("another process"));
  }
  CHECK_NOTHROW(RunFolder(folder / "deep/er", "run.json", "test/1", "a test"));
}
