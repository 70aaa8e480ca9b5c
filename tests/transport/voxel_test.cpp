// Gradients by the voxels of grids (kernels/lib/voxel_gradient.h) against differences of the mean of single voxels, in
// empty voxels and at the greatest value too, and against the derivative by the extinction of a homogeneous medium.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <numeric>

#include "../support/temporary_folder.h"
#include "../support/z_test.h"
#include "runtime/base/file.h"
#include "runtime/gradient_renderer.h"
#include "runtime/scene/parameters.h"
#include "runtime/scene/volume_file.h"
#include "transport.h"

using namespace itn;
using namespace itn::test;

namespace {

constexpr double significance = 1e-4;

// What fills a cube of side 2, seen by 16 x 8 pixels: a sensor with light from all sides or from a lamp.
struct Setting {
  std::string boundary = R"(<bsdf type="null"/>)";
  std::string medium;  // inside of <medium>
  std::string light = R"(<emitter type="constant"><rgb name="radiance" value="0.3, 0.4, 0.5"/></emitter>
    <emitter type="point"><point name="position" x="1.5" y="-2" z="2"/><rgb name="intensity" value="9, 8, 7"/></emitter>)";
};

Scene cube(const TemporaryFolder& folder, const Setting& setting) {
  const std::string file = folder / "scene.xml";
  write_file(file, fmt::format(R"(<scene version="3.0.0">
  <integrator type="volpath"><integer name="max_depth" value="12"/><integer name="rr_depth" value="6"/></integrator>
  <sensor type="perspective">
    <float name="fov" value="50"/>
    <transform name="to_world"><lookat origin="0.5, -3.5, 1" target="0, 0, 0" up="0, 0, 1"/></transform>
    <film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="8"/>
      <rfilter type="box"/></film>
  </sensor>
  {}
  <shape type="cube">{}<medium name="interior" id="smoke" {}</medium></shape>
</scene>)",
                               setting.light, setting.boundary, setting.medium));
  return load_scene(file);
}

std::string grid_file(const TemporaryFolder& folder, int width, int height, int depth, const std::vector<float>& data) {
  VoxelGrid grid;
  grid.width = width;
  grid.height = height;
  grid.depth = depth;
  grid.channels = static_cast<int>(data.size()) / (width * height * depth);
  grid.data = data;
  write_volume_file(folder / "grid.vol", grid);
  return folder / "grid.vol";
}

// In the cube from -1 to 1.
std::string heterogeneous(const std::string& file, const std::string& more, const std::string& filter = "trilinear") {
  return fmt::format(R"(type="heterogeneous"><volume type="gridvolume" name="sigma_t">
    <string name="filename" value="{}"/><string name="filter_type" value="{}"/>
    <transform name="to_world"><scale value="2"/><translate x="-1" y="-1" z="-1"/></transform></volume>{})",
                     file, filter, more);
}

std::vector<double> weights_of(const Rendering& image) {
  std::vector<double> weights(image.mean.size());
  for (std::size_t i = 0; i < weights.size(); ++i) weights[i] = 0.5 + 0.1 * static_cast<double>(i * 5 % 13);
  return weights;
}

WeighedDerivatives gradient(const Scene& scene, const RenderOptions& options, int spp) {
  return GradientRenderer(device(), scene, options).render(0, {spp}, [](const std::vector<Rendering>& groups) {
    return std::vector<std::vector<double>>{weights_of(groups[0])};
  });
}

RenderOptions by(const std::vector<std::string>& parameters, std::uint64_t seed = 5) {
  RenderOptions options;
  options.seed = seed;
  options.derivatives = parameters;
  return options;
}

Estimate weighed(const Scene& scene, std::uint64_t seed, int spp) {
  RenderOptions options;
  options.seed = seed;
  const Rendering image = Renderer(device(), scene, options).render(0, spp);
  const std::vector<double> weights = weights_of(image);
  Estimate sum;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    sum.value += weights[i] * static_cast<double>(image.mean[i]);
    const double e = weights[i] * static_cast<double>(image.stderr_[i]);
    sum.stderr_ += e * e;  // channels of a pixel are alike: three times too small at most
  }
  sum.stderr_ = std::sqrt(3 * sum.stderr_);
  return sum;
}

Scene moved(const Scene& scene, std::size_t voxel, double offset) {
  const Parameter p = find_parameter(list_parameters(scene), "smoke.sigma_t");
  auto grid = std::make_shared<VoxelGrid>(*grid_of(scene, p));
  grid->data[voxel] += static_cast<float>(offset);
  Scene result = scene;
  set_grid(result, p, grid);
  return result;
}

