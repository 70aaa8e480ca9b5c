// Derivatives of spheres' and slabs' radiance against the deterministic solutions (data/transport.json), and identities
// that they obey. In the suite at a relative standard error of 3 % for some rows; `test_transport "[.derivatives]"`
// asks 0.5 % of every row that two million samples can tell so well, and prints the table of README.md.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdio>
#include <map>

#include "../support/z_test.h"
#include "itn/parameters.h"
#include "reference_rows.h"
#include "samples.h"

using namespace itn;
using namespace itn::test;
using nlohmann::json;

namespace {

struct Expected {
  std::string parameter;
  double value = 0, uncertainty = 0;  // uncertainty: of the reference
};

struct DerivativeRow {
  Row row;
  std::vector<Expected> expected;
};

// d: of the row's value by each of the reference's parameters, for what is seen ("R60", "b0.75").
DerivativeRow with_derivatives(const Row& row, const json& d, const std::string& seen) {
  DerivativeRow result{row, {}};
  const auto add = [&](const char* of_reference, const char* parameter, double uncertainty) {
    if (d.contains(of_reference))
      result.expected.push_back({parameter, d.at(of_reference).at(seen).get<double>(), uncertainty});
  };
  add("sigma_t", "medium.sigma_t", 0);
  add("tau", "medium.sigma_t", 0);  // the slabs' thickness is 1
  // By an albedo of 0 the renderer does not differentiate.
  if (row.definitions.at("albedo") != "0") add("albedo", "medium.albedo", 0);
  add("g", "hg0.g", 0);
  add("alpha", "roughdielectric0.alpha", 2e-5);
  add("n", "roughdielectric0.int_ior", 5e-4);
  return result;
}

std::vector<DerivativeRow> sphere_rows(const std::vector<std::string>& distances) {
  std::vector<DerivativeRow> rows;
  for (const json& row : reference_data().at("sphere_uniform_env"))
    for (const std::string& b : distances)
      rows.push_back(
          with_derivatives(sphere_row(row, b, row.at("value").at("b" + b).get<double>()), row.at("d"), "b" + b));
  return rows;
}

std::vector<DerivativeRow> slab_rows(const char* part, const std::vector<std::string>& angles) {
  std::vector<DerivativeRow> rows;
  for (const json& row : reference_data().at(part))
    for (const std::string& theta : angles)
      for (const char which : {'R', 'T'}) {
        if (which == 'T' && row.at("tau") == "inf") continue;
        const std::string seen = which + theta;
        rows.push_back(
            with_derivatives(slab_row(row, which, theta, row.at("value").at(seen).get<double>()), row.at("d"), seen));
      }
  return rows;
}

std::vector<DerivativeRow> halfspace_rows() {
  std::vector<DerivativeRow> rows;
  for (json row : reference_data().at("halfspace_isotropic"))
    for (const char* theta : {"0", "60"}) {
      row["tau"] = "inf";
      Row scene = slab_row(row, 'R', theta, row.at("R_dir_hemi_at_deg").at(theta).get<double>());
      scene.what = "half-space albedo " + number(row.at("albedo")) + " (Chandrasekhar), R" + theta;
      scene.definitions["light"] = "uniform";
      rows.push_back(with_derivatives(scene, row.at("d"), theta));
    }
  return rows;
}

std::vector<DerivativeRow> single_rows() {
  std::vector<DerivativeRow> rows;
  for (const json& row : reference_data().at("single_scatter"))
    for (const char which : {'R', 'T'}) {
      if (row.at("tau") == "inf") continue;
      const std::string seen(1, which);
      Row scene = slab_row(row, which, number(row.at("theta_deg")), row.at(seen).get<double>());
      scene.what = "single scattering, " + scene.what;
      scene.op = Operator::single;
      rows.push_back(with_derivatives(scene, row.at("d"), seen));
    }
  return rows;
}

struct Precision {
  double relative_stderr;
  double most_samples;  // of a row; where they do not suffice the row counts as not tested
};

// Rows of one scene file that differentiate by the same parameters share one program.
class Comparison {
 public:
  Comparison(const char* title, Precision precision) : precision_(precision) {
    std::printf("\n%s\n| row | parameter | derivative | reference | standard error | z |\n|---|---|---|---|---|---|\n",
                title);
  }

