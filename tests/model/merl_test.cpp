// Measured surfaces: where directions are in the table, against the angles as Rusinkiewicz defines them; what files
// say.
#include "kernels/model/bsdf/merl.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>

#include "../support/merl_file.h"
#include "itn/error.h"
#include "itn/file.h"
#include "itn/measured_brdf.h"
#include "tests/scene/scene_folder.h"

using namespace itn;
using namespace itn::test;

namespace {

using Direction = Vector3<double>;

Direction direction(double theta, double phi) {
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

// About the z or the y axis.
Direction turned_z(const Direction& v, double by) {
  return {v.x * std::cos(by) - v.y * std::sin(by), v.x * std::sin(by) + v.y * std::cos(by), v.z};
}
Direction turned_y(const Direction& v, double by) {
  return {v.x * std::cos(by) + v.z * std::sin(by), v.y, -v.x * std::sin(by) + v.z * std::cos(by)};
}

struct Angles {
  double half, difference, azimuth;
};

// Rusinkiewicz 1998, section 2: wi, turned by what turns the half vector to the normal.
Angles angles(const Direction& wi, const Direction& wo) {
  const Direction sum = add3(wi, wo);
  const double theta = std::acos(sum.z / std::sqrt(dot3(sum, sum))), phi = std::atan2(sum.y, sum.x);
  const Direction d = turned_y(turned_z(wi, -phi), -theta);
  return {theta, std::acos(std::min(1.0, d.z)), std::atan2(d.y, d.x)};
}

// A gloss (GGX, alpha) over paint, the same for all azimuths but for a share of it.
std::array<double, 3> painted(double half, double difference, double azimuth) {
  constexpr double alpha = 0.25, s = alpha * alpha;
  const double c = std::cos(half), k = c * c * (s - 1) + 1;
  const double gloss = 0.1 * s / (PI_ * k * k) * (1 + 0.3 * std::sin(difference) * std::cos(2 * azimuth));
  return {0.5 / PI_ + gloss, 0.2 / PI_ + gloss, 0.1 / PI_ + 0.5 * gloss};
}

const std::string& painted_bytes() {
  static const std::string bytes = merl_bytes(painted);
  return bytes;
}

std::string bsdf(const std::string& more = "") {
  return "<bsdf type=\"merl\" id=\"m\">\n<string name=\"filename\" value=\"m.binary\"/>" + more + "</bsdf>";
}

template <class Number>
std::string with(std::string bytes, std::size_t at, Number number) {
  std::memcpy(bytes.data() + at, &number, sizeof(number));
  return bytes;
}

void check_bad_file(const std::string& bytes, const std::vector<std::string>& words) {
  SceneFolder folder;
  folder.write("m.binary", bytes);
  folder.check_error(bsdf(), 3, words);
}

}  // namespace

TEST_CASE("directions are in a measured table where Rusinkiewicz's angles are", "[model]") {
  std::mt19937_64 generator(7);
  std::uniform_real_distribution<double> uniform(0, 1);
  double worst = 0;
  for (int i = 0; i < 2000; ++i) {
    const Direction wi = direction(std::acos(uniform(generator)), 2 * PI_ * uniform(generator)),
                    wo = direction(std::acos(uniform(generator)), 2 * PI_ * uniform(generator));
    const Angles at = angles(wi, wo);
    double place[3], swapped[3];
    merl_place(wi, wo, place);
    merl_place(wo, wi, swapped);
    worst = std::max(worst, std::abs(place[0] - 90 * std::sqrt(at.half / (PI_ / 2))));
    worst = std::max(worst, std::abs(place[1] - 90 * at.difference / (PI_ / 2)));
    double turn = at.azimuth * 180 / PI_;
    if (turn < 0) turn += 180;
    for (const double other : {turn, std::fmod(turn + 0.5, 180.0) - 0.5})  // 0 and 180 are one
      if (std::abs(place[2] - other) < 90)
        worst = std::max(worst, std::abs(place[2] - other) * std::sin(at.difference));
    for (std::size_t k = 0; k < 2; ++k) worst = std::max(worst, std::abs(place[k] - swapped[k]));
    const double apart = std::abs(place[2] - swapped[2]);  // reciprocal: the same place
    worst = std::max(worst, std::min(apart, 180 - apart) * std::sin(at.difference));
  }
  CHECK(worst < 1e-5);
}

TEST_CASE("a measured table gives back what was measured, and a sampler that suits it", "[model]") {
  SceneFolder folder;
  folder.write("m.binary", painted_bytes());
  const MeasuredBrdf table = read_merl_file(folder.path("m.binary"));
  for (const int h : {0, 20, 70})
    for (const int d : {0, 10, 60})
      for (const int p : {0, 50, 179}) {  // centres of bins
        const double half = PI_ / 2 * (h + 0.5) / 90 * (h + 0.5) / 90, difference = PI_ / 180 * (d + 0.5),
                     azimuth = PI_ / 180 * (p + 0.5);
        for (std::size_t c = 0; c < 3; ++c)
          CHECK(measured_value(table, half, difference, azimuth)[c] ==
                Approx(painted(half, difference, azimuth)[c]).epsilon(1e-6));
      }
  std::mt19937_64 generator(5);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int i = 0; i < 300; ++i) {  // between them
    const double half = 1.4 * uniform(generator), difference = 1.4 * uniform(generator),
                 azimuth = PI_ * (2 * uniform(generator) - 1);
    CHECK(measured_value(table, half, difference, azimuth)[0] ==
          Approx(painted(half, difference, azimuth)[0]).epsilon(2e-3));
  }
  CHECK(table.alpha == Approx(0.25).epsilon(0.15));
  CHECK(table.gloss > 0.1);
  CHECK(table.gloss < 0.6);
}

