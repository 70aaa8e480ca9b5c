// The fuzzers' corpora, in the ordinary tests: what was found once stays mended.
#include <catch2/catch.hpp>
#include <filesystem>

#include "runtime/base/file.h"
#include "tests/fuzz/readers.h"

TEST_CASE("every file of the corpora is read or refused") {
  std::size_t files = 0;
  for (const itn::fuzz::Reader& reader : itn::fuzz::readers()) {
    const std::filesystem::path corpus = std::filesystem::path(ITN_SOURCE_DIR "/tests/fuzz/corpus") / reader.name;
    REQUIRE(std::filesystem::is_directory(corpus));
    for (const auto& entry : std::filesystem::directory_iterator(corpus)) {
      CAPTURE(entry.path().string());
      CHECK_NOTHROW(reader.read(itn::read_file(entry.path().string())));
      ++files;
    }
  }
  CHECK(files > 30);
}
