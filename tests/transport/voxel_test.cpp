// Gradients by the voxels of grids (kernels/derivative/voxel_gradient.h) against differences of the mean of single
// voxels, in empty voxels and at the greatest value too, and against the derivative by the extinction of a homogeneous
// medium.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <memory>

#include "../support/temporary_folder.h"
#include "itn/file.h"
#include "itn/parameters.h"
#include "runtime/scene/volume/volume_file.h"
#include "weighed.h"

using namespace itn;
using namespace itn::test;

namespace {

// The contents of a cube of side 2, seen by 16 x 8 pixels: a sensor with light from all sides or from a lamp.
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

std::string grid_file(const TemporaryFolder& folder, int width, int height, int depth, const std::vector<float>& data,
                      const std::string& name = "grid.vol") {
  VoxelGrid grid;
  grid.width = width;
  grid.height = height;
  grid.depth = depth;
  grid.channels = static_cast<int>(data.size()) / (width * height * depth);
  grid.data = data;
  write_volume_file(folder / name, grid);
  return folder / name;
}

// In the cube from -1 to 1.
std::string heterogeneous(const std::string& file, const std::string& more, const std::string& filter = "trilinear") {
  return fmt::format(R"(type="heterogeneous"><volume type="gridvolume" name="sigma_t">
    <string name="filename" value="{}"/><string name="filter_type" value="{}"/>
    <transform name="to_world"><scale value="2"/><translate x="-1" y="-1" z="-1"/></transform></volume>{})",
                     file, filter, more);
}

RenderOptions by(const std::vector<std::string>& parameters, std::uint64_t seed = 5) {
  RenderOptions options;
  options.seed = seed;
  options.derivatives = parameters;
  return options;
}

Estimate weighed(Renderer& renderer, int first, int spp) {
  const Rendering image = renderer.render(first, spp);
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

Renderer seeded(const Scene& scene, std::uint64_t seed) {
  RenderOptions options;
  options.seed = seed;
  return {device(), scene, options};
}

Scene moved(const Scene& scene, const Parameter& p, std::size_t voxel, double offset) {
  auto grid = std::make_shared<VoxelGrid>(*grid_of(scene, p));
  grid->data[voxel] += static_cast<float>(offset);
  Scene result = scene;
  set_grid(result, p, grid);
  return result;
}

// The offsets in h, and their factors, of a difference whose error is of the fourth order in h; one-sided in an empty
// voxel, and of the third order.
std::vector<std::pair<double, double>> stencil(double value, double h) {
  if (value < 2 * h) return {{0, -11.0 / 6}, {1, 3}, {2, -1.5}, {3, 1.0 / 3}};
  return {{-2, 1.0 / 12}, {-1, -2.0 / 3}, {1, 2.0 / 3}, {2, -1.0 / 12}};
}

Estimate difference(const Scene& scene, std::size_t voxel, double h, int spp) {
  const Parameter p = find_parameter(list_parameters(scene), "smoke.sigma_t");
  Estimate sum;
  std::uint64_t seed = 100 * voxel;
  for (const auto& [offset, factor] : stencil(static_cast<double>(grid_of(scene, p)->data[voxel]), h)) {
    Renderer renderer = seeded(moved(scene, p, voxel, offset * h), ++seed);
    const Estimate e = weighed(renderer, 0, spp);
    sum.value += factor * e.value / h;
    sum.stderr_ += factor * factor * e.stderr_ * e.stderr_ / h / h;
  }
  sum.stderr_ = std::sqrt(sum.stderr_);
  return sum;
}

}  // namespace

