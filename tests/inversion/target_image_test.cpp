// Targets as files: which channels count, and what cannot be radiance, a weight or a standard error.
#include <catch2/catch.hpp>
#include <limits>

#include "runtime/base/error.h"
#include "runtime/image/exr.h"
#include "runtime/inversion/image_loss.h"
#include "tests/support/temporary_folder.h"

using namespace itn;

namespace {

using Catch::Contains;
constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN(),
                infinite = std::numeric_limits<float>::infinity();

// 2 x 1 pixels with the radiance 1, 2, 3 and 4, 5, 6, and standard errors of a tenth.
struct Photo {
  TemporaryFolder folder;
  ExrImage image{2,
                 1,
                 {"R", "G", "B", "stderr.R", "stderr.G", "stderr.B"},
                 {1, 2, 3, 0.1F, 0.2F, 0.3F, 4, 5, 6, 0.4F, 0.5F, 0.6F},
                 {}};
  bool masked = false;

  TargetImage read(int channels = 3) const {
    write_exr(folder / "photo.exr", image);
    if (masked) write_exr(folder / "mask.exr", {2, 1, {"Y"}, {0.5F, 0}, {}});
    return read_target(folder / "photo.exr", masked ? folder / "mask.exr" : "", 2, 1, channels);
  }
  std::string refusal() const {
    try {
      read();
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  }
};

}  // namespace

TEST_CASE("a target's radiance and standard errors are those of its channels, in the order of the film's") {
  Photo photo;
  const TargetImage target = photo.read();
  CHECK(target.value == std::vector<float>{1, 2, 3, 4, 5, 6});
  CHECK(target.error == std::vector<float>{0.1F, 0.2F, 0.3F, 0.4F, 0.5F, 0.6F});
  CHECK(target.weight == std::vector<float>{1, 1});
  photo.image = {2, 1, {"Y", "stderr.Y"}, {1, 0.1F, 2, 0.2F}, {}};
  const TargetImage grey = photo.read(1);
  CHECK(grey.value == std::vector<float>{1, 2});
  CHECK(grey.error == std::vector<float>{0.1F, 0.2F});
  CHECK_THROWS_WITH(photo.read(3), Contains("need R G B, as the sensor's film"));
}

TEST_CASE("standard errors of some channels only count as none") {
  Photo photo;
  photo.image = {2, 1, {"R", "G", "B", "stderr.R", "stderr.B"}, {1, 2, 3, 0.1F, -1, 4, 5, 6, 0.4F, 0.6F}, {}};
  const TargetImage target = photo.read();
  CHECK(target.value == std::vector<float>{1, 2, 3, 4, 5, 6});
  CHECK(target.error.empty());
}

TEST_CASE("standard errors of 0 are taken; negative, infinite and NaN ones are refused with pixel and channel") {
  Photo photo;
  photo.image.data[10] = 0;
  CHECK(photo.read().error[4] == 0);
  for (const float wrong : {-0.5F, infinite, not_a_number}) {
    CAPTURE(wrong);
    photo.image.data[10] = wrong;
    CHECK_THAT(photo.refusal(), Contains("photo.exr: pixel (1, 0), channel stderr.G is") &&
                                    Contains("a standard error is finite and 0 or more"));
  }
}

TEST_CASE("pixels of weight 0 may hold anything, and count as 0") {
  Photo photo;
  photo.masked = true;
  photo.image.data[6] = not_a_number;
  photo.image.data[10] = -1;
  const TargetImage target = photo.read();
  CHECK(target.weight == std::vector<float>{0.5F, 0});
  CHECK(target.value == std::vector<float>{1, 2, 3, 0, 0, 0});
  CHECK(target.error == std::vector<float>{0.1F, 0.2F, 0.3F, 0, 0, 0});
  photo.masked = false;
  CHECK_THAT(photo.refusal(), Contains("pixel (1, 0), channel R is nan") && Contains("weight 0 in a mask"));
}

TEST_CASE("a target whose data window is not its display window is refused: its pixels would be compared with others") {
  CHECK_THROWS_WITH(read_target(ITN_SOURCE_DIR "/tests/fuzz/corpus/exr/moved.exr", "", 2, 2, 3),
                    Contains("moved.exr: its data window"));
  CHECK(read_target(ITN_SOURCE_DIR "/tests/fuzz/corpus/exr/colour.exr", "", 2, 2, 3).value.size() == 12);
}
