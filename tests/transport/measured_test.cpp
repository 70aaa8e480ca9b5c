// Measured surfaces (merl) against the models from which their tables were made.
#include <catch2/catch.hpp>
#include <cmath>

#include "../support/merl_file.h"
#include "../support/temporary_folder.h"
#include "itn/file.h"
#include "itn/gradient_renderer.h"
#include "itn/model.h"
#include "itn/parameters.h"
#include "kernels/model/bsdf/rough_conductor.h"
#include "transport.h"

using namespace itn;
using namespace itn::test;

namespace {

// The surface before a wall, from which light comes back, under a sky and a lamp.
std::string surface_by_a_wall(const std::string& bsdf) {
  return R"(<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="6"/></integrator>
  <sensor type="perspective"><float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0,-3,2.5" target="0,0,0" up="0,0,1"/></transform>
    <film type="hdrfilm"><integer name="width" value="12"/><integer name="height" value="12"/>
      <rfilter type="box"/></film></sensor>
  <emitter type="constant"><rgb name="radiance" value="0.3, 0.4, 0.5"/></emitter>
  <emitter type="point"><point name="position" x="1" y="1" z="3"/><rgb name="intensity" value="6, 5, 4"/></emitter>
  <shape type="rectangle"><transform name="to_world"><scale value="1.5"/></transform>)" +
         bsdf + R"(</shape>
  <shape type="rectangle"><transform name="to_world"><rotate x="1" angle="80"/><translate y="1"/></transform>
    <bsdf type="twosided"><bsdf type="diffuse"/></bsdf></shape></scene>)";
}

Rendering image_of(const TemporaryFolder& folder, const std::string& bsdf, int spp, std::uint64_t seed,
                   const std::vector<std::string>& derivatives = {}, int width = 1) {
  write_file(folder / "scene.xml", surface_by_a_wall(bsdf));
  RenderOptions options = one_lane();
  options.spp = spp;
  options.seed = seed;
  options.derivatives = derivatives;
  options.width = width;
  return render(device(), load_scene(folder / "scene.xml"), options);
}

// Mean of the squares of the differences over their standard errors: 1 where nothing but noise differs. unlike: by how
// much pixels may differ beside it, the table being a piecewise linear image of the model.
void check_alike(const Rendering& a, const Rendering& b, double unlike) {
  double squares = 0;
  for (std::size_t i = 0; i < a.mean.size(); ++i) {
    const auto value = static_cast<double>(a.mean[i]);
    const double error = std::hypot(static_cast<double>(a.stderr_[i]), static_cast<double>(b.stderr_[i]));
    squares += std::pow((value - static_cast<double>(b.mean[i])) / std::hypot(error, unlike * value), 2);
  }
  const double chi = squares / static_cast<double>(a.mean.size());
  CAPTURE(chi);
  CHECK(chi < 1.3);
  CHECK(chi > 0.7);
}

std::string measured(const std::string& more = "") {
  return R"(<bsdf type="merl" id="m"><string name="filename" value="m.binary"/>)" + more + "</bsdf>";
}

// The values of a BSDF of the program.
MerlFormula formula_of(const Bsdf& bsdf, void (*value)(int, const double*, Vector3<double>, Vector3<double>, double*)) {
  const std::vector<double> n = bsdf.model->to_numbers(bsdf.variant, bsdf.slots());
  return [n, value, variant = bsdf.variant](double half, double difference, double azimuth) {
    // the half vector is in the plane of x and z, wi about it
    const double s = std::sin(half), c = std::cos(half);
    const Vector3<double> d{std::sin(difference) * std::cos(azimuth), std::sin(difference) * std::sin(azimuth),
                            std::cos(difference)};
    const Vector3<double> wi{d.x * c + d.z * s, d.y, d.z * c - d.x * s}, wo{d.z * s - d.x * c, -d.y, d.z * c + d.x * s};
    std::array<double, 3> f{-1, -1, -1};  // as of what cannot be measured
    if (wi.z > 0 && wo.z > 0) {
      value(variant, n.data(), wi, wo, f.data());
      for (double& x : f) x /= wo.z;
    }
    return f;
  };
}

}  // namespace

TEST_CASE("a table of Lambert's law looks as a diffuse surface does, at every width") {
  const TemporaryFolder folder;
  write_file(folder / "m.binary", merl_bytes([](double, double, double) {
               return std::array<double, 3>{0.7 / PI_, 0.4 / PI_, 0.1 / PI_};
             }));
  const std::string painted = R"(<bsdf type="diffuse"><rgb name="reflectance" value="0.7, 0.4, 0.1"/></bsdf>)";
  for (const int width : {1, 16})
    check_alike(image_of(folder, measured(), 256, 1, {}, width), image_of(folder, painted, 256, 2), 1e-5);
}

