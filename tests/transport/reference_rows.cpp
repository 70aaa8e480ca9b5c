#include "reference_rows.h"

#include <algorithm>
#include <cstdio>
#include <fstream>

namespace itn::test {

using nlohmann::json;

const json& reference_data() {
  static const json file = json::parse(std::ifstream(ITN_SOURCE_DIR "/tests/transport/data/transport.json"));
  return file;
}

std::string number(const json& value) {
  if (value.is_string()) return value.get<std::string>();
  char text[32];
  std::snprintf(text, sizeof text, "%g", value.get<double>());
  return text;
}

namespace {

// Optically so thick (diffuse light reaches 18 mean free paths at most in our rows) that nothing comes through.
std::string optical_thickness(const json& tau) { return tau == "inf" ? "200" : number(tau); }

Definitions material(const json& row, const std::string& sigma_t) {
  const double albedo = row.at("albedo").get<double>();
  // Roulette, which is tested elsewhere, only adds noise where next to nothing is absorbed.
  return {{"sigma_t", sigma_t},
          {"albedo", number(row.at("albedo"))},
          {"g", row.contains("g") ? number(row.at("g")) : "0"},
          {"rr_depth", albedo >= 0.99 ? "1000000" : "20"}};
}

std::string describe(const json& row, const std::string& sigma_t) {
  std::string text = "sigma_t " + sigma_t + ", albedo " + number(row.at("albedo"));
  if (row.contains("g")) text += ", g " + number(row.at("g"));
  if (row.contains("n")) text += ", n " + number(row.at("n"));
  return text;
}

}  // namespace

Row sphere_row(const json& row, const std::string& b, double expected) {
  const bool matched = row.at("n") == 1.0;
  Row result{"sphere " + describe(row, number(row.at("sigma_t"))) + ", b " + b,
             matched ? "sphere_matched.xml" : "sphere_dielectric.xml", material(row, number(row.at("sigma_t"))),
             Operator::full, expected};
  result.definitions["b"] = b;
  if (!matched) result.definitions["n"] = number(row.at("n"));
  return result;
}

Row slab_row(const json& row, char which, const std::string& theta, double expected) {
  const std::string sigma_t = optical_thickness(row.at("tau"));
  Row result{"slab " + describe(row, sigma_t) + ", " + which + theta, "slab_matched.xml", material(row, sigma_t),
             Operator::full, expected};
  result.definitions["theta"] = theta;
  // 400 mean free paths, and no wider: a surface is only as sharp as single precision at its largest coordinate, and a
  // width of 400 would blur it by 2 % of a mean free path at sigma_t 200 (kernels/README.md, "Known limits").
  result.definitions["half_width"] = number(std::min(200.0, 400 / std::stod(sigma_t)));
  result.definitions["below"] = which == 'T' ? "180" : "0";
  if (row.contains("n") && row.at("n") != 1.0) {
    result.definitions["n"] = number(row.at("n"));
    result.scene = "slab_dielectric.xml";
  }
  if (row.contains("alpha_ggx")) {
    result.definitions["alpha"] = number(row.at("alpha_ggx"));
    result.scene = "slab_rough.xml";
    result.what = "rough " + result.what + ", alpha " + number(row.at("alpha_ggx"));
  }
  return result;
}

}  // namespace itn::test