namespace {

// The mean over runs, of each number that `of` gives, and its standard error.
std::vector<Estimate> mean_of_runs(int runs, const std::function<std::vector<double>(int)>& of) {
  std::vector<double> sum, square;
  for (int run = 0; run < runs; ++run) {
    const std::vector<double> values = of(run);
    sum.resize(values.size());
    square.resize(values.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
      sum[i] += values[i] / runs;
      square[i] += values[i] * values[i] / runs;
    }
  }
  std::vector<Estimate> result;
  for (std::size_t i = 0; i < sum.size(); ++i)
    result.push_back({sum[i], std::sqrt(std::max(square[i] - sum[i] * sum[i], 0.0) / (runs - 1))});
  return result;
}

// Over gradients of other samples of one scene.
std::vector<Estimate> mean_of_gradients(const Scene& scene, const RenderOptions& options, int runs, int spp,
                                        const std::function<std::vector<double>(const WeighedDerivatives&)>& of) {
  GradientRenderer renderer(device(), scene, options);
  return mean_of_runs(runs, [&](int run) { return of(gradient(renderer, run * spp, spp)); });
}

std::vector<double> first_values(const WeighedDerivatives& result) {
  const std::vector<float>& data = result.values[0].data;
  return {data.begin(), data.end()};
}

double z_of(const Estimate& a, const Estimate& b) {
  return (a.value - b.value) / std::sqrt(a.stderr_ * a.stderr_ + b.stderr_ * b.stderr_);
}

}  // namespace

TEST_CASE("the gradient by a voxel is the difference of that voxel, empty or at the greatest value",
          "[derivative][stat]") {
  const TemporaryFolder folder;
  // Whole cells are empty: no path scatters there. Voxel 10 is what tentative collisions are drawn by.
  const std::vector<float> values{0, 0, 0.6F, 0, 1.5F, 0, 0, 0, 0.3F, 0, 2, 0};
  for (const auto& [filter, voxels] :
       {std::pair<std::string, std::vector<std::size_t>>{"trilinear", {1, 4, 7, 10}}, {"nearest", {2, 7, 10}}}) {
    Setting setting;
    setting.medium =
        heterogeneous(grid_file(folder, 3, 2, 2, values), R"(<float name="albedo" value="0.75"/>)", filter);
    const Scene scene = cube(folder, setting);
    const std::vector<Estimate> gradients = mean_of_gradients(scene, by({"smoke.sigma_t"}), 12, 512, first_values);
    REQUIRE(gradients.size() == values.size());
    for (const std::size_t i : voxels) {
      const Estimate expected = difference(scene, i, 0.3, 4096);
      INFO(filter << ", voxel " << i << ": " << gradients[i].value << " +- " << gradients[i].stderr_ << ", difference "
                  << expected.value << " +- " << expected.stderr_);
      CHECK(std::abs(z_of(gradients[i], expected)) < 5.5);  // of runs that are few
    }
  }
}

TEST_CASE("the gradient by a voxel of an albedo is the difference of that voxel, where paths end too",
          "[derivative][stat]") {
  const TemporaryFolder folder;
  // Colours: what is 0 in one channel need not be in another. Between voxels 0 and 1 all are 0.
  const std::vector<float> values{0, 0, 0, 0, 0, 0, 0.9F, 0.02F, 0, 0.5F, 0.6F, 0.7F};
  const std::string grid = fmt::format(R"(<volume type="gridvolume" name="albedo">
    <string name="filename" value="{}"/><transform name="to_world"><scale value="2"/><translate x="-1" y="-1" z="-1"/></transform>
    </volume>)",
                                       grid_file(folder, 2, 2, 1, values));
  for (const char* medium : {"homogeneous", "heterogeneous"}) {
    Setting setting;
    setting.medium = fmt::format(R"(type="{}">{})", medium, grid);
    if (medium == std::string("homogeneous"))
      setting.medium += R"(<float name="sigma_t" value="1.5"/>)";
    else
      setting.medium += R"(<volume type="constvolume" name="sigma_t"><rgb name="value" value="1.5, 1, 0.5"/>
        <transform name="to_world"><scale value="2"/><translate x="-1" y="-1" z="-1"/></transform></volume>)";
    const Scene scene = cube(folder, setting);
    const std::vector<std::size_t> which{0, 6, 7, 8};
    const std::vector<Estimate> gradients = mean_of_gradients(scene, by({"smoke.albedo"}), 12, 256, first_values);
    REQUIRE(gradients.size() == values.size());
    // An albedo moves no flight: of the same random numbers differences have little noise.
    const Parameter p = find_parameter(list_parameters(scene), "smoke.albedo");
    constexpr int runs = 8, spp = 512;
    std::vector<std::vector<double>> by_run(runs, std::vector<double>(which.size()));
    for (std::size_t k = 0; k < which.size(); ++k)
      for (const auto& [offset, factor] : stencil(static_cast<double>(values[which[k]]), 0.05)) {
        Renderer renderer = seeded(moved(scene, p, which[k], offset * 0.05), 70);
        for (std::size_t run = 0; run < runs; ++run)
          by_run[run][k] += factor * weighed(renderer, static_cast<int>(run) * spp, spp).value / 0.05;
      }
    const std::vector<Estimate> differences =
        mean_of_runs(runs, [&](int run) { return by_run[static_cast<std::size_t>(run)]; });
    for (std::size_t k = 0; k < which.size(); ++k) {
      const Estimate &found = gradients[which[k]], &expected = differences[k];
      INFO(medium << ", value " << which[k] << ": " << found.value << " +- " << found.stderr_ << ", difference "
                  << expected.value << " +- " << expected.stderr_);
      CHECK(std::abs(z_of(found, expected)) < 6);  // of runs that are few
      CHECK(expected.stderr_ < 0.05 * expected.value);
    }
  }
}

