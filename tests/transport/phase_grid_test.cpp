// Grids that stand for numbers of phase functions (kernels/scattering/phase.h): one of the same value everywhere is the
// number, in image and derivatives, to the bit where it changes no random number; gradients by voxels against
// differences of single voxels, and against the derivative by the number.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <memory>
#include <numeric>

#include "../support/temporary_folder.h"
#include "itn/file.h"
#include "itn/parameters.h"
#include "runtime/scene/volume/volume_file.h"
#include "weighed.h"

using namespace itn;
using namespace itn::test;

namespace {

std::string grid_file(const TemporaryFolder& folder, const std::string& name, int width, int height, int depth,
                      const std::vector<float>& data) {
  VoxelGrid grid;
  grid.width = width;
  grid.height = height;
  grid.depth = depth;
  grid.data = data;
  write_volume_file(folder / name, grid);
  return folder / name;
}

std::string number(const std::string& name, double value) {
  return fmt::format("<float name=\"{}\" value=\"{}\"/>", name, value);
}

// In the cube from -1 to 1.
std::string volume(const std::string& name, const std::string& file) {
  return fmt::format(R"(<volume type="gridvolume" name="{}"><string name="filename" value="{}"/>
    <transform name="to_world"><scale value="2"/><translate x="-1" y="-1" z="-1"/></transform></volume>)",
                     name, file);
}

// A blend of two phase functions in a cube, whose parameters are these elements.
std::string blend(const std::string& weight, const std::string& g, const std::string& kappa) {
  return fmt::format(R"(<phase type="blendphase" id="mix">{}<phase type="hg" id="ahead">{}</phase>
    <phase type="vmf" id="beam">{}</phase></phase>)",
                     weight, g, kappa);
}

Scene cube(const TemporaryFolder& folder, const std::string& phase) {
  const std::string file = folder / "scene.xml";
  write_file(file, fmt::format(R"(<scene version="3.0.0">
  <integrator type="volpath"><integer name="max_depth" value="8"/></integrator>
  <sensor type="perspective">
    <float name="fov" value="50"/>
    <transform name="to_world"><lookat origin="0.5, -3.5, 1" target="0, 0, 0" up="0, 0, 1"/></transform>
    <film type="hdrfilm"><integer name="width" value="12"/><integer name="height" value="8"/>
      <rfilter type="box"/></film>
  </sensor>
  <emitter type="constant"><float name="radiance" value="0.3"/></emitter>
  <emitter type="directional"><vector name="direction" x="-1" y="0.4" z="-0.5"/>
    <float name="irradiance" value="3"/></emitter>
  <shape type="cube"><bsdf type="null"/><medium name="interior" id="smoke" type="homogeneous">
    <float name="sigma_t" value="0.8"/><float name="albedo" value="0.9"/>{}</medium></shape>
</scene>)",
                               phase));
  return load_scene(file);
}

RenderOptions by(const std::vector<std::string>& parameters) {
  RenderOptions options;
  options.seed = 5;
  options.derivatives = parameters;
  return options;
}

// Mean of numbers and its standard error.
Estimate estimate(const std::vector<double>& values) {
  const auto n = static_cast<double>(values.size());
  Estimate e;
  e.value = std::accumulate(values.begin(), values.end(), 0.0) / n;
  for (const double v : values) e.stderr_ += (v - e.value) * (v - e.value) / (n - 1) / n;
  e.stderr_ = std::sqrt(e.stderr_);
  return e;
}

}  // namespace

TEST_CASE("grids of one value for a phase function's numbers are these numbers, in image and every derivative",
          "[derivative]") {
  const TemporaryFolder folder;
  const Scene numbers = cube(folder, blend(number("weight", 0.3), number("g", -0.4), number("kappa", 6)));
  const auto grid = [&](const std::string& name, float value) {
    return volume(name, grid_file(folder, name + ".vol", 3, 2, 4, std::vector<float>(24, value)));
  };
  const Scene grids = cube(folder, blend(grid("weight", 0.3F), grid("g", -0.4F), grid("kappa", 6)));
  RenderOptions options = one_lane();
  options.derivatives = {"smoke.sigma_t", "smoke.albedo"};
  options.spp = 32;
  const Rendering a = render(device(), numbers, options), b = render(device(), grids, options);
  CHECK(a.mean == b.mean);
  for (std::size_t i = 0; i < 2; ++i) CHECK(a.derivatives[i].mean == b.derivatives[i].mean);

  const std::vector<std::string> names{"mix.weight", "ahead.g", "beam.kappa"};
  for (const Baselines baselines : {Baselines::off, Baselines::on}) {
    RenderOptions replayed = by(names);
    replayed.baselines = baselines;
    GradientRenderer by_numbers(device(), numbers, replayed), by_grids(device(), grids, replayed);
    const WeighedDerivatives x = gradient(by_numbers, 0, 32), y = gradient(by_grids, 0, 32);
    for (std::size_t i = 0; i < names.size(); ++i) {
      INFO(names[i] << ": number " << x.value[i] << " +- " << x.stderr_[i] << ", grid " << y.value[i]);
      CHECK(y.value[i] ==
            Approx(x.value[i]).epsilon(1e-4).margin(1e-3 * x.stderr_[i]));  // the same paths, rounded apart
      CHECK(y.stderr_[i] == Approx(x.stderr_[i]).epsilon(1e-3));
      CHECK(sum_of(y.values[i]) == Approx(y.value[i]).epsilon(1e-5).margin(1e-3 * y.stderr_[i]));
    }
  }
}

