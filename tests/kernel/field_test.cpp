// Fields against quadrature in double precision of the interpolation that the format promises: values, free flights
// (chi-square), transmittance and column density (z-tests), spectral weights.
#include "runtime/render/compile/field.h"

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <functional>

#include "../support/chi_square.h"
#include "../support/z_test.h"
#include "itn/device.h"
#include "kernels/model/models.h"
#include "runtime/render/compile/surfaces.h"
#include "runtime/scene/transform.h"
#include "runtime/scene/volume/packed_voxels.h"

using namespace itn;
using namespace itn::test;

namespace {

constexpr std::size_t samples = 1 << 16;
constexpr double significance = 1e-4;

using Function = std::function<double(double, double, double)>;

VoxelGrid grid_of(int nx, int ny, int nz, const std::vector<Function>& channels) {
  VoxelGrid grid;
  grid.width = nx;
  grid.height = ny;
  grid.depth = nz;
  grid.channels = static_cast<int>(channels.size());
  for (int z = 0; z < nz; ++z)
    for (int y = 0; y < ny; ++y)
      for (int x = 0; x < nx; ++x)
        for (const Function& f : channels)
          grid.data.push_back(static_cast<float>(f((x + 0.5) / nx, (y + 0.5) / ny, (z + 0.5) / nz)));
  return grid;
}

struct Ray {
  const char* name;
  Volume volume;
  Vec3 from, direction;  // direction: unit
  double distance;
  Rgb sigma_t;
  bool spectral = false;
};

int wrapped(Volume::Wrap wrap, int i, int n) {
  if (wrap == Volume::Wrap::clamp) return std::clamp(i, 0, n - 1);
  const int period = wrap == Volume::Wrap::repeat ? n : 2 * n, m = (i % period + period) % period;
  return m < n ? m : period - 1 - m;
}

// The field at a place, in double precision; beyond its box it goes on as it wraps.
class Reference {
 public:
  explicit Reference(const Volume& volume)
      : volume_(volume), inverse_(inverse_transpose(volume.to_world)), origin_(transform_point(volume.to_world, {})) {
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3 p =
          transform_point(volume.to_world, {corner & 1 ? 1. : 0., corner & 2 ? 1. : 0., corner & 4 ? 1. : 0.});
      for (std::size_t a = 0; a < 3; ++a) {
        low_[a] = std::min(low_[a], p[a]);
        high_[a] = std::max(high_[a], p[a]);
      }
    }
  }

  bool contains(const Vec3& p) const {
    bool inside = true;
    for (std::size_t a = 0; a < 3; ++a) inside = inside && p[a] >= low_[a] && p[a] <= high_[a];
    return inside;
  }

  double operator()(const Vec3& p, std::size_t channel) const {
    const VoxelGrid& grid = *volume_.grid;
    const std::array<int, 3> size{grid.width, grid.height, grid.depth};
    double value = 0;
    for (int corner = 0; corner < 8; ++corner) {
      double share = 1;
      std::array<int, 3> voxel{};
      for (std::size_t a = 0; a < 3; ++a) {
        double place = volume_.nearest ? 0 : -0.5;
        for (std::size_t k = 0; k < 3; ++k) place += inverse_.m[4 * k + a] * (p[k] - origin_[k]) * size[a];
        const bool upper = (corner >> a & 1) != 0;
        const double past = place - std::floor(place);
        share *= volume_.nearest ? (upper ? 0 : 1) : upper ? past : 1 - past;
        voxel[a] = wrapped(volume_.wrap, static_cast<int>(std::floor(place)) + (upper ? 1 : 0), size[a]);
      }
      const auto at = static_cast<std::size_t>((voxel[2] * size[1] + voxel[1]) * size[0] + voxel[0]);
      const auto channels = static_cast<std::size_t>(grid.channels);
      value += share * static_cast<double>(grid.data[at * channels + std::min(channel, channels - 1)]);
    }
    return value;
  }