TEST_CASE("the gradients by the voxels of a constant grid of albedos are the derivative by that albedo together",
          "[derivative][stat]") {
  const TemporaryFolder folder;
  Setting setting;
  const std::string sigma_t = R"(type="homogeneous"><float name="sigma_t" value="1.5"/>)";
  setting.medium = sigma_t + R"(<float name="albedo" value="0.85"/>)";
  const Scene homogeneous = cube(folder, setting);
  setting.medium = sigma_t + fmt::format(R"(<volume type="gridvolume" name="albedo">
    <string name="filename" value="{}"/></volume>)",
                                         grid_file(folder, 4, 3, 5, std::vector<float>(60, 0.85F)));
  const Scene constant = cube(folder, setting);
  const auto of_all = [](const Scene& scene, std::uint64_t seed) {
    return mean_of_gradients(scene, by({"smoke.albedo"}, seed), 8, 256, [](const WeighedDerivatives& result) {
      const VoxelGrid& values = result.values[0];
      if (!values.data.empty()) CHECK(sum_of(values) == Approx(result.value[0]).epsilon(1e-5));
      return std::vector<double>{result.value[0], result.stderr_[0]};
    });
  };
  const std::vector<Estimate> a = of_all(homogeneous, 5), b = of_all(constant, 50);
  INFO("number " << a[0].value << " +- " << a[0].stderr_ << ", grid " << b[0].value << " +- " << b[0].stderr_);
  CHECK(std::abs(z_of(a[0], b[0])) < 6);
  CHECK(b[1].value == Approx(a[1].value).epsilon(0.2));  // as quiet
}

TEST_CASE("the gradients by the voxels of a constant grid are the derivative by a homogeneous medium together",
          "[derivative][stat]") {
  const TemporaryFolder folder;
  Setting setting;
  const std::string albedo = R"(<rgb name="albedo" value="0.9, 0.8, 0.7"/>)";
  setting.medium = R"(type="homogeneous"><float name="sigma_t" value="1.5"/>)" + albedo;
  const Scene homogeneous = cube(folder, setting);
  setting.medium = heterogeneous(grid_file(folder, 4, 3, 5, std::vector<float>(60, 1.5F)), albedo);
  const Scene constant = cube(folder, setting);
  for (const Baselines baselines : {Baselines::off, Baselines::on}) {
    const auto of_all = [&](const Scene& scene, std::uint64_t seed) {
      RenderOptions options = by({"smoke.sigma_t"}, seed);
      options.baselines = baselines;
      return mean_of_gradients(scene, options, 12, 256, [](const WeighedDerivatives& result) {
        const VoxelGrid& values = result.values[0];
        if (!values.data.empty()) CHECK(sum_of(values) == Approx(result.value[0]).epsilon(1e-5));
        return std::vector<double>{result.value[0], result.stderr_[0]};
      });
    };
    const std::vector<Estimate> a = of_all(homogeneous, 5), b = of_all(constant, 50);
    INFO("homogeneous " << a[0].value << " +- " << a[0].stderr_ << ", grid " << b[0].value << " +- " << b[0].stderr_);
    CHECK(std::abs(z_of(a[0], b[0])) < 5.5);
    CHECK(b[1].value < 1.1 * a[1].value);  // no noisier: no probes where nothing is thin
    CHECK(b[1].value > 0.7 * a[1].value);  // over 48 seeds the ratio is .81, of stated errors and of their spread
  }
}

