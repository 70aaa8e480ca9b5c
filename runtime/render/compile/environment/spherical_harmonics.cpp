#include "kernels/model/environment/spherical_harmonics.h"

#include <algorithm>
#include <numbers>

#include "itn/colour.h"
#include "runtime/render/compile/environment/fill.h"
#include "runtime/scene/model/sized_model.h"

namespace itn {
namespace {

constexpr double pi = std::numbers::pi;

double radiance_at(const std::vector<float>& c, int order, double z, double phi, Rgb& rgb) {
  const double r = std::sqrt(std::max(0.0, 1 - z * z));
  spherical_harmonics_sum(c.data(), order, Vector3<double>{r * std::cos(phi), r * std::sin(phi), z}, rgb.data());
  return std::max({std::abs(rgb[0]), std::abs(rgb[1]), std::abs(rgb[2])});
}

}  // namespace

// A cell's weight is the mean of the brightest channel over 2 x 2 points, and not below a hundredth of what it is on
// average: radiance passes 0 in lines that a few points of a cell may all lie on.
void spherical_harmonics_fill(const Environment& environment, EnvironmentRecord& record, std::vector<float>& tables) {
  std::vector<float> c;
  for (const Texture& coefficient : environment.values)
    for (const double x : coefficient.value) {
      require(std::isfinite(x), environment, "a coefficient", "finite", x);
      c.push_back(static_cast<float>(x));
    }
  record.width = spherical_harmonics_order(*environment.model);
  record.values = static_cast<int>(tables.size());
  tables.insert(tables.end(), c.begin(), c.end());

  constexpr int points = 2;
  std::vector<double> weight(HARMONICS_ROWS * HARMONICS_COLUMNS);
  double bright = 0;
  for (int row = 0; row < HARMONICS_ROWS; ++row)
    for (int column = 0; column < HARMONICS_COLUMNS; ++column)
      for (int i = 0; i < points * points; ++i) {
        const int down = i / points, across = i % points;
        const double z = 1 - 2 * (row + (down + 0.5) / points) / HARMONICS_ROWS;
        const double phi = 2 * pi * (column + (across + 0.5) / points) / HARMONICS_COLUMNS;
        Rgb rgb{};
        weight[static_cast<std::size_t>(row * HARMONICS_COLUMNS + column)] += radiance_at(c, record.width, z, phi, rgb);
        bright += std::abs(luminance(rgb));
      }
  const double floor = 0.01 * sum(weight) / static_cast<double>(weight.size());
  for (double& w : weight) w = std::max(w, floor);
  record.sampling = append_sampling(weight, HARMONICS_ROWS, HARMONICS_COLUMNS, tables);
  record.sky_weight = static_cast<float>(bright * 4 * pi / (HARMONICS_ROWS * HARMONICS_COLUMNS * points * points));
}

// Linear in its coefficients.
void spherical_harmonics_move(const Environment& environment, const Parameter& p, EnvironmentRecord& moving,
                              std::vector<float>& tables) {
  moving.values = static_cast<int>(tables.size());
  const auto& declared = environment.model->parameters;
  for (const DeclaredParameter& coefficient : declared)
    for (int c = 0; c < 3; ++c)
      tables.push_back(coefficient.name == p.member && (p.component < 0 || p.component == c) ? 1.0F : 0.0F);
}

}  // namespace itn