  void add(const std::vector<DerivativeRow>& rows) {
    std::vector<Scene> scenes;
    std::vector<std::uint64_t> seeds;
    std::vector<std::string> names;
    for (const Expected& e : rows.front().expected) names.push_back(e.parameter);
    for (const DerivativeRow& r : rows) {
      scenes.push_back(load_scene(test_scene(r.row.scene), r.row.definitions));
      seeds.push_back(++seed_);  // another one for each row, or chance would push all rows the same way
    }
    SampledScenes sampled(scenes, names, rows.front().row.op, seeds, Shapes::own);
    for (std::size_t i = 0; i < rows.size(); ++i) compare(rows[i], sampled, static_cast<int>(i));
  }

  // least_share: of the derivatives so many at least must be known to the precision asked for. The others only rule out
  // errors of several of their standard errors, however large these are.
  void finish(double least_share) const {
    std::size_t count = 0;
    for (const auto& [parameter, z] : z_) count += z.size();
    for (const auto& [parameter, z] : z_) {
      double largest = 0, sum = 0;
      for (const double value : z) {
        largest = std::max(largest, std::abs(value));
        sum += value * value;
      }
      // The parameters of a row share its samples: independent are only the rows of one parameter.
      const double p = chi_square_tail(sum, static_cast<int>(z.size()));
      std::printf("%s: %zu rows, largest |z| %.2f, sum of z^2 %.1f (p = %.3g)\n", parameter.c_str(), z.size(), largest,
                  sum, p);
      INFO(parameter);
      CHECK(largest < largest_z_bound(count, 0.0027));
      CHECK(p > 1e-4);
    }
    std::printf(
        "to %.1f %% tested: %d of %zu derivatives (largest standard error %.3g %%); %d vanish; noise forbids %d\n",
        100 * precision_.relative_stderr, tested_, count, 100 * worst_, vanishing_, noisy_);
    CHECK(tested_ >= least_share * static_cast<double>(count));
  }

 private:
  static void add_samples(SampledScenes& sampled, int scene, int first, int count, std::vector<Moments>& moments) {
    const std::vector<float> samples = sampled.trace({scene}, first, count);
    const std::size_t channels = sampled.channels(), images = sampled.images();
    for (std::size_t s = 0; s < samples.size(); s += images * channels)
      for (std::size_t i = 1; i < images; ++i)
        moments[i - 1].add(static_cast<double>(samples[s + i * channels]));  // all channels are alike
  }

  void compare(const DerivativeRow& row, SampledScenes& sampled, int scene) {
    const int pixels = sampled.pixels(scene);
    constexpr int pilot = 32, run = 64;
    std::vector<Moments> guess(row.expected.size()), moments(row.expected.size());
    add_samples(sampled, scene, 0, pilot, guess);
    // A number of samples fixed before the run that counts: stopping at a good moment would bias it.
    double needed = 1;
    for (std::size_t i = 0; i < guess.size(); ++i) {
      const double of_one = guess[i].estimate().stderr_ * std::sqrt(guess[i].count());
      const double samples = std::pow(of_one / (precision_.relative_stderr * row.expected[i].value), 2) * 1.2;
      needed = std::max(needed, std::min(samples, precision_.most_samples));
    }
    const int samples_a_pixel = static_cast<int>(needed / pixels) + 1;
    for (int done = 0; done < samples_a_pixel; done += run)
      add_samples(sampled, scene, pilot + done, std::min(run, samples_a_pixel - done), moments);
    for (std::size_t i = 0; i < moments.size(); ++i) {
      const Expected& e = row.expected[i];
      Estimate estimate = moments[i].estimate();
      if (e.value == 0 && estimate.stderr_ == 0) {  // g where nothing scatters
        CHECK(estimate.value == 0);
        continue;
      }
      const double relative = estimate.stderr_ / std::abs(e.value);  // infinite where 0 is expected
      const bool vanishes = e.value == 0, noisy = !vanishes && relative > 1.5 * precision_.relative_stderr;
      vanishing_ += vanishes;
      noisy_ += noisy;
      if (!noisy && !vanishes) {
        ++tested_;
        worst_ = std::max(worst_, relative);
      }
      // If nothing is absorbed, baselines leave no noise, only the rounding of scores of order 1.
      constexpr double rounding = 1e-6;
      estimate.stderr_ = std::hypot(estimate.stderr_, e.uncertainty, rounding);
      const double z = z_score(estimate, e.value);
      z_[e.parameter].push_back(z);
      std::printf("| %s | %s | %.6f | %.6f | %.2f %%%s | %.2f |\n", row.row.what.c_str(), e.parameter.c_str(),
                  estimate.value, e.value, 100 * relative, noisy ? " (not tested: noise)" : "", z);
    }
    std::fflush(stdout);
  }

