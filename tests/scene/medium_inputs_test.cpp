// Media by scattering and absorption coefficients (kernels/model/medium/by_scattering.h): what scene files say, the
// numbers that it comes to, and their derivatives.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "itn/model.h"
#include "itn/parameters.h"
#include "tests/scene/scene_folder.h"

using namespace itn;

namespace {

std::string medium(const std::string& type, const std::string& content) {
  return "<medium type=\"" + type + "\" id=\"m\">\n" + content + "</medium>";
}
std::string number(const std::string& name, const std::string& value) {
  return "<float name=\"" + name + "\" value=\"" + value + "\"/>";
}
std::string colour(const std::string& name, const std::string& value) {
  return "<rgb name=\"" + name + "\" value=\"" + value + "\"/>";
}

std::vector<double> numbers_of(const Medium& m) { return m.model->to_numbers(m.variant, m.slots()); }

void check_numbers(const Medium& m, const Rgb& sigma_t, const Rgb& albedo) {
  const std::vector<double> n = numbers_of(m);
  REQUIRE(n.size() == 6);
  for (std::size_t c = 0; c < 3; ++c) {
    CHECK(n[c] == Approx(sigma_t[c]).epsilon(1e-12).margin(0));
    CHECK(n[3 + c] == Approx(albedo[c]).epsilon(1e-12).margin(0));
  }
}

}  // namespace

TEST_CASE("scattering and absorption coefficients are the medium of their sum and share") {
  SceneFolder folder;
  const Medium m =
      folder.load(medium("homogeneous", colour("sigma_s", "1 2 0") + colour("sigma_a", "3 0 0") + number("scale", "2")))
          .media.at(0);
  CHECK(m.type() == "homogeneous");
  check_numbers(m, {8, 4, 0}, {0.25, 1, 0});
  const Medium grid =
      folder.load(medium("heterogeneous", number("sigma_s", "3") + number("sigma_a", "1") + number("density", "0.5")))
          .media.at(0);
  check_numbers(grid, {2, 2, 2}, {0.75, 0.75, 0.75});
  CHECK(grid.value("density").volume);  // bounds it, as sigma_t would
}

TEST_CASE("reduced scattering takes the mean cosine of any phase function, and follows it") {
  SceneFolder folder;
  const std::string reduced = number("sigma_s_prime", "2") + number("sigma_a", "1");
  Scene scene =
      folder.load(medium("homogeneous", reduced + "<phase type=\"hg\" id=\"h\">" + number("g", "0.75") + "</phase>"));
  check_numbers(scene.media.at(0), {9, 9, 9}, {8.0 / 9, 8.0 / 9, 8.0 / 9});
  set_parameter(scene, find_parameter(list_parameters(scene), "h.g"), 0.5);
  check_numbers(scene.media[0], {5, 5, 5}, {0.8, 0.8, 0.8});
  check_numbers(folder.load(medium("homogeneous", reduced)).media.at(0), {3, 3, 3}, {2.0 / 3, 2.0 / 3, 2.0 / 3});
  const std::string mixed = "<phase type=\"blendphase\"><float name=\"weight\" value=\"0.25\"/><phase type=\"hg\">" +
                            number("g", "0.5") + "</phase><phase type=\"hg\">" + number("g", "-0.5") +
                            "</phase></phase>";
  check_numbers(folder.load(medium("homogeneous", reduced + mixed)).media.at(0), {11.0 / 3, 11.0 / 3, 11.0 / 3},
                {8.0 / 11, 8.0 / 11, 8.0 / 11});
}

TEST_CASE("parameters are those that the file gives, and the mean cosine is none of them") {
  SceneFolder folder;
  const Scene scene = folder.load(
      medium("homogeneous", colour("sigma_s_prime", "1 1 1") + number("sigma_a", "0") + "<phase type=\"hg\"/>"));
  std::vector<std::string> names;
  for (const Parameter& p : list_parameters(scene))
    if (!is_of_light(p)) names.push_back(p.name);
  CHECK(names == std::vector<std::string>{"m.sigma_s_prime.R", "m.sigma_s_prime.G", "m.sigma_s_prime.B", "m.sigma_a",
                                          "m.scale", "hg0.g"});
  for (const Parameter& p : list_parameters(scene)) CHECK(p.not_differentiable.empty());
  // Nothing scatters: an albedo of 0 would have to grow, but absorption may change.
  const Scene dark = folder.load(medium("homogeneous", number("sigma_s", "0") + number("sigma_a", "2")));
  CHECK_FALSE(find_parameter(list_parameters(dark), "m.sigma_s").not_differentiable.empty());
  CHECK(find_parameter(list_parameters(dark), "m.sigma_a").not_differentiable.empty());
  const Scene empty = folder.load(medium("homogeneous", number("sigma_s", "0") + number("sigma_a", "0")));
  CHECK_FALSE(find_parameter(list_parameters(empty), "m.sigma_a").not_differentiable.empty());
}

TEST_CASE("dual numbers give the derivatives of the medium's numbers by the coefficients") {
  for (const Model& model : medium_inputs()) {
    INFO(model.parameters[0].name << " of " << model.type);
    std::vector<double> at(static_cast<std::size_t>(model.parameter_slots));
    for (std::size_t i = 0; i < at.size(); ++i) at[i] = 0.3 + 0.11 * static_cast<double>(i);
    if (model.mean_cosine_slot() >= 0) at[static_cast<std::size_t>(model.mean_cosine_slot())] = 0.6;
    const auto by = model.jacobian(0, at);
    for (std::size_t k = 0; k < at.size(); ++k) {
      const double h = 1e-5;
      std::vector<double> low = at, high = at;
      low[k] -= h;
      high[k] += h;
      const std::vector<double> below = model.to_numbers(0, low), above = model.to_numbers(0, high);
      for (std::size_t i = 0; i < by.size(); ++i)
        CHECK(by[i][k] == Approx((above[i] - below[i]) / (2 * h)).epsilon(1e-7).margin(1e-9));
    }
  }
}

TEST_CASE("coefficients that contradict each other are refused where they stand") {
  SceneFolder folder;
  const auto check = [&](const std::string& content, int line, const std::vector<std::string>& words) {
    folder.check_error(medium("homogeneous", content), line, words);
  };
  check(number("sigma_s", "1") + "\n" + number("sigma_a", "1") + "\n" + number("sigma_t", "1"), 5,
        {"both sigma_s and sigma_t", "need sigma_t and albedo, or sigma_s and sigma_a"});
  check(number("sigma_s", "1") + number("sigma_a", "1") + "\n" + number("albedo", "1"), 4, {"sigma_s and albedo"});
  check(number("sigma_s_prime", "1") + number("sigma_a", "1") + "\n" + number("sigma_s", "1"), 3,
        {"both sigma_s and sigma_s_prime"});
  check(number("sigma_s", "1"), 2, {"sigma_s without sigma_a"});
  check(number("sigma_a", "1"), 3, {"sigma_a without sigma_s"});
  check(number("sigma_s", "-1") + number("sigma_a", "1"), 3, {"sigma_s = -1"});
  check(number("sigma_s", "1") + number("sigma_a", "1") + "\n" + number("density", "1"), 4, {"density"});
  folder.check_error(
      medium("heterogeneous", number("sigma_a", "1") +
                                  "\n<volume type=\"gridvolume\" name=\"sigma_s\"><string name=\"filename\" "
                                  "value=\"g.vol\"/></volume>"),
      4, {"sigma_s is the same everywhere", "\"density\""});
}
