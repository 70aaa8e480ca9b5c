// The surface of a field that is given on a grid, as a triangle mesh: Mitsuba's sdfgrid.
#pragma once
#include <array>
#include <vector>

#include "itn/scene.h"

namespace itn {

// Values at the corners of cells that fill the unit cube, x fastest; below 0 is inside.
struct LevelSet {
  std::array<std::size_t, 3> size{};  // corners along x, y, z, 2 or more each
  std::vector<float> value;
};

enum class LevelSetNormals {
  analytic,  // the gradient of the trilinear interpolation, which jumps from cell to cell
  smooth     // blended from the directions of those of the eight nearest cells (Hansson-Soederlund et al. 2022)
};

// Mesh of the zero set of the trilinear interpolation, with normals that point to where it grows; open where it meets
// the cube's faces. Marching tetrahedra, in steps of a third of a cell or, of large grids, more. Empty where the field
// has no zero.
Mesh level_set_mesh(const LevelSet& field, LevelSetNormals normals);

}  // namespace itn