 private:
  const Volume& volume_;
  Transform inverse_;
  Vec3 origin_, low_{1e30, 1e30, 1e30}, high_{-1e30, -1e30, -1e30};
};

// Integrals of the field along the ray up to each of `steps` equal distances.
std::vector<double> column_densities(const Ray& ray, std::size_t channel, int steps) {
  const Reference field(ray.volume);
  constexpr int fine = 4000;
  std::vector<double> result{0};
  double sum = 0;
  for (int i = 0; i < steps; ++i) {
    for (int k = 0; k < fine; ++k) {
      const Vec3 p = ray.from + (ray.distance * (i + (k + 0.5) / fine) / steps) * ray.direction;
      if (field.contains(p)) sum += field(p, channel) * ray.distance / steps / fine;
    }
    result.push_back(sum);
  }
  return result;
}

std::vector<float> follow(const Ray& ray, int width) {
  const Device device;
  LaunchData data;
  data.geometry.box_width = 4;
  append_field(ray.volume, 0, data);
  data.coloured = data.spectral = ray.spectral;
  data.coloured_field = ray.volume.grid && ray.volume.grid->channels == 3;
  std::map<std::string, std::string> definitions = feature_definitions(data);
  for (const char* none : {"SCORES", "DERIVATIVES", "ALBEDOS", "PARTS", "BASELINES", "ADJOINT", "LIGHT_NUMBERS"})
    definitions[none] = "0";
  definitions["PART_RECORDS"] = "{0,{0,0,0}}";
  definitions["WIDTH"] = std::to_string(width);
  definitions["BOX_WIDTH"] = "4";
  setenv("ITN_KERNEL_DIR", ITN_SOURCE_DIR "/tests/kernel", 1);
  const cl::Program program = device.build("field_test.cl", definitions, {{"program/surfaces.h", surfaces_text(data)}});
  unsetenv("ITN_KERNEL_DIR");
  std::vector<float> out(14 * samples);
  const cl::Buffer fields = device.upload(data.fields, "fields"), voxels = device.upload(data.voxels, "voxels"),
                   to = device.upload(out, "out");
  cl::Kernel kernel(program, "follow");
  cl_uint at = 0;
  kernel.setArg(at++, fields);
  kernel.setArg(at++, voxels);
  for (const Vec3& v : {ray.from, ray.direction})
    for (const double x : v) kernel.setArg(at++, static_cast<cl_float>(x));
  kernel.setArg(at++, static_cast<cl_float>(ray.distance));
  for (const double s : ray.sigma_t) kernel.setArg(at++, static_cast<cl_float>(s));
  kernel.setArg(at++, cl_uint{11});
  kernel.setArg(at, to);
  device.launch(kernel, samples / static_cast<std::size_t>(width), 1);
  device.finish();
  device.download(to, out);
  return out;
}

struct Mean {
  double value = 0, error = 0;
};

Mean mean_of(const std::function<double(std::size_t)>& x) {
  double sum = 0, square = 0;
  for (std::size_t i = 0; i < samples; ++i) {
    sum += x(i);
    square += x(i) * x(i);
  }
  const double n = samples, mean = sum / n;
  return {mean, std::sqrt(std::max(0.0, square / n - mean * mean) / n)};
}

