// Single numbers of radiative transfer, solved without random numbers (data/transport.json), against
// scenes/test/slab_*.xml and sphere_*.xml. In the suite at a relative standard error of 1 %; `test_transport "[.long]"`
// asks 0.1 % of every row and prints the table of README.md.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdio>

#include "../support/z_test.h"
#include "reference_rows.h"

using namespace itn;
using namespace itn::test;
using nlohmann::json;

namespace {

std::vector<Row> sphere_rows(bool all) {
  std::vector<Row> rows;
  for (const json& row : reference_data().at("sphere_uniform_env"))
    for (const char* b : {"0.0", "0.25", "0.5", "0.75", "0.9"}) {
      if (!all && b != std::string("0.0") && b != std::string("0.75")) continue;
      rows.push_back(sphere_row(row, b, row.at("value").at("b" + std::string(b)).get<double>()));
    }
  return rows;
}

std::vector<Row> slab_rows(const char* part, bool all) {
  std::vector<Row> rows;
  for (const json& row : reference_data().at(part))
    for (const char* theta : {"0", "30", "60", "75"})
      for (const char which : {'R', 'T'}) {
        if (!all && theta != std::string("0") && theta != std::string("60")) continue;
        if (which == 'T' && row.at("tau") == "inf") continue;
        rows.push_back(slab_row(row, which, theta, row.at("value").at(which + std::string(theta)).get<double>()));
      }
  return rows;
}

std::vector<Row> halfspace_rows(bool all) {
  std::vector<Row> rows;
  for (json row : reference_data().at("halfspace_isotropic"))
    for (const char* theta : {"0", "30", "60", "75"}) {
      if (!all && theta != std::string("0") && theta != std::string("75")) continue;
      row["tau"] = "inf";
      Row result = slab_row(row, 'R', theta, row.at("R_dir_hemi_at_deg").at(theta).get<double>());
      result.what = "half-space albedo " + number(row.at("albedo")) + " (Chandrasekhar), R" + theta;
      result.definitions["light"] = "uniform";
      rows.push_back(result);
    }
  return rows;
}

std::vector<Row> single_rows(bool) {
  std::vector<Row> rows;
  for (const json& row : reference_data().at("single_scatter"))
    for (const char which : {'R', 'T'}) {
      if (which == 'T' && row.at("tau") == "inf") continue;
      Row result = slab_row(row, which, number(row.at("theta_deg")), row.at(std::string(1, which)).get<double>());
      result.what = "single scattering, " + result.what;
      result.op = Operator::single;
      rows.push_back(result);
    }
  return rows;
}

// At most k scatterings: the sum over j <= k of albedo^j c_j.
std::vector<Row> order_rows(bool all) {
  std::vector<Row> rows;
  for (json row : reference_data().at("scattering_orders")) {
    if (row.at("n") != 1.0) continue;
    const double albedo = 0.9;
    row["albedo"] = albedo;
    for (const char* theta : {"0", "60"})
      for (const char which : {'R', 'T'}) {
        const std::vector<double> c = row.at("orders").at(which + std::string(theta)).get<std::vector<double>>();
        double sum = 0;
        for (std::size_t k = 0; k < c.size(); ++k) {
          sum += std::pow(albedo, static_cast<double>(k)) * c[k];
          const bool wanted = all || k == 1 || k == 4;
          if (!wanted || sum < 1e-10) continue;  // nothing is reflected without scattering
          Row result = slab_row(row, which, theta, sum);
          result.what = "at most " + std::to_string(k) + " scatterings, " + result.what;
          result.definitions["max_depth"] = std::to_string(k + 1);
          rows.push_back(result);
        }
      }
  }
  return rows;
}

// seed: another one for each row, or chance would push all rows the same way.
Estimate measure(const Row& row, double relative_stderr, std::uint64_t seed) {
  const Scene scene = load_scene(test_scene(row.scene), row.definitions);
  RenderOptions options;
  options.op = row.op;
  options.spp = 64;
  options.seed = 2 * seed;
  const Estimate pilot = image_mean(render(device(), scene, options));
  // A number of samples fixed before the run that counts: stopping at a good moment would bias it.
  const double missing = pilot.stderr_ / (relative_stderr * row.expected);
  options.spp = std::clamp(static_cast<int>(64 * 1.2 * missing * missing), 64, 1 << 18);
  options.seed = 2 * seed + 1;
  return image_mean(render(device(), scene, options));
}

void compare(const char* title, const std::vector<Row>& rows, double relative_stderr) {
  std::printf("\n%s: %zu rows\n| row | value | reference | relative standard error | z |\n|---|---|---|---|---|\n",
              title, rows.size());
  double largest = 0, sum = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Row& row = rows[i];
    INFO(row.what);
    const Estimate estimate = measure(row, relative_stderr, 4 + i);
    const double z = z_score(estimate, row.expected);
    std::printf("| %s | %.6f | %.6f | %.3f %% | %.2f |\n", row.what.c_str(), estimate.value, row.expected,
                100 * estimate.stderr_ / row.expected, z);
    std::fflush(stdout);
    largest = std::max(largest, std::abs(z));
    sum += z * z;
    CHECK(estimate.stderr_ < 1.5 * relative_stderr * row.expected);
    CHECK(std::abs(z) < largest_z_bound(rows.size(), 0.0027));
  }
  const auto count = static_cast<int>(rows.size());
  const double p = chi_square_tail(sum, count);
  std::printf("largest |z| %.2f, sum of z^2 %.1f over %d rows (p = %.3g)\n", largest, sum, count, p);
  CHECK(p > 1e-4);
}

}  // namespace

TEST_CASE("a sphere in uniform light matches the deterministic solution", "[transport][stat]") {
  compare("spheres", sphere_rows(false), 0.01);
}
TEST_CASE("slabs reflect and transmit what the deterministic solution says", "[transport][stat]") {
  compare("slabs", slab_rows("slab", false), 0.01);
}
TEST_CASE("a half-space reflects what Chandrasekhar's H says", "[transport][stat]") {
  compare("half-spaces", halfspace_rows(false), 0.01);
}
TEST_CASE("operator single renders light scattered exactly once", "[transport][stat]") {
  compare("single scattering", single_rows(false), 0.01);
}
TEST_CASE("max_depth k + 1 renders light scattered at most k times", "[transport][stat]") {
  compare("scattering orders", order_rows(false), 0.01);
}
TEST_CASE("rough slabs match the deterministic solution", "[transport][stat]") {
  compare("rough slabs", slab_rows("rough_slab", false), 0.01);
}

// Every row at a relative standard error of 0.1 %: half an hour and more.
TEST_CASE("spheres to 0.1 %", "[.long]") { compare("spheres", sphere_rows(true), 0.001); }
TEST_CASE("slabs to 0.1 %", "[.long]") { compare("slabs", slab_rows("slab", true), 0.001); }
TEST_CASE("half-spaces to 0.1 %", "[.long]") { compare("half-spaces", halfspace_rows(true), 0.001); }
TEST_CASE("single scattering to 0.1 %", "[.long]") { compare("single scattering", single_rows(true), 0.001); }
TEST_CASE("scattering orders to 0.1 %", "[.long]") { compare("scattering orders", order_rows(true), 0.001); }
TEST_CASE("rough slabs to 0.1 %", "[.long]") { compare("rough slabs", slab_rows("rough_slab", true), 0.001); }
