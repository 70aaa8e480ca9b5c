// The surfaces of scenes in the form in which the device reads them.
#pragma once
#include <cstddef>
#include <vector>

#include "itn/scene.h"
#include "kernels/shared/geometry_layout.h"

namespace itn {

static_assert(sizeof(PrimitiveRecord) == 96 && sizeof(GeometryRecord) == 96);
static_assert(offsetof(PrimitiveRecord, uv) == 4 * PRIMITIVE_AT_UV &&
              offsetof(PrimitiveRecord, shape) == 4 * PRIMITIVE_AT_SHAPE &&
              offsetof(PrimitiveRecord, flags) == 4 * PRIMITIVE_AT_FLAGS &&
              offsetof(PrimitiveRecord, frame) == 4 * PRIMITIVE_AT_FRAME &&
              offsetof(PrimitiveRecord, offset) == 4 * PRIMITIVE_AT_OFFSET &&
              offsetof(PrimitiveRecord, tangent) == 4 * PRIMITIVE_AT_TANGENT);

// One or more geometries in shared arrays, see geometry_layout.h.
struct Geometry {
  int box_width = 16;  // children of a node, primitives of a block; the device's BOX_WIDTH: 16, 8 or 4
  std::vector<float> nodes, leaves;
  std::vector<PrimitiveRecord> primitives;
  std::vector<std::uint32_t> grid;
  std::vector<GeometryRecord> records;
  std::vector<float> texture_axes;  // launch_arguments.h; empty: no surface needs them
};

// Appends the surfaces of a scene: the new record is the last one. The result does not depend on the number of threads.
void append_geometry(const Scene& scene, Geometry& geometry);

// Appends all geometries of another one with the same box_width.
void append_geometry(const Geometry& from, Geometry& geometry);

}  // namespace itn
