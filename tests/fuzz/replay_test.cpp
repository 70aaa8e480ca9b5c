// The fuzzers' corpora, in the ordinary tests: what was found once stays mended.
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "tests/fuzz/readers.h"

namespace {

// Not as readers read: where these find their files in memory, the corpora are on the disk all the same.
std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  REQUIRE(file);
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace

TEST_CASE("every file of the corpora is read or refused") {
  std::size_t files = 0;
  for (const itn::fuzz::Reader& reader : itn::fuzz::readers()) {
    const std::filesystem::path corpus = std::filesystem::path(ITN_SOURCE_DIR "/tests/fuzz/corpus") / reader.name;
    REQUIRE(std::filesystem::is_directory(corpus));
    for (const auto& entry : std::filesystem::directory_iterator(corpus)) {
      CAPTURE(entry.path().string());
      CHECK_NOTHROW(reader.read(bytes_of(entry.path())));
      ++files;
    }
  }
  CHECK(files > 30);
}
