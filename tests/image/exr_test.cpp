#include "itn/exr.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "itn/error.h"
#include "itn/file.h"
#include "tests/support/temporary_folder.h"

namespace {

itn::ExrImage example() {
  itn::ExrImage image{37, 21, {"R", "G", "B", "stderr.R", "derivative.skin.sigma_t.R"}, {}, {}};
  for (int i = 0; i < 37 * 21 * 5; ++i) image.data.push_back(std::sin(0.1f * static_cast<float>(i)) * 1e3f);
  image.data[7] = std::numeric_limits<float>::denorm_min();
  image.header = {{"itn.scene", "knot.xml"}, {"itn.seed", "18446744073709551615"}};
  return image;
}

std::string failure(const std::string& path) {
  try {
    itn::read_exr(path);
  } catch (const itn::InputError& error) {
    return error.what();
  }
  return "no InputError";
}

}  // namespace

TEST_CASE("channels, pixels and header come back as written, bit for bit") {
  const TemporaryFolder folder;
  const itn::ExrImage written = example();
  itn::write_exr(folder / "a.exr", written);
  const itn::ExrImage read = itn::read_exr(folder / "a.exr");
  REQUIRE(read.width == 37);
  REQUIRE(read.height == 21);
  REQUIRE(read.channels.size() == written.channels.size());
  CHECK(read.header == written.header);
  for (std::size_t c = 0; c < written.channels.size(); ++c) {
    const int at = read.channel(written.channels[c]);
    REQUIRE(at >= 0);
    for (std::size_t i = 0; i < 37 * 21; ++i)
      REQUIRE(read.data[i * 5 + static_cast<std::size_t>(at)] == written.data[i * 5 + c]);
  }
  CHECK(read.channel("Z") == -1);
}

TEST_CASE("the same image gives the same bytes") {
  const TemporaryFolder folder;
  itn::write_exr(folder / "a.exr", example());
  itn::write_exr(folder / "b.exr", example());
  CHECK(itn::read_file(folder / "a.exr") == itn::read_file(folder / "b.exr"));
}

TEST_CASE("missing, foreign, truncated and damaged files are input errors with the file's name") {
  const TemporaryFolder folder;
  CHECK_THAT(failure(folder / "missing.exr"), Catch::Contains("missing.exr") && Catch::Contains("No such file"));
  itn::write_file(folder / "text.exr", "this is text");
  CHECK_THAT(failure(folder / "text.exr"), Catch::Contains("text.exr: is no OpenEXR file"));
  itn::write_exr(folder / "a.exr", example());
  const std::string bytes = itn::read_file(folder / "a.exr");
  for (const double part : {0.001, 0.02, 0.05, 0.3, 0.6, 0.9, 0.999}) {
    const auto length = static_cast<std::size_t>(part * static_cast<double>(bytes.size()));
    itn::write_file(folder / "cut.exr", bytes.substr(0, length));
    INFO(length << " of " << bytes.size() << " bytes");
    CHECK_THAT(failure(folder / "cut.exr"), Catch::Contains("cut.exr: "));
  }
}

TEST_CASE("a full disk while writing an image is a result error") {
  CHECK_THROWS_AS(itn::write_exr("/dev/full", example()), itn::ResultError);
}

TEST_CASE("a header that promises more than the file holds is refused before memory is taken") {
  const TemporaryFolder folder;
  itn::write_exr(folder / "a.exr", example());
  const std::string whole = itn::read_file(folder / "a.exr");
  // Places in the file: an attribute's name, its type, four bytes of length, the value.
  const auto with = [&](const std::string& name, std::size_t at, std::int32_t value) {
    std::string bytes = whole;
    bytes.replace(bytes.find(name) + at, 4, reinterpret_cast<const char*>(&value), 4);
    itn::write_file(folder / "b.exr", bytes);
    return failure(folder / "b.exr");
  };
  const std::size_t window = sizeof "dataWindow" + sizeof "box2i";
  CHECK_THAT(with("dataWindow", window + 4 + 8, 299999), Catch::Contains("more than its"));
  CHECK_THAT(with("dataWindow", window + 4 + 8, 2000000000), Catch::Contains("pixels; at most"));
  CHECK_THAT(with("dataWindow", window + 4 + 12, -5), Catch::Contains("data window"));
  CHECK_THAT(with("dataWindow", window, 2000000000), Catch::Contains("an attribute of 2000000000 bytes"));
  CHECK_THAT(with("itn.scene", sizeof "itn.scene" + sizeof "string", -1), Catch::Contains("an attribute of"));
}

TEST_CASE("attributes that are not as long as their type takes are refused: OpenEXR would read on elsewhere") {
  const TemporaryFolder folder;
  itn::write_exr(folder / "a.exr", example());
  const std::string whole = itn::read_file(folder / "a.exr");
  const auto attribute = [](const std::string& type, std::int32_t size, const std::string& value) {
    return std::string("x\0", 2) + type + '\0' + std::string(reinterpret_cast<const char*>(&size), 4) + value;
  };
  const auto with = [&](const std::string& added) {
    std::string bytes = whole;
    bytes.insert(8, added);
    itn::write_file(folder / "b.exr", bytes);
    return failure(folder / "b.exr");
  };
  CHECK_THAT(with(attribute("float", 8, std::string(8, '\0'))),
             Catch::Contains("type float and 8 bytes, which takes 4"));
  CHECK_THAT(with(attribute("preview", 12, std::string(12, '\0'))),
             Catch::Contains("a preview of 0 pixels in 12 bytes"));
  CHECK_THAT(with(attribute("chlist", 2, std::string(2, '\0'))), Catch::Contains("a list of channels"));
  CHECK_THAT(with(attribute("stringvector", 8, std::string("\xff\xff\xff\x7f", 4) + "text")),
             Catch::Contains("a list of texts"));
  CHECK_THAT(with(attribute("idmanifest", 4, std::string(4, '\0'))), Catch::Contains("a list of ids"));
}

TEST_CASE("names of channels that OpenEXR would cut are refused") {
  const TemporaryFolder folder;
  const std::string name(256, 'x');
  CHECK_THROWS_AS(itn::write_exr(folder / "a.exr", {1, 1, {name}, {1}, {}}), itn::ResultError);
  itn::write_exr(folder / "a.exr", {1, 1, {name.substr(1)}, {1}, {}});
  CHECK(itn::read_exr(folder / "a.exr").channel(name.substr(1)) == 0);
}
