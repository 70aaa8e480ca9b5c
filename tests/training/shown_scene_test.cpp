// How noisy a photo is, by which a network is shown as noisy renderings. Whether what it then says holds the truth:
// answer_emulator_test.cpp, and in a scene tests/tool/predict_test.cpp.
#include "runtime/training/shown_scene.h"

#include <catch2/catch.hpp>

#include "runtime/image/exr.h"
#include "tests/support/temporary_folder.h"

using namespace itn;

TEST_CASE("a photo's noise is a share of its mean, less where the network sees several pixels as one") {
  const TemporaryFolder folder;
  ExrImage image{8, 8, {"Y", "stderr.Y"}, {}, {}};
  for (int i = 0; i < 64; ++i) image.data.insert(image.data.end(), {i % 2 == 0 ? 1.0F : 3.0F, 0.5F});
  write_exr(folder / "photo.exr", image);
  CHECK(noise_share(folder / "photo.exr", 8, {}) == Approx(0.25));
  CHECK(noise_share(folder / "photo.exr", 4, {}) == Approx(0.125));  // of four pixels
  CHECK(noise_share(folder / "photo.exr", 16, {}) == Approx(0.25));

  image.channels = {"Y", "other"};
  write_exr(folder / "silent.exr", image);
  CHECK(noise_share(folder / "silent.exr", 8, {}) == 0);
}

TEST_CASE("an estimate from samples is their mean, and what 95 % of them lie between") {
  std::vector<std::vector<double>> samples;
  for (int k = 1000; k >= 0; --k) samples.push_back({k / 1000.0, 2.0});
  const std::vector<ParameterEstimate> said = estimates_of(samples);
  REQUIRE(said.size() == 2);
  CHECK(said[0].value == Approx(0.5));
  CHECK(said[0].low == Approx(0.025));
  CHECK(said[0].high == Approx(0.975));
  CHECK((said[1].low == 2 && said[1].value == 2 && said[1].high == 2));
}