TEST_CASE("the gradient by a voxel of a phase function's number is the difference of that voxel",
          "[derivative][stat]") {
  const TemporaryFolder folder;
  // Only the first of the two phase functions is sampled where the weight is 0.
  const std::vector<float> weights{0, 0.5F, 0, 1, 0.2F, 0.9F, 0, 0},
      cosines{0.6F, -0.5F, 0, 0.3F, 0.1F, 0.8F, -0.2F, 0};
  const Scene scene =
      cube(folder, blend(volume("weight", grid_file(folder, "weight.vol", 2, 2, 2, weights)),
                         volume("g", grid_file(folder, "g.vol", 2, 2, 2, cosines)), number("kappa", 3)));
  const std::vector<std::string> names{"mix.weight", "ahead.g"};
  constexpr int runs = 12, spp = 256;
  GradientRenderer renderer(device(), scene, by(names));
  std::vector<WeighedDerivatives> found;
  for (int run = 0; run < runs; ++run) found.push_back(gradient(renderer, run * spp, spp));
  for (std::size_t k = 0; k < names.size(); ++k) {
    const Parameter p = find_parameter(list_parameters(scene), names[k]);
    for (const std::size_t voxel : {std::size_t{0}, std::size_t{3}, std::size_t{5}}) {
      std::vector<double> gradients, differences;
      for (const WeighedDerivatives& each : found) gradients.push_back(static_cast<double>(each.values[k].data[voxel]));
      // Both use the same random numbers: most paths are the same. The image is a polynomial in weights, and nearly one
      // in g.
      const double value = static_cast<double>(grid_of(scene, p)->data[voxel]);
      const double low = value < 0.1 && k == 0 ? 0 : value - 0.1, high = value > 0.9 && k == 0 ? 1 : value + 0.1;
      // The weighed image with that value, a sum for each run.
      const auto sums_with = [&](double to) {
        auto grid = std::make_shared<VoxelGrid>(*grid_of(scene, p));
        grid->data[voxel] = static_cast<float>(to);
        Scene moved = scene;
        set_grid(moved, p, grid);
        RenderOptions options;
        options.seed = 77;
        Renderer each(device(), moved, options);
        std::vector<double> sums;
        for (int run = 0; run < runs; ++run) {
          const Rendering image = each.render(run * 4 * spp, 4 * spp);
          const std::vector<double> weigh = weights_of(image);
          sums.push_back(std::inner_product(weigh.begin(), weigh.end(), image.mean.begin(), 0.0));
        }
        return sums;
      };
      const std::vector<double> below = sums_with(low), above = sums_with(high);
      for (std::size_t run = 0; run < below.size(); ++run)
        differences.push_back((above[run] - below[run]) / (high - low));
      const Estimate a = estimate(gradients), b = estimate(differences);
      INFO(names[k] << ", voxel " << voxel << ": " << a.value << " +- " << a.stderr_ << ", difference " << b.value
                    << " +- " << b.stderr_);
      CHECK(std::abs(a.value - b.value) < 5.5 * std::sqrt(a.stderr_ * a.stderr_ + b.stderr_ * b.stderr_));
    }
  }
}

TEST_CASE("launches and schedules change no bit of images and gradients by grids of phase functions",
          "[derivative][determinism]") {
  const TemporaryFolder folder;
  const Scene scene =
      cube(folder, blend(volume("weight", grid_file(folder, "weight.vol", 2, 1, 2, {0, 0.5F, 1, 0.2F})),
                         number("g", 0.4), volume("kappa", grid_file(folder, "kappa.vol", 1, 2, 1, {2, 7}))));
  const RenderOptions options = by({"mix.weight", "beam.kappa", "ahead.g"});
  const auto values = [&](const RenderOptions& of) {
    GradientRenderer renderer(device(), scene, of);
    return gradient(renderer, 0, 16);
  };
  const WeighedDerivatives whole = values(options);
  RenderOptions small = options, staged = options;
  small.paths_a_launch = 777;
  staged.schedule = Schedule::staged;
  for (const RenderOptions& other : {small, staged}) {
    const WeighedDerivatives again = values(other);
    CHECK(again.value == whole.value);
    for (std::size_t i = 0; i < 2; ++i) CHECK(again.values[i].data == whole.values[i].data);
  }
}
