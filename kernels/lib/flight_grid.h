#ifndef ITN_FLIGHT_GRID_H
#define ITN_FLIGHT_GRID_H
#include "lib/vector.h"
#include "shared/geometry_layout.h"
inline MASK flight_is_clear(__global const uint* grid, __global const GeometryRecord* record, REAL3 position, REAL3 direction, REAL distance, MASK active) { return (MASK)(0); }
inline REAL surface_distance(__global const uint* grid, __global const GeometryRecord* record, REAL3 p) { return MAX((REAL)(0.0f), 1.0f - SQRT(dot3(p, p))); }
inline REAL3 surface_normal_guess(__global const uint* grid, __global const GeometryRecord* record, REAL3 p) { return scale3(p, 1.0f / SQRT(dot3(p, p))); }
#endif
