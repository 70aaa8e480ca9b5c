// Every place of a slider is a value that its parameter may have.
#include "runtime/view/slider.h"

#include <catch2/catch.hpp>
#include <filesystem>
#include <string>

#include "itn/load_scene.h"

using namespace itn;

namespace {

Parameter parameter(double value, double low, double high, bool low_included, bool high_included) {
  Parameter p;
  p.name = "thing.number";
  p.member = "number";
  p.value = value;
  p.low = low;
  p.high = high;
  p.low_included = low_included;
  p.high_included = high_included;
  p.owner = Owner::bsdf;
  return p;
}

}  // namespace

TEST_CASE("every slider of the gallery stays in its parameter's range and reaches its value") {
  for (const auto& entry : std::filesystem::directory_iterator(ITN_SOURCE_DIR "/scenes/gallery")) {
    if (entry.path().extension() != ".xml") continue;
    for (const Parameter& p : list_parameters(load_scene(entry.path().string()))) {
      if (p.has_values() || std::isnan(p.value)) continue;
      INFO(entry.path() << " " << p.name);
      const Slider slider = slider_of(p);
      CHECK(slider.low < slider.high);
      CHECK(slider.low <= p.value);
      CHECK(p.value <= slider.high);
      double before = slider.value(0);
      for (int i = 0; i <= 100; ++i) {
        const double value = slider.value(i / 100.0);
        CHECK(p.contains(value));
        CHECK(value >= before);
        before = value;
      }
    }
  }
}

TEST_CASE("without an upper bound the value is in the middle and the lower end is reached") {
  const Slider slider = slider_of(parameter(20, 0, std::numeric_limits<double>::infinity(), true, false));
  CHECK(slider.value(0) == 0);
  CHECK(slider.value(0.5) == Approx(20));
  CHECK(slider_of(parameter(0, 0, std::numeric_limits<double>::infinity(), true, false)).value(1) == 1);
}

TEST_CASE("ends that do not belong to the range are left out") {
  const Slider slider = slider_of(parameter(0.5, -1, 1, false, false));
  CHECK(slider.value(0) > -1);
  CHECK(slider.value(1) < 1);
}

TEST_CASE("an index of refraction is looked at in factors, an albedo near 1") {
  CHECK(slider_of(parameter(1.5, 0.001, 1000, true, true)).scale == Slider::Scale::logarithm);
  Parameter albedo = parameter(0.9, 0, 1, true, true);
  albedo.owner = Owner::medium;
  albedo.member = "albedo";
  const Slider slider = slider_of(albedo);
  CHECK(slider.value(1) == 1);
  CHECK(slider.value(0.9) == Approx(0.999));
}