  Precision precision_;
  std::uint64_t seed_ = 100;
  std::map<std::string, std::vector<double>> z_;
  int tested_ = 0, noisy_ = 0, vanishing_ = 0;
  double worst_ = 0;
};

// Rows that one program can render: same scene file, operator and parameters.
void compare(const char* title, const std::vector<DerivativeRow>& rows, Precision precision, double least_share) {
  std::map<std::string, std::vector<DerivativeRow>> groups;
  for (const DerivativeRow& r : rows) {
    if (r.expected.empty()) continue;
    std::string key = r.row.scene + (r.row.op == Operator::single ? " single" : "");
    for (const Expected& e : r.expected) key += " " + e.parameter;
    groups[key].push_back(r);
  }
  Comparison comparison(title, precision);
  for (const auto& [key, group] : groups) comparison.add(group);
  comparison.finish(least_share);
}

constexpr Precision in_suite{0.03, 2e5}, all_rows{0.005, 2e6};

}  // namespace

TEST_CASE("derivatives of a sphere in uniform light match the deterministic solution", "[transport][stat]") {
  compare("derivatives of spheres", sphere_rows({"0.5"}), in_suite, 0.5);
}
TEST_CASE("derivatives of slabs match the deterministic solution", "[transport][stat]") {
  compare("derivatives of slabs", slab_rows("slab", {"60"}), in_suite, 0.75);
}
TEST_CASE("derivatives of rough slabs match the deterministic solution", "[transport][stat]") {
  compare("derivatives of rough slabs", slab_rows("rough_slab", {"0", "60"}), in_suite, 0.65);
}
TEST_CASE("derivatives of light scattered exactly once match the closed form", "[transport][stat]") {
  compare("derivatives of single scattering", single_rows(), in_suite, 0.5);
}

TEST_CASE("derivatives of spheres in every row", "[.derivatives]") {
  compare("derivatives of spheres", sphere_rows({"0.0", "0.25", "0.5", "0.75", "0.9"}), all_rows, 0.3);
}
TEST_CASE("derivatives of slabs in every row", "[.derivatives]") {
  compare("derivatives of slabs", slab_rows("slab", {"0", "30", "60", "75"}), all_rows, 0.3);
}
TEST_CASE("derivatives of rough slabs in every row", "[.derivatives]") {
  compare("derivatives of rough slabs", slab_rows("rough_slab", {"0", "30", "60", "75"}), all_rows, 0.3);
}
TEST_CASE("derivatives of half-spaces and single scattering in every row", "[.derivatives]") {
  compare("derivatives of half-spaces", halfspace_rows(), all_rows, 0.3);
  compare("derivatives of single scattering", single_rows(), all_rows, 0.3);
}

