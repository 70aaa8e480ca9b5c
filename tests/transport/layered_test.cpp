// Stacks of layers against a deterministic solution (layered_slabs.py): homogeneous media upon each other, one within
// another behind dielectric faces, and the same in a grid of voxels; values, and derivatives by the layers' parameters.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "../support/z_test.h"
#include "itn/parameters.h"
#include "transport.h"

using namespace itn;
using namespace itn::test;
using nlohmann::json;

namespace {

const json& layered_data() {
  static const json file = json::parse(std::ifstream(ITN_SOURCE_DIR "/tests/transport/data/layered.json"));
  return file;
}

// "R60": reflected at 60 degrees.
Scene seen(const std::string& scene, const std::string& what) {
  return load_scene(test_scene(scene + ".xml"), {{"theta", what.substr(1)}, {"below", what[0] == 'T' ? "180" : "0"}});
}

struct Judged {
  std::vector<double> z;
  int noisy = 0;

  void add(const std::string& what, const Estimate& estimate, double expected, double relative_stderr) {
    const double score = z_score(estimate, expected), relative = estimate.stderr_ / std::abs(expected);
    std::printf("| %s | %.6f | %.6f | %.2f %% | %.2f |\n", what.c_str(), estimate.value, expected, 100 * relative,
                score);
    z.push_back(score);
    noisy += relative > relative_stderr;
  }

  void check() const {
    double largest = 0, sum = 0;
    for (const double score : z) {
      largest = std::max(largest, std::abs(score));
      sum += score * score;
    }
    const double p = chi_square_tail(sum, static_cast<int>(z.size()));
    std::printf("%zu rows: largest |z| %.2f, sum of z^2 %.1f (p = %.3g); %d noisy\n", z.size(), largest, sum, p, noisy);
    std::fflush(stdout);
    CHECK(largest < largest_z_bound(z.size(), 0.0027));
    CHECK(p > 1e-4);
  }
};

}  // namespace

TEST_CASE("layers reflect and transmit what the deterministic solution says, as media and as a grid",
          "[transport][stat]") {
  Judged values;
  std::uint64_t seed = 40;
  for (const char* scene : {"layers", "layers_grid", "layers_dielectric"})
    for (const auto& [what, expected] : layered_data().at(scene).at("value").items()) {
      RenderOptions options;
      options.spp = 2048;
      options.seed = ++seed;
      values.add(std::string(scene) + ", " + what, image_mean(render(device(), seen(scene, what), options)),
                 expected.get<double>(), 0.005);
    }
  values.check();
  CHECK(values.noisy == 0);
}

TEST_CASE("derivatives by the parameters of each layer are those of the deterministic solution", "[transport][stat]") {
  Judged values;
  std::uint64_t seed = 60;
  for (const char* name : {"layers", "layers_dielectric"}) {
    const json& data = layered_data().at(name);
    for (const char* what : {"R60", "T0"}) {
      const Scene scene = seen(name, what);
      RenderOptions options;
      options.spp = 1024;
      options.seed = ++seed;
      std::vector<double> expected;
      for (const auto& [parameter, of] : data.at("d").items()) {
        const std::string layer = parameter.substr(0, parameter.find('.'));
        options.derivatives.push_back(parameter.ends_with(".g") ? layer + "_phase.g" : parameter);
        expected.push_back(of.at(what).get<double>());
      }
      const Rendering image = render(device(), scene, options);
      for (std::size_t i = 0; i < expected.size(); ++i)
        values.add(std::string(name) + ", " + what + " by " + options.derivatives[i],
                   {image.derivatives[i].mean_of_image[0], image.derivatives[i].stderr_of_mean[0]}, expected[i], 0.05);
    }
  }
  values.check();
  CHECK(values.noisy < 0.1 * static_cast<double>(values.z.size()));
}
