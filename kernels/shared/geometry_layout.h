/* The layout of surfaces in memory, the same for host and device. A scene's geometry is four arrays and one
 * GeometryRecord; several geometries can share the arrays, each with its own record (the first_... members).
 *
 *   nodes        inner nodes of the bounding volume hierarchy: NODE_ROWS rows of BOX_WIDTH floats, bounds of each
 *                child; the last row holds ints, the children's codes
 *   leaves       blocks of up to BOX_WIDTH primitives: BLOCK_ROWS rows of BOX_WIDTH floats
 *   primitives   a PrimitiveRecord for each triangle, sphere, disk and cylinder
 *   grid         which flights surely meet no surface (geometry/flight_grid.h) */
#ifndef ITN_GEOMETRY_LAYOUT_H
#define ITN_GEOMETRY_LAYOUT_H

#ifdef __OPENCL_VERSION__
#define LAYOUT_ALIGNED __attribute__((aligned(16)))
typedef int layout_int;
typedef uint layout_uint;
#else
#include <cstdint>
#define LAYOUT_ALIGNED alignas(16)
typedef std::int32_t layout_int;
typedef std::uint32_t layout_uint;
#endif

/* Node rows. Bounds are wider than the contents by more than the rounding errors of the box test. */
enum { NODE_LOW_X, NODE_HIGH_X, NODE_LOW_Y, NODE_HIGH_Y, NODE_LOW_Z, NODE_HIGH_Z, NODE_CHILD, NODE_ROWS };

/* Codes of children: a node's index, or, negative, a block of triangles or of round shapes. */
#define CHILD_NONE (-2147483647 - 1)
#define CHILD_BLOCK(index, is_round) (~((index)*2 + (is_round)))
#define CHILD_IS_NODE(child) ((child) >= 0)
#define CHILD_IS_ROUND(child) (~(child)&1)
#define CHILD_BLOCK_INDEX(child) (~(child) >> 1)

/* Entries of the stack of a walk; the host builds no hierarchy that needs more. */
#define TRACE_STACK(box_width) (12 * (box_width) + 48)

/* Block rows. Unused lanes of a triangle block repeat a point and are never hit; the used lanes of a round block come
 * first and the primitive of the next one is -1. */
enum {
  BLOCK_A = 0, /* triangle: the three vertices, x y z each */
  BLOCK_B = 3,
  BLOCK_C = 6,
  BLOCK_TOLERANCE = 9,  /* triangle: distance tolerance times twice the area; round: distance tolerance */
  BLOCK_PRIMITIVE = 10, /* int, index within the geometry */
  BLOCK_MARGIN = 11,    /* triangle: least barycentric coordinate of a returned position */
  BLOCK_ROWS = 12,
  BLOCK_CENTER = 0, /* round; cylinder: of the circle at its beginning */
  BLOCK_DUAL_U = 3, /* disk: dot products with (position - center) give the coordinates of edge_u and edge_v */
  BLOCK_DUAL_V = 6,
  BLOCK_DUAL_AXIS = 3, /* cylinder: the axis over its squared length */
  BLOCK_RADIUS = 11    /* sphere; 0 for a disk, below 0 for a cylinder */
};

enum {
  PRIMITIVE_SMOOTH = 1,
  PRIMITIVE_SPHERE = 2,
  PRIMITIVE_DISK = 4,
  PRIMITIVE_FLIPPED = 8,
  PRIMITIVE_CYLINDER = 16,
  PRIMITIVE_CURVED = PRIMITIVE_SPHERE | PRIMITIVE_CYLINDER,
  PRIMITIVE_ROUND = PRIMITIVE_CURVED | PRIMITIVE_DISK
};

typedef struct LAYOUT_ALIGNED {
  float normal[3]; /* unit, outward; sphere: the centre; cylinder: that of the circle at its beginning */
  float radius;    /* sphere, cylinder */
  float uv[6];     /* of the three vertices */
  layout_int shape;
  layout_uint flags; /* PRIMITIVE_... */
  float frame[9];    /* PRIMITIVE_SMOOTH: vertex normals; sphere: local x, y, z axes; disk: centre, dual u, dual v;
                        cylinder: local x, y axes, and the axis over its squared length */
  float offset;      /* how far beside the surface rays start [scene unit] */
  float tangent[2];  /* triangle: dp/du in the frame around its normal (model/shading_frame.h), of length 1 */
} PrimitiveRecord;

/* Places of PrimitiveRecord's members, in 4-byte words. */
enum {
  PRIMITIVE_AT_UV = 4,
  PRIMITIVE_AT_SHAPE = 10,
  PRIMITIVE_AT_FLAGS,
  PRIMITIVE_AT_FRAME,
  PRIMITIVE_AT_OFFSET = 21,
  PRIMITIVE_AT_TANGENT
};

/* A word of the flight grid (runtime/render/compile/flight_grid.h): octahedral normal, offset of the plane, and a byte that
 * holds the radius of the ball where there is no plane, else one of four radii and the cone. */
#define FLIGHT_NO_PLANE 255
#define FLIGHT_PLANE_RADIUS(i) (((i) + 2) * ((i) + 3) / 2) /* steps: 3, 6, 10, 15 */
#define FLIGHT_NO_CONE 63

typedef struct LAYOUT_ALIGNED {
  layout_uint first_node, first_leaf; /* in floats */
  layout_uint first_primitive, first_cell;
  layout_int root;     /* a child code, CHILD_NONE: no surface at all */
  layout_int cells[3]; /* grid; 0: none */
  float low[3];        /* bounds of all surfaces, widened */
  float cell_size;     /* [scene unit] */
  float high[3];
  float inverse_cell_size;
  float grid_low[3];
  float ball_step;   /* grid: unit of a cell's ball radius [scene unit] */
  float plane_range; /* grid: plane offsets lie in [-plane_range, plane_range] */
  float safety;      /* grid: taken off every flight [scene unit] */
  float unused[2];
} GeometryRecord;

#endif
