// Whether what a network that is shown the scene says holds the truth: answer_emulator_test.cpp, and in a scene
// tests/tool/predict_test.cpp.
#include "network/prediction/shown_scene.h"

#include <catch2/catch.hpp>

using namespace itn;

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