std::vector<Ray> rays() {
  const auto volume = [](VoxelGrid grid, const Transform& to_world = {}) {
    Volume v;
    v.grid = std::make_shared<const VoxelGrid>(std::move(grid));
    v.to_world = to_world;
    return v;
  };
  const Function linear = [](double x, double y, double) { return 0.2 + 2 * x + y; };
  const Function exponential = [](double, double, double z) { return std::exp(-6 * z); };
  const Function patches = [](double x, double y, double z) {
    return std::max(0.0, std::sin(11 * x + 3 * y) * std::cos(9 * z) - 0.2);
  };
  const Transform turned = translate({1, -0.5, 2}) * rotate({0, 0.6, 0.8}, 40) * scale({2, 1.5, 3});
  Ray nearest{"nearest, repeated, turned",
              volume(grid_of(9, 7, 6, {patches}), turned),
              {-2, 0.6, 1.4},
              {0.96, 0, 0.28},
              9,
              {5, 5, 5}};
  nearest.volume.nearest = true;
  nearest.volume.wrap = Volume::Wrap::repeat;
  Ray mirrored{"trilinear, mirrored, turned",
               volume(grid_of(19, 7, 26, {patches}), turned),
               {-2, 0.6, 1.4},
               {0.96, 0, 0.28},
               9,
               {5, 5, 5}};
  mirrored.volume.wrap = Volume::Wrap::mirror;
  const Function shifted = [&](double x, double y, double z) { return patches(z, x, y) + 0.1; };
  return {
      {"constant",
       volume(grid_of(5, 6, 7, {[](double, double, double) { return 0.7; }})),
       {-1, 0.5, 0.5},
       {1, 0, 0},
       5,
       {2, 2, 2}},
      {"linear", volume(grid_of(8, 8, 8, {linear})), {-0.3, 0.2, 0.1}, {0.8, 0.48, 0.36}, 2, {1.5, 1.5, 1.5}},
      {"exponential, from inside to inside",
       volume(grid_of(6, 7, 40, {exponential})),
       {0.5, 0.5, 0.95},
       {0, 0, -1},
       0.9,
       {4, 4, 4}},
      nearest,
      mirrored,
      {"one field, three sigma_t",
       volume(grid_of(12, 13, 14, {patches})),
       {-0.2, 0.1, 0.2},
       {0.8, 0.48, 0.36},
       3,
       {9, 3, 0.5},
       true},
      {"three fields",
       volume(grid_of(12, 13, 14, {patches, shifted, linear})),
       {-0.2, 0.1, 0.2},
       {0.8, 0.48, 0.36},
       3,
       {6, 4, 0.7},
       true},
  };
}

}  // namespace

TEST_CASE("fields: values, flights, transmittance and column density against quadrature", "[kernel][stat]") {
  for (const int width : {1, 16})
    for (const Ray& ray : rays()) {
      INFO(ray.name << ", width " << width);
      const std::vector<float> out = follow(ray, width);
      const auto at = [&](std::size_t component, std::size_t i) {
        return static_cast<double>(out[component * samples + i]);
      };
      constexpr std::size_t cells = 40, tests = 14 * 3 * (3 + cells);
      const double z_bound = largest_z_bound(tests, significance);
      const double scored = static_cast<double>(samples);
      std::vector<double> observed(cells + 1), expected;
      const auto cell_of = [&](std::size_t i) {
        return at(0, i) > ray.distance ? cells
                                       : std::min(cells - 1, static_cast<std::size_t>(at(0, i) / ray.distance * cells));
      };
      for (std::size_t i = 0; i < samples; ++i) observed[cell_of(i)] += 1;
      for (std::size_t c = 0; c < (ray.spectral ? 3 : 1); ++c) {
        const std::vector<double> column_density = column_densities(ray, c, cells);
        const double whole = column_density.back(), sigma_t = ray.sigma_t[c];
        CHECK(at(11 + c, 0) == Approx(Reference(ray.volume)(ray.from, c)).epsilon(1e-4).margin(1e-5));
        const Mean through = mean_of([&](std::size_t i) { return at(5 + c, i); });
        CHECK(std::abs(through.value - std::exp(-sigma_t * whole)) < z_bound * through.error + 3e-5);
        const Mean length = mean_of([&](std::size_t i) { return at(8 + c, i); });
        CHECK(std::abs(length.value - whole) < z_bound * length.error + 1e-4 * whole);
        for (std::size_t k = 0; k <= cells; ++k) {
          const double share =
              k == cells ? std::exp(-sigma_t * whole)
                         : std::exp(-sigma_t * column_density[k]) - std::exp(-sigma_t * column_density[k + 1]);
          if (!ray.spectral) {
            expected.push_back(share * scored);
            continue;
          }
          // by a channel's weights its flights follow its own density, whatever the hero
          const Mean weighed = mean_of([&](std::size_t i) { return cell_of(i) == k ? at(2 + c, i) : 0; });
          INFO("channel " << c << ", cell " << k << ": " << weighed.value << " of " << share);
          CHECK(std::abs(weighed.value - share) < z_bound * weighed.error + 1e-4);
        }
      }
      if (ray.spectral) continue;
      const ChiSquare test = chi_square(observed, expected);
      INFO("flights: chi-square " << test.statistic << ", p " << test.p_value);
      CHECK(test.p_value > significance);
    }
}