TEST_CASE("launches, schedules and widths change no bit of a gradient by voxels", "[derivative][determinism]") {
  const TemporaryFolder folder;
  std::vector<float> values(6 * 5 * 4);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = i % 3 == 0 ? 0 : 0.1F * static_cast<float>(i * 7 % 11);
  Setting setting;
  setting.medium = heterogeneous(grid_file(folder, 6, 5, 4, values), "");
  setting.medium +=
      fmt::format(R"(<volume type="gridvolume" name="albedo"><string name="filename" value="{}"/></volume>)",
                  grid_file(folder, 2, 2, 1, {0, 0.3F, 0.9F, 1}, "albedo.vol"));
  const Scene scene = cube(folder, setting);
  const RenderOptions options = by({"smoke.sigma_t", "smoke.albedo"});
  const WeighedDerivatives whole = gradient(scene, options, 16);
  CHECK(gradient(scene, options, 16).values[0].data == whole.values[0].data);
  RenderOptions small = options, staged = options;
  small.paths_a_launch = 777;
  staged.schedule = Schedule::staged;
  for (const RenderOptions& other : {small, staged}) {
    const WeighedDerivatives again = gradient(scene, other, 16);
    CHECK(again.values[0].data == whole.values[0].data);
    CHECK(again.values[1].data == whole.values[1].data);
    CHECK(again.value == whole.value);
  }
  // one gradient after the other
  GradientRenderer renderer(device(), scene, options);
  const auto weights = [](const std::vector<Rendering>& groups) {
    return std::vector<std::vector<double>>{weights_of(groups[0])};
  };
  renderer.render(0, {16}, weights);
  CHECK(renderer.render(0, {16}, weights).values[0].data == whole.values[0].data);
  RenderOptions narrow = options;
  narrow.width = 1;
  const WeighedDerivatives one = gradient(scene, narrow, 16);
  CHECK(one.value[0] == Approx(whole.value[0]).margin(0.05 * whole.stderr_[0]));
}

TEST_CASE("voxels times their gradients are the derivative by the grid's scale", "[derivative][stat]") {
  // d / d scale = sum of voxel d / d voxel, whatever the grid: with colours, lamps, a sun behind rough glass, the
  // camera inside. Both are of the same paths.
  for (const auto& [name, baselines] : {std::pair<const char*, Baselines>{"grid_rgb", Baselines::on},
                                        {"grid_rough", Baselines::off},
                                        {"grid_inside", Baselines::on}}) {
    const Scene scene = load_scene(test_scene("mitsuba/" + std::string(name) + ".xml"));
    const std::vector<Parameter> all = list_parameters(scene);
    const Parameter p = *std::find_if(all.begin(), all.end(),
                                      [](const Parameter& each) { return each.by_voxels && each.member == "sigma_t"; });
    const Parameter scale = find_parameter(all, p.id + ".scale");
    const std::vector<float>& voxels = grid_of(scene, p)->data;
    RenderOptions options = by({scale.name, p.name});
    options.baselines = baselines;
    const auto compare = [&](const WeighedDerivatives& result) {
      const double by_scale = result.value[0] * scale.value;
      const double by_voxels =
          std::inner_product(voxels.begin(), voxels.end(), result.values[1].data.begin(), 0.0, std::plus<>(),
                             [](float voxel, float d) { return static_cast<double>(voxel) * static_cast<double>(d); });
      CHECK(sum_of(result.values[1]) == Approx(result.value[1]).epsilon(1e-4).margin(1e-4 * std::abs(by_scale)));
      return std::vector<double>{by_voxels - by_scale, by_scale};
    };
    const std::vector<Estimate> differences = mean_of_gradients(scene, options, 8, 16, compare);
    INFO(name << ": scale " << differences[1].value << ", difference " << differences[0].value << " +- "
              << differences[0].stderr_);
    CHECK(std::abs(differences[0].value) < 6.5 * differences[0].stderr_);
  }
}
