/* Flights that surely meet no surface need no ray test: steps through the surface-free parts of space that the grid's
 * cells know (runtime/render/compile/flight_grid.h has the format). */
#ifndef ITN_FLIGHT_GRID_H
#define ITN_FLIGHT_GRID_H
#include "shared/vector.h"
#include "shared/geometry_layout.h"

/* The cell of a position. */
typedef struct {
  REAL3 from;   /* centre to position */
  REAL3 normal; /* of the plane, absolute values sum to 1 */
  REAL offset;  /* no surface in the ball where normal . x < offset */
  REAL radius;  /* of the ball around the centre */
  REAL cone;    /* in the ball every surface's outward normal has normal . direction < 0 if the plane's is < -cone */
} FlightCell;

/* Without a grid: a cell of which nothing is known. The load rarely hits a near cache: ask early. */
__attribute__((always_inline)) INLINE FlightCell flight_cell(__global const uint* grid,
                                                             __global const GeometryRecord* record, REAL3 position) {
  const int nx = record->cells[0], ny = record->cells[1], nz = record->cells[2];
  if (nx == 0) {
    const REAL zero = (REAL)(0.0f);
    const FlightCell nothing = {make3(zero, zero, zero), make3(zero, zero, (REAL)(1.0f)), zero, zero, (REAL)(2.0f)};
    return nothing;
  }
  const REAL gx = (position.x - record->grid_low[0]) * record->inverse_cell_size,
             gy = (position.y - record->grid_low[1]) * record->inverse_cell_size,
             gz = (position.z - record->grid_low[2]) * record->inverse_cell_size;
  const INT ix = clamp(CAST_INT(gx), (INT)(0), (INT)(nx - 1)), iy = clamp(CAST_INT(gy), (INT)(0), (INT)(ny - 1)),
            iz = clamp(CAST_INT(gz), (INT)(0), (INT)(nz - 1));
  __global const int* cells = (__global const int*)(grid + record->first_cell);
  /* bricks of 4 x 4 x 4 cells: neighbours share cache lines */
  const int bx = (nx + 3) / 4, by = (ny + 3) / 4;
  const INT brick = ((iz >> 2) * by + (iy >> 2)) * bx + (ix >> 2);
  const INT word = GATHER_INT(cells, (brick << 6) + ((iz & 3) << 4) + ((iy & 3) << 2) + (ix & 3));
  FlightCell cell;
  cell.from.x = (gx - CAST_REAL(ix) - 0.5f) * record->cell_size;
  cell.from.y = (gy - CAST_REAL(iy) - 0.5f) * record->cell_size;
  cell.from.z = (gz - CAST_REAL(iz) - 0.5f) * record->cell_size;
  const INT offset = (word >> 16) & 255, top = (word >> 24) & 255;
  const MASK plane = offset != FLIGHT_NO_PLANE;
  cell.radius = CAST_REAL(SELECT_INT(plane, FLIGHT_PLANE_RADIUS(top & 3), top)) * record->ball_step;
  cell.offset = SELECT(plane, CAST_REAL(offset) * (record->plane_range * (2.0f / 254)) - record->plane_range, 1e30f);
  cell.cone = SELECT(plane & ((top >> 2) != FLIGHT_NO_CONE), CAST_REAL(top >> 2) * (1.0f / FLIGHT_NO_CONE), 2.0f);
  const REAL a = CAST_REAL(word & 255) * (2.0f / 255) - 1.0f, b = CAST_REAL((word >> 8) & 255) * (2.0f / 255) - 1.0f,
             c = 1.0f - fabs(a) - fabs(b);
  const REAL fold = MAX(-c, (REAL)(0.0f));
  cell.normal = make3(a - copysign(fold, a), b - copysign(fold, b), c);
  return cell;
}

/* The distance over which a path inside a medium that travels along `direction` surely meets no surface: ahead of
 * the cell's position (way 1), or on its way to it (way -1), if it is inside where it comes that near. Unit direction.
 *
 * Inside, only surfaces that the path leaves through, direction . normal > 0, can be met: where every surface of the
 * ball faces the other way, the path goes on to the ball's end. So the flights that start on a surface are spared a
 * test. */
INLINE REAL clear_distance(__global const GeometryRecord* record, const FlightCell* cell, REAL3 direction, float way) {
  /* To the end of the ball. */
  const REAL along = way * dot3(cell->from, direction);
  const REAL square = cell->radius * cell->radius - dot3(cell->from, cell->from);
  const REAL in_ball = SELECT(square > 0.0f, SQRT(along * along + square) - along, 0.0f);
  /* To the plane. */
  const REAL speed = dot3(cell->normal, direction), room = cell->offset - dot3(cell->normal, cell->from);
  const REAL nearing = way * speed;
  const REAL to_plane = SELECT(room > 0.0f, SELECT(nearing > 0.0f, room / nearing, 1e30f), 0.0f);
  const REAL in_front = SELECT(speed < -cell->cone, 1e30f, to_plane);
  return MAX(MIN(in_ball, in_front) - record->safety, (REAL)(0.0f));
}

/* Does a flight of `distance` surely end before any surface? start, end: the cells of its ends, the former inside a
 * medium. False is always a correct answer. Looks from both ends: the end's cell is the start's of the next flight, so
 * it costs no load. What the end's cell says holds once the flight is known to be clear up to there. */
INLINE MASK flight_is_clear(__global const GeometryRecord* record, const FlightCell* start, const FlightCell* end,
                            REAL3 direction, REAL distance) {
  return clear_distance(record, start, direction, 1.0f) >= distance - clear_distance(record, end, direction, -1.0f);
}

/* A lower bound of the distance to any surface. */
INLINE REAL surface_distance(__global const GeometryRecord* record, const FlightCell* cell) {
  const REAL in_ball = cell->radius - SQRT(dot3(cell->from, cell->from));
  /* |normal| <= 1 */
  const REAL in_front = cell->offset - dot3(cell->normal, cell->from);
  return MAX(MIN(in_ball, in_front) - record->safety, (REAL)(0.0f));
}

/* A guess of the outward normal of the nearest surface. */
INLINE REAL3 surface_normal_guess(const FlightCell* cell) {
  return scale3(cell->normal, 1.0f / SQRT(dot3(cell->normal, cell->normal)));
}

#endif
