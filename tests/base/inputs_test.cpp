// Files that were read are not written over, and are known again.
#include "runtime/base/inputs.h"

#include <catch2/catch.hpp>
#include <filesystem>

#include "itn/error.h"
#include "itn/file.h"
#include "tests/support/temporary_folder.h"

using namespace itn;

TEST_CASE("a file that was read is not written over, by whatever name") {
  const TemporaryFolder folder;
  write_file(folder / "a", "text");
  std::filesystem::create_symlink(folder / "a", folder / "link");
  std::filesystem::create_hard_link(folder / "a", folder / "twin");
  {
    Inputs inputs;
    read_file(folder / "a");
    inputs.end();
    for (const char* name : {"a", "link", "twin"}) {
      CHECK_THROWS_AS(write_file(folder / name, "other"), UsageError);
      CHECK_THROWS_AS(check_writable(folder / name), UsageError);
    }
    CHECK(read_file(folder / "a") == "text");
    write_file(folder / "b", "other");
    read_file(folder / "b");  // after end(): the command's own
    write_file(folder / "b", "another");
  }
  write_file(folder / "a", "other");
  CHECK(read_file(folder / "a") == "other");
}

TEST_CASE("inputs know whether a file is what it was") {
  const TemporaryFolder folder;
  const auto fingerprint = [&] {
    const Inputs inputs(Inputs::Keep::fingerprints);
    read_file(folder / "a");
    const ForeignInput b(folder / "b");
    b.note();
    REQUIRE(inputs.fingerprints().size() == 2);
    return inputs.fingerprints();
  };
  write_file(folder / "a", "text");
  write_file(folder / "b", "text");
  const auto before = fingerprint();
  CHECK(fingerprint() == before);
  write_file(folder / "b", "texT");
  CHECK(fingerprint().at(folder / "a") == before.at(folder / "a"));
  CHECK(fingerprint().at(folder / "b") != before.at(folder / "b"));
}

TEST_CASE("a file that is exchanged while a foreign library reads it is refused") {
  const TemporaryFolder folder;
  const Inputs inputs(Inputs::Keep::fingerprints);
  write_file(folder / "a", "text");
  write_file(folder / "twin", "text");
  const ForeignInput exchanged(folder / "a");
  std::filesystem::rename(folder / "twin", folder / "a");
  CHECK_THROWS_WITH(exchanged.note(), Catch::Contains("a: has changed while it was read"));
  const ForeignInput removed(folder / "a");
  std::filesystem::remove(folder / "a");
  CHECK_THROWS_AS(removed.note(), InputError);
}