TEST_CASE("a measured BSDF arrives with everything that its scene says", "[model]") {
  SceneFolder folder;
  folder.write("m.binary", painted_bytes());
  const Scene scene = folder.load("<shape type=\"sphere\">" + bsdf("<float name=\"scale\" value=\"0.8\"/>") +
                                  "</shape>\n<shape type=\"disk\"><bsdf type=\"dictionary\"><string name=\"weights\" "
                                  "value=\"1, 3\"/><bsdf type=\"merl\"><string name=\"filename\" value=\"m.binary\"/>"
                                  "</bsdf><bsdf type=\"diffuse\"/></bsdf></shape>");
  const auto measured = std::find_if(scene.bsdfs.begin(), scene.bsdfs.end(), [](const Bsdf& b) { return b.id == "m"; });
  REQUIRE(measured != scene.bsdfs.end());
  CHECK(measured->number("scale") == 0.8);
  CHECK(measured->number("alpha") == Approx(0.25).epsilon(0.15));
  const std::shared_ptr<const MeasuredBrdf> table = measured->value("table").measured;
  REQUIRE(table);
  for (const Bsdf& b : scene.bsdfs)  // one file, one table
    for (const Texture& value : b.values) CHECK((!value.measured || value.measured == table));
}

TEST_CASE("damaged tables are refused with what is wrong", "[model]") {
  const std::string& whole = painted_bytes();
  check_bad_file("", {"m.binary", "header"});
  check_bad_file(whole.substr(0, 11), {"header"});
  check_bad_file(with(whole, 4, std::int32_t{45}), {"90 x 45 x 180", "need 90 x 90 x 180"});
  check_bad_file(with(whole, 0, std::int32_t{-1}), {"-1 x 90 x 180"});
  check_bad_file(whole.substr(0, whole.size() - 1), {"copy the whole file"});
  check_bad_file(with(whole, 12 + 8 * 77, std::numeric_limits<double>::quiet_NaN()), {"value 77", "R", "nan"});
  check_bad_file(with(whole, 12 + 8 * (MERL_BINS + 5), 1e300), {"value 5", "G", "1e+300"});
  check_bad_file(merl_bytes([](double, double, double) {
                   return std::array<double, 3>{-1, -1, -1};
                 }),
                 {"not measured"});
  SceneFolder folder;
  folder.check_error(bsdf(), 3, {"no such file", "m.binary"});
  folder.check_error("<bsdf type=\"merl\"/>", 2, {"filename"});
  folder.write("m.binary", whole);
  folder.check_error(bsdf("<float name=\"scale\" value=\"-1\"/>"), 3, {"scale = -1"});
  // what nobody has measured is dark
  folder.write("m.binary", with(whole, 12, -1.0));
  CHECK(read_merl_file(folder.path("m.binary")).values[0] == 0);
}