TEST_CASE("where a field is the same everywhere transmittance and column density have no noise", "[kernel]") {
  const Ray ray = rays().front();
  const std::vector<float> out = follow(ray, 16);
  for (std::size_t i = 0; i < samples; ++i) {
    REQUIRE(out[8 * samples + i] == Approx(0.7).epsilon(1e-5));
    REQUIRE(out[5 * samples + i] == Approx(std::exp(-1.4)).epsilon(1e-5));
  }
}

TEST_CASE("packed grids are the grids that they were packed from", "[kernel]") {
  // Numbers from 0 to the greatest that the bits hold are stored as they are; a third of the bricks holds nothing.
  const auto numbers = [](int bits, double turn) -> Function {
    const double greatest = bits == 8 ? 255 : 65535;
    return [=](double x, double y, double z) {
      return x > 0.6 ? 0.0 : std::floor(greatest * (0.5 + 0.5 * std::sin(9 * x + 7 * y + turn) * std::cos(11 * z)));
    };
  };
  for (const int bits : {8, 16, 32})
    for (const int width : {1, 16}) {
      const bool coloured = (bits == 16) == (width == 16);
      INFO(bits << " bits, width " << width);
      std::vector<Function> channels{numbers(bits, 0)};
      if (coloured) channels.insert(channels.end(), {numbers(bits, 1), numbers(bits, 2)});
      VoxelGrid grid = grid_of(35, 7, 26, channels);
      grid.data[0] = bits == 8 ? 255 : 65535;
      const double scale = 6 / static_cast<double>(grid.data[0]);
      Ray ray{"", {}, {-0.2, 0.1, 0.2}, {0.8, 0.48, 0.36}, 3, {scale, scale / 2, scale / 3}, coloured};
      ray.volume.nearest = bits == 8 && width == 16;
      ray.volume.wrap = bits == 32 ? Volume::Wrap::mirror : Volume::Wrap::clamp;
      ray.volume.grid = std::make_shared<const VoxelGrid>(grid);
      const std::vector<float> expected = follow(ray, width);
      grid.packed = std::make_shared<const PackedVoxels>(
          pack(grid, bits, "grid", [&](const std::array<int, 3>& brick, float* to) {
            const std::size_t stored = channels.size();
            for (int z = 0; z < brick_side; ++z)
              for (int y = 0; y < brick_side; ++y)
                for (int x = 0; x < brick_side; ++x, to += stored) {
                  const int at_x = brick_side * brick[0] + x, at_y = brick_side * brick[1] + y,
                            at_z = brick_side * brick[2] + z;
                  if (at_x < grid.width && at_y < grid.height && at_z < grid.depth)
                    std::copy_n(grid.data.begin() + ((at_z * grid.height + at_y) * grid.width + at_x) *
                                                        static_cast<std::ptrdiff_t>(stored),
                                stored, to);
                }
            return false;
          }));
      if (bits < 32) CHECK(grid.packed->bytes() < sizeof(float) * grid.data.size());
      grid.data.clear();
      ray.volume.grid = std::make_shared<const VoxelGrid>(grid);
      CHECK(follow(ray, width) == expected);
    }
}
