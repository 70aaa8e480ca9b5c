// The scenes that come with the project.
#include <catch2/catch.hpp>
#include <filesystem>

#include "itn/load_scene.h"

TEST_CASE("every scene of the project loads") {
  std::size_t count = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(ITN_SOURCE_DIR "/scenes")) {
    if (entry.path().extension() != ".xml" || entry.path().filename() == "object.xml") continue;  // a part of others
    INFO(entry.path());
    const itn::Scene scene = itn::load_scene(entry.path().string());
    CHECK(!scene.sensors.empty());
    CHECK((scene.environment || !scene.lights.empty()));
    ++count;
  }
  CHECK(count >= 10);
}