TEST_CASE("where nothing absorbs, no pixel of a white furnace depends on sigma_t or g", "[transport][stat]") {
  std::vector<double> z;
  for (const char* name : {"furnace_matched.xml", "furnace_dielectric.xml"})
    for (const char* sigma_t : {"0.5", "10"})
      for (const char* g : {"-0.5", "0.9"}) {
        INFO(name << ", sigma_t " << sigma_t << ", g " << g);
        const Scene scene = load_scene(test_scene(name), {{"sigma_t", sigma_t}, {"g", g}, {"rr_depth", "1000000"}});
        RenderOptions options;
        options.spp = 256;
        options.seed = 4 + z.size();
        for (const Parameter& p : list_parameters(scene))
          if (p.member == "sigma_t" || p.member == "g" || p.member == "albedo") options.derivatives.push_back(p.name);
        const Rendering image = render(device(), scene, options);
        for (std::size_t i = 0; i < options.derivatives.size(); ++i) {
          const Image& derivative = image.derivatives[i];
          INFO(options.derivatives[i]);
          const bool albedo = options.derivatives[i].find("albedo") != std::string::npos;
          double largest = 0;
          for (std::size_t pixel = 0; pixel < derivative.mean.size(); pixel += 3) {
            // More albedo, more light: of the paths in the medium each score is positive.
            if (albedo) CHECK(derivative.mean[pixel] >= 0);
            if (derivative.stderr_[pixel] > 0)
              largest = std::max(largest, std::abs(z_score({derivative.mean[pixel], derivative.stderr_[pixel]}, 0)));
          }
          if (albedo) {
            CHECK(derivative.mean_of_image[0] > 10 * derivative.stderr_of_mean[0]);
          } else {
            // Four standard errors, shared over the pixels of all images.
            CHECK(largest < largest_z_bound(16 * 16 * 16, 6.3e-5 * 16));
            z.push_back(derivative.mean_of_image[0] / derivative.stderr_of_mean[0]);
          }
        }
      }
  for (const double score : z) CHECK(std::abs(score) < largest_z_bound(z.size(), 0.0027));
}

TEST_CASE("at albedo 1 the mean derivative by albedo is the exact mean number of scatterings", "[transport][stat]") {
  // A path that isotropic light brings into a sphere scatters sigma_t n^2 4 R / 3 times in the mean, whatever g is.
  for (const char* name : {"sphere_matched.xml", "sphere_dielectric.xml"})
    for (const char* g : {"0", "0.8"}) {
      const bool matched = name == std::string("sphere_matched.xml");
      Scene scene =
          load_scene(test_scene(name), {{"sigma_t", "2"}, {"albedo", "1"}, {"g", g}, {"rr_depth", "1000000"}});
      // All of the sphere, instead of one point of it: the columns of x and y, which were scaled to a thousandth.
      for (const std::size_t k : {0u, 1u, 4u, 5u, 8u, 9u}) scene.sensors[0].to_world.m[k] *= 1000;
      RenderOptions options;
      options.spp = 256;
      options.seed = 5;
      options.derivatives = {"medium.albedo"};
      const Rendering image = render(device(), scene, options);
      const double n = matched ? 1 : 1.5, pi = 3.14159265358979;
      const double z = z_score({image.derivatives[0].mean_of_image[0], image.derivatives[0].stderr_of_mean[0]},
                               pi / 4 * 2 * n * n * 4 / 3);  // the disc covers pi / 4 of the image
      INFO(name << ", g " << g << ", z " << z);
      CHECK(image.derivatives[0].stderr_of_mean[0] < 0.01 * image.derivatives[0].mean_of_image[0]);
      CHECK(std::abs(z) < largest_z_bound(4, 0.0027));
    }
}

TEST_CASE("components of a grey colour: each channel has the derivative by its own", "[derivative]") {
  Scene scene = load_scene(test_scene("mitsuba/null_constant.xml"));
  scene.environment->set("radiance", 1);
  RenderOptions options;
  options.spp = 4;
  options.baselines = Baselines::off;
  options.derivatives = {scene.media[0].id + ".sigma_t"};
  const Rendering grey = render(device(), scene, options);
  scene.media[0].value("sigma_t").by_component = true;
  options.derivatives = {scene.media[0].id + ".sigma_t.G"};
  const Rendering green = render(device(), scene, options);
  const std::vector<float>&all = grey.derivatives[0].mean, &one = green.derivatives[0].mean;
  for (std::size_t i = 0; i < all.size(); ++i) CHECK(one[i] == (i % 3 == 1 ? all[i] : 0.0F));
}