TEST_CASE("a table of a rough metal looks as the metal, alone, in a dictionary and under a mask") {
  const TemporaryFolder folder;
  Bsdf metal = make_bsdf("roughconductor", "ggx");
  metal.set("alpha", 0.3);
  metal.set("eta", Rgb{0.2, 0.9, 1.2});
  metal.set("k", Rgb{3.9, 2.4, 1.9});
  write_file(folder / "m.binary", merl_bytes(formula_of(metal, rough_conductor_value<double>)));
  const std::string model = R"(<bsdf type="roughconductor"><string name="distribution" value="ggx"/>
    <float name="alpha" value="0.3"/><rgb name="eta" value="0.2, 0.9, 1.2"/><rgb name="k" value="3.9, 2.4, 1.9"/></bsdf>)";
  const auto check = [&](const std::string& before, const std::string& after) {
    INFO(before);
    check_alike(image_of(folder, before + measured() + after, 512, 1), image_of(folder, before + model + after, 512, 2),
                4e-3);
  };
  check("", "");
  check("<bsdf type=\"dictionary\"><string name=\"weights\" value=\"2, 1\"/>",
        "<bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"0.1, 0.5, 0.3\"/></bsdf></bsdf>");
  check("<bsdf type=\"mask\"><float name=\"opacity\" value=\"0.7\"/>", "</bsdf>");
}

TEST_CASE("a measured surface is differentiated by its scale, and a dictionary by its weights", "[derivative]") {
  const TemporaryFolder folder;
  write_file(folder / "m.binary", merl_bytes([](double half, double, double) {
               return std::array<double, 3>{0.1 + std::exp(-10 * half * half) / 3, 0.1, 0.05};
             }));
  const auto entries = [&](double weight, double scale) {
    return "<bsdf type=\"dictionary\" id=\"d\"><string name=\"weights\" value=\"" + std::to_string(weight) + ", 1\"/>" +
           measured("<float name=\"scale\" value=\"" + std::to_string(scale) + "\"/>") +
           "<bsdf type=\"diffuse\"/></bsdf>";
  };
  constexpr int spp = 256;
  constexpr double step = 1.0 / 32;
  const auto check = [&](const std::string& name, const std::string& at, const std::string& less,
                         const std::string& more) {
    INFO(name);
    const Rendering image = image_of(folder, at, spp, 3, {name});
    const Rendering low = image_of(folder, less, spp, 3), high = image_of(folder, more, spp, 3);
    REQUIRE(image.derivatives.size() == 1);
    for (std::size_t c = 0; c < 3; ++c) {
      const double difference = (static_cast<double>(high.mean_of_image[c]) - low.mean_of_image[c]) / (2 * step);
      const double error = 4 * image.derivatives[0].stderr_of_mean[c] + 0.01 * std::abs(difference);
      CHECK(std::abs(image.derivatives[0].mean_of_image[c] - difference) < error);
    }
  };
  check("m.scale", measured(), measured("<float name=\"scale\" value=\"0.96875\"/>"),
        measured("<float name=\"scale\" value=\"1.03125\"/>"));
  check("m.scale", entries(1, 1), entries(1, 1 - step), entries(1, 1 + step));
  check("d.weight_0", entries(1, 1), entries(1 - step, 1), entries(1 + step, 1));

  // by replay, of the mean over pixels and channels
  write_file(folder / "scene.xml", surface_by_a_wall(entries(1, 1)));
  RenderOptions options = one_lane();
  options.derivatives = {"m.scale", "d.weight_0"};
  const Scene scene = load_scene(folder / "scene.xml");
  GradientRenderer renderer(device(), scene, options);
  const WeighedDerivatives replayed = renderer.render(0, {32}, [](const std::vector<Rendering>& groups) {
    const std::size_t values = groups[0].mean.size();
    return std::vector<std::vector<double>>{std::vector<double>(values, 3.0 / static_cast<double>(values))};
  });
  options.spp = 32;
  const Rendering image = render(device(), scene, options);
  for (std::size_t p = 0; p < 2; ++p) {
    const std::vector<double>& mean = image.derivatives[p].mean_of_image;
    CHECK(replayed.value[p] == Approx(mean[0] + mean[1] + mean[2]).epsilon(1e-4));
  }
}