// A difference whose error is of the fourth order in h; one-sided in an empty voxel, and of the third.
Estimate difference(const Scene& scene, std::size_t voxel, double h, int spp) {
  const Parameter p = find_parameter(list_parameters(scene), "smoke.sigma_t");
  const bool empty = static_cast<double>(grid_of(scene, p)->data[voxel]) < 2 * h;
  const std::vector<std::pair<double, double>> terms =  // offset in h, factor
      empty ? std::vector<std::pair<double, double>>{{0, -11.0 / 6}, {1, 3}, {2, -1.5}, {3, 1.0 / 3}}
            : std::vector<std::pair<double, double>>{{-2, 1.0 / 12}, {-1, -2.0 / 3}, {1, 2.0 / 3}, {2, -1.0 / 12}};
  Estimate sum;
  std::uint64_t seed = 100 * voxel;
  for (const auto& [offset, factor] : terms) {
    const Estimate e = weighed(moved(scene, voxel, offset * h), ++seed, spp);
    sum.value += factor * e.value / h;
    sum.stderr_ += factor * factor * e.stderr_ * e.stderr_ / h / h;
  }
  sum.stderr_ = std::sqrt(sum.stderr_);
  return sum;
}

}  // namespace

TEST_CASE("the gradient by a voxel is the difference of that voxel, empty or at the greatest value",
          "[derivative][stat]") {
  const TemporaryFolder folder;
  // Whole cells are empty: no path scatters there.
  const std::vector<float> values{0, 0, 0.6F, 0, 1.5F, 0, 0, 0, 0.3F, 0, 2, 0};
  const std::string filter = GENERATE("trilinear", "nearest");
  Setting setting;
  setting.medium = heterogeneous(grid_file(folder, 3, 2, 2, values), R"(<float name="albedo" value="0.75"/>)", filter);
  const Scene scene = cube(folder, setting);
  constexpr int runs = 16;
  std::vector<double> sum(values.size()), square(values.size());
  for (int run = 0; run < runs; ++run) {
    const WeighedDerivatives result = gradient(scene, by({"smoke.sigma_t"}, static_cast<std::uint64_t>(run)), 512);
    REQUIRE(result.voxels[0].data.size() == values.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
      const auto v = static_cast<double>(result.voxels[0].data[i]);
      sum[i] += v / runs;
      square[i] += v * v / runs;
    }
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double own = std::sqrt((square[i] - sum[i] * sum[i]) / (runs - 1));
    const Estimate expected = difference(scene, i, 0.25, 8192);
    const double z = (sum[i] - expected.value) / std::sqrt(own * own + expected.stderr_ * expected.stderr_);
    fmt::print("{} voxel {:2} value {:.2f}: {:9.4f} +- {:.4f}, difference {:9.4f} +- {:.4f}, z {:.2f}\n", filter, i,
               values[i], sum[i], own, expected.value, expected.stderr_, z);
    CHECK(std::abs(z) < largest_z_bound(24, significance));
  }
}

TEST_CASE("voxels times their gradients are the derivative by the grid's scale", "[derivative][stat]") {
  // d / d scale = sum of voxel d / d voxel, whatever the grid: with colours, rough boundaries and a sun, lamps,
  // baselines
  for (const auto& [name, id] :
       {std::pair<const char*, const char*>{"grid_rgb", "smoke"}, {"grid_rough", "smoke"}, {"grid_inside", "smoke"}})
    for (const Baselines baselines : {Baselines::off, Baselines::on}) {
      const Scene scene = load_scene(test_scene("mitsuba/" + std::string(name) + ".xml"));
      std::vector<std::string> grids;
      for (const Parameter& p : list_parameters(scene))
        if (p.by_voxels) grids.push_back(p.name);
      REQUIRE(grids.size() == 1);
      const std::string medium = grids[0].substr(0, grids[0].rfind('.'));
      const Parameter p = find_parameter(list_parameters(scene), grids[0]);
      const std::vector<float>& voxels = grid_of(scene, p)->data;
      const double scale = find_parameter(list_parameters(scene), medium + ".scale").value;
      double sum = 0, square = 0, of_scale = 0;
      constexpr int runs = 12;
      for (int run = 0; run < runs; ++run) {
        RenderOptions options = by({medium + ".scale", grids[0]}, static_cast<std::uint64_t>(run));
        options.baselines = baselines;
        const WeighedDerivatives result = gradient(scene, options, 16);
        double d = -result.value[0] * scale;
        for (std::size_t i = 0; i < voxels.size(); ++i)
          d += static_cast<double>(voxels[i]) * static_cast<double>(result.voxels[1].data[i]);
        sum += d / runs;
        square += d * d / runs;
        of_scale += result.value[0] * scale / runs;
        CHECK(result.value[1] ==
              Approx(std::accumulate(result.voxels[1].data.begin(), result.voxels[1].data.end(), 0.0))
                  .epsilon(1e-4)
                  .margin(1e-4 * std::abs(result.value[0])));
      }
      const double error = std::sqrt((square - sum * sum) / (runs - 1));
      fmt::print("{} baselines {}: scale {:.4f}, difference {:.4f} +- {:.4f}\n", name, baselines == Baselines::on,
                 of_scale, sum, error);
      CHECK(std::abs(sum) < 6 * error + 1e-4 * std::abs(of_scale));
    }
}
