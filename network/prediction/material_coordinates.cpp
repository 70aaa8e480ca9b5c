#include "network/prediction/material_coordinates.h"

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <string>

#include "runtime/base/parameter_chain.h"

namespace itn {
namespace {

constexpr std::size_t medium_numbers = 3;  // sigma_t, albedo, g

// The ranges of sigma_t, albedo and g, if these are all and no end of them is at infinity.
struct Similarity {
  std::array<OutputRange, medium_numbers> range;
  std::array<std::size_t, medium_numbers> coordinate;  // of the cube, of each range
  std::array<double, medium_numbers> low, high;        // of the similarity coordinates

  auto jacobian_at(const Eigen::VectorXd& point) const {
    const auto chain = [&]<class Real>(const Numbers<Real, medium_numbers>& x) {
      Numbers<Real, medium_numbers> material;
      for (std::size_t i = 0; i < medium_numbers; ++i)
        material[i] = range[i].parameter_of_share((x[coordinate[i]] + Real(1)) / Real(2));
      return similarity(material);
    };
    return jacobian(chain, std::array{point[0], point[1], point[2]});
  }

  MaterialPlace operator()(const Eigen::VectorXd& point) const {
    const auto found = jacobian_at(point);
    MaterialPlace place{Eigen::VectorXd(medium_numbers), Eigen::MatrixXd(medium_numbers, medium_numbers)};
    for (std::size_t i = 0; i < medium_numbers; ++i) {
      const double unit = 2 / (high[i] - low[i]);
      place.at[static_cast<Eigen::Index>(i)] = unit * (found.value[i] - low[i]) - 1;
      for (std::size_t j = 0; j < medium_numbers; ++j)
        place.by(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = unit * found.by[i][j];
    }
    return place;
  }
};

std::optional<Similarity> similarity_of(const std::vector<OutputRange>& ranges) {
  Similarity result;
  const std::array<std::string, medium_numbers> names{"sigma_t", "albedo", "g"};
  if (ranges.size() != medium_numbers) return {};
  for (std::size_t i = 0; i < medium_numbers; ++i) {
    const auto named =
        std::find_if(ranges.begin(), ranges.end(), [&](const OutputRange& r) { return r.name == names[i]; });
    if (named == ranges.end()) return {};
    result.range[i] = *named;
    result.coordinate[i] = static_cast<std::size_t>(named - ranges.begin());
  }
  const auto& [sigma_t, albedo, g] = result.range;
  if (!(sigma_t.low > 0 && albedo.low >= 0 && albedo.high < 1 && g.low > -1 && g.high < 1)) return {};
  // Each coordinate rises or falls with each number all along, so its ends are at corners of the cube.
  result.low.fill(std::numeric_limits<double>::infinity());
  result.high.fill(-std::numeric_limits<double>::infinity());
  for (int corner = 0; corner < 1 << medium_numbers; ++corner) {
    const auto end = [&](int axis) { return (corner >> axis & 1) != 0 ? 1.0 : -1.0; };
    const auto found = result.jacobian_at(Eigen::Vector3d(end(0), end(1), end(2)));
    for (std::size_t i = 0; i < medium_numbers; ++i) {
      result.low[i] = std::min(result.low[i], found.value[i]);
      result.high[i] = std::max(result.high[i], found.value[i]);
    }
  }
  return result;
}

}  // namespace

MaterialPlace plain_place(const Eigen::VectorXd& point) {
  return {point, Eigen::MatrixXd::Identity(point.size(), point.size())};
}

MaterialCoordinates coordinates_for(const std::vector<OutputRange>& ranges) {
  const std::optional<Similarity> found = similarity_of(ranges);
  return found ? MaterialCoordinates(*found) : MaterialCoordinates(plain_place);
}

}  // namespace itn
