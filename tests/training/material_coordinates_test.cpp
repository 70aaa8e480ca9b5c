// Where materials lie for a network that is shown the scene.
#include "network/prediction/material_coordinates.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "runtime/inverse/posterior/low_discrepancy.h"

using namespace itn;

namespace {

const OutputRange sigma_t{"sigma_t", 20, 300, true}, albedo{"albedo", 0.3, 0.97, false}, g{"g", -0.1, 0.9, false};

}  // namespace

TEST_CASE("materials alike to light that is scattered often differ in g alone") {
  const MaterialCoordinates coordinates = coordinates_for({sigma_t, albedo, g});
  const auto place_of = [&](double s, double a, double cosine) {
    return coordinates(2 * Eigen::Vector3d(sigma_t.share(s), albedo.share(a), g.share(cosine)).array() - 1).at;
  };
  // sigma_a = 10 and sigma_s (1 - g) = 20 at both.
  const Eigen::VectorXd even = place_of(30, 2.0 / 3, 0), forward = place_of(50, 0.8, 0.5);
  CHECK(even[0] == Approx(forward[0]));
  CHECK(even[1] == Approx(forward[1]));
  CHECK(forward[2] - even[2] == Approx(1.0));  // .5 of a range of 1, which is a cube's side of 2
}

TEST_CASE("a material's coordinates lie between -1 and 1, touch both, and say their derivatives") {
  const std::vector<OutputRange> ranges{g, sigma_t, albedo};  // in any order
  const MaterialCoordinates coordinates = coordinates_for(ranges);
  Eigen::Vector3d low = Eigen::Vector3d::Constant(2), high = -low;
  for (int k = 0; k < 27; ++k) {
    const MaterialPlace place = coordinates(Eigen::Vector3d(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1));
    low = low.cwiseMin(place.at);
    high = high.cwiseMax(place.at);
  }
  CHECK((low - Eigen::Vector3d::Constant(-1)).norm() < 1e-12);
  CHECK((high - Eigen::Vector3d::Constant(1)).norm() < 1e-12);
  constexpr double h = 1e-6;
  for (int k = 0; k < 10; ++k) {
    const Eigen::VectorXd t = low_discrepancy_point(3, k);
    for (int i = 0; i < 3; ++i) {
      const Eigen::VectorXd way = h * Eigen::VectorXd::Unit(3, i);
      const Eigen::VectorXd slope = (coordinates(t + way).at - coordinates(t - way).at) / (2 * h);
      CHECK((coordinates(t).by.col(i) - slope).norm() < 1e-7);
    }
  }
}

TEST_CASE("materials of other numbers, or of ranges that reach an end of what there is, lie in the cube itself") {
  const OutputRange whole{"albedo", 0.3, 1, false}, alone{"g", -1, 0.9, false}, empty{"sigma_t", 0, 300, false},
      other{"eta", 1, 2, false};
  for (const std::vector<OutputRange>& ranges : {std::vector{sigma_t, whole, g}, std::vector{sigma_t, albedo, alone},
                                                 std::vector{empty, albedo, g}, std::vector{sigma_t, albedo, other}}) {
    const Eigen::Vector3d t(0.2, -0.4, 0.7);
    CHECK(coordinates_for(ranges)(t).at == t);
    CHECK(coordinates_for(ranges)(t).by == Eigen::MatrixXd::Identity(3, 3));
  }
  CHECK(coordinates_for({sigma_t, albedo})(Eigen::Vector2d(0.5, 0.1)).at == Eigen::Vector2d(0.5, 0.1));
}
