#ifndef ITN_FLIGHT_GRID_H
#define ITN_FLIGHT_GRID_H
#include "lib/vector.h"
#include "shared/geometry_layout.h"
inline MASK flight_is_clear(__global const uint* grid, __global const GeometryRecord* record, REAL3 position, REAL3 direction, REAL distance, MASK active) { return (MASK)(0); }
#endif
