// Coordinates of a material in which images bend evenly. In the shares of a network's ranges they do not: towards an
// albedo of 1 they bend ever more, and one number may do what another does. Light that is scattered often knows the
// transport coefficient and the similarity parameter (`similarity` in parameter_chain.h), so that images change little
// with g where these stay.
#pragma once
#include <Eigen/Core>
#include <functional>
#include <vector>

#include "network/model/output_range.h"

namespace itn {

struct MaterialPlace {
  Eigen::VectorXd at;  // coordinates
  Eigen::MatrixXd by;  // their derivatives by those of the cube: a row a coordinate
};

// Where a material of the cube [-1, 1]^d lies.
using MaterialCoordinates = std::function<MaterialPlace(const Eigen::VectorXd&)>;

MaterialPlace plain_place(const Eigen::VectorXd& point);  // in the cube itself

// Of a cube whose coordinates are shares of the ranges: the similarity coordinates, over their own ranges in the cube,
// where the ranges are sigma_t's, albedo's and g's, in any order; else plain_place.
MaterialCoordinates coordinates_for(const std::vector<OutputRange>& ranges);

}  // namespace itn
