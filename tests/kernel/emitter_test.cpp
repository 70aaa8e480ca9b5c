#include "runtime/scene/emitter.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <random>

#include "runtime/device/device.h"
#include "runtime/error.h"

namespace {

using namespace itn;
constexpr double pi = std::numbers::pi;

// What kernels/lib/emitter.h says about an emitter, at one width.
class OnDevice {
 public:
  OnDevice(const Emitter& emitter, int width) : width_(width) {
    append_emitter(emitter, record, tables);
    auto definitions = emitter_definitions({record});
    definitions["WIDTH"] = std::to_string(width);
    setenv("ITN_KERNEL_DIR", ITN_SOURCE_DIR "/tests/kernel", 1);
    program_ = device_.build("emitter_test.cl", definitions);
    unsetenv("ITN_KERNEL_DIR");
    record_ = device_.upload(std::vector<EmitterRecord>{record}, "record");
    tables_ = device_.upload(tables, "tables");
  }

  struct Value {
    Rgb sky, sun;
    double pdf;
    bool inside;
  };
  std::vector<Value> evaluate(const std::vector<Vec3>& directions) const {
    const auto out = launch("evaluate", directions, 8, 0);
    std::vector<Value> values;
    for (const auto& v : out) values.push_back({{v[0], v[1], v[2]}, {v[3], v[4], v[5]}, v[6], v[7] != 0});
    return values;
  }

  struct Sample {
    Vec3 direction;
    Rgb radiance;
    double pdf;
  };
  std::vector<Sample> sample(const std::vector<Vec2>& u, bool of_sun) const {
    const auto out = launch("sample", u, 7, of_sun);
    std::vector<Sample> samples;
    for (const auto& v : out) samples.push_back({{v[0], v[1], v[2]}, {v[3], v[4], v[5]}, v[6]});
    return samples;
  }

  EmitterRecord record;
  std::vector<float> tables;

 private:
  template <class In>
  std::vector<std::array<float, 8>> launch(const char* name, const std::vector<In>& in, std::size_t outputs,
                                           int argument) const {
    const auto groups = (in.size() + static_cast<std::size_t>(width_) - 1) / static_cast<std::size_t>(width_);
    const auto n = groups * static_cast<std::size_t>(width_);
    std::vector<float> flat(n * std::tuple_size_v<In>), result(n * outputs);
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t c = 0; c < std::tuple_size_v<In>; ++c)
        flat[c * n + i] = static_cast<float>(in[std::min(i, in.size() - 1)][c]);
    const cl::Buffer from = device_.upload(flat, "in"), to = device_.upload(result, "out");
    cl::Kernel kernel(program_, name);
    kernel.setArg(0, record_);
    kernel.setArg(1, tables_);
    kernel.setArg(2, from);
    kernel.setArg(3, to);
    if (std::string(name) == "sample") kernel.setArg(4, argument);
    device_.launch(kernel, groups);
    device_.finish();
    device_.download(to, result);
    std::vector<std::array<float, 8>> rows(in.size());
    for (std::size_t i = 0; i < in.size(); ++i)
      for (std::size_t c = 0; c < outputs; ++c) rows[i][c] = result[c * n + i];
    return rows;
  }

  int width_;
  Device device_;
  cl::Program program_;
  cl::Buffer record_, tables_;
};

std::vector<Vec3> random_directions(std::size_t n, unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  std::vector<Vec3> directions(n);
  for (auto& d : directions) {
    for (auto& x : d) x = normal(generator);
    const double length = std::hypot(d[0], d[1], d[2]);
    for (auto& x : d) x /= length;
  }
  return directions;
}

// Uniform numbers as the device makes them: multiples of 2^-24 in [0, 1).
std::vector<Vec2> random_numbers(std::size_t n, unsigned seed) {
  std::mt19937 generator(seed);
  std::vector<Vec2> u(n);
  for (auto& v : u)
    for (auto& x : v) x = static_cast<double>(generator() >> 8) * 0x1p-24;
  return u;
}

const int widths[] = {1, 16};

}  // namespace

TEST_CASE("constant light is the same from everywhere and sampled uniformly") {
  Emitter emitter;
  emitter.radiance = {0.5, 1, 2};
  for (const int width : widths) {
    const OnDevice light(emitter, width);
    for (const auto& value : light.evaluate(random_directions(33, 1))) {
      for (std::size_t c = 0; c < 3; ++c) {
        REQUIRE(value.sky[c] == emitter.radiance[c]);
        REQUIRE(value.sun[c] == 0);
      }
      REQUIRE(!value.inside);
      REQUIRE(value.pdf == Approx(1 / (4 * pi)));
    }
    Vec3 mean{}, square{};
    const std::size_t n = 20000;
    for (const auto& s : light.sample(random_numbers(n, 2), false)) {
      REQUIRE(std::hypot(s.direction[0], s.direction[1], s.direction[2]) == Approx(1).epsilon(1e-6));
      REQUIRE(s.pdf == Approx(1 / (4 * pi)));
      REQUIRE(s.radiance == emitter.radiance);
      for (std::size_t c = 0; c < 3; ++c) {
        mean[c] += s.direction[c] / n;
        square[c] += s.direction[c] * s.direction[c] / n;
      }
    }
    for (std::size_t c = 0; c < 3; ++c) {
      CHECK(std::abs(mean[c]) < 5 * std::sqrt(1.0 / 3 / n));               // variance 1/3
      CHECK(std::abs(square[c] - 1.0 / 3) < 5 * std::sqrt(4.0 / 45 / n));  // variance 1/5 - 1/9
    }
  }
}
