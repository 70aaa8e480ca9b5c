#include "runtime/render/compile/flight_grid.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "kernels/shared/geometry_layout.h"
#include "runtime/base/parallel.h"
#include "runtime/scene/box.h"

namespace itn {

namespace {

using Point = std::array<float, 3>;

// Cells along the longest axis. 256 would lose again by cache misses; simple shapes, of which a data set has thousands,
// get one that is built in a tenth of the time.
constexpr int fine_axis = 128, coarse_axis = 48;
constexpr std::size_t fine_from = 12'000;  // triangles; the random shapes of data sets have 10,000
constexpr float ball_steps = 4;            // radius units a cell
// Radii of the balls that planes cut: small ones hug curved surfaces, large ones let flights go far.
constexpr std::array<int, 3> plane_radius_steps{FLIGHT_PLANE_RADIUS(0), FLIGHT_PLANE_RADIUS(1), FLIGHT_PLANE_RADIUS(2)};
constexpr int largest_steps = plane_radius_steps.back();
constexpr float any_normal = 10;     // a chord longer than any between unit vectors
constexpr int near_steps = 8;        // a cell with this large a ball free of surface needs no plane
constexpr int padding = 5;           // cells around the grid in which surfaces are kept while building
constexpr int farthest = 40;         // cells: balls are not larger
constexpr float piece_cells = 1.0f;  // longest edge of a piece of surface
// Limit of a grid's samples, which are corners of pieces of surface: so many for surfaces that all obstruct each other,
// and so many more for each primitive, which suffice for small ones.
constexpr std::size_t most_samples = std::size_t{1} << 23, samples_a_primitive = 6;
// Parts of surfaces whose corners are so much farther away than they are large are not cut any more: their middles
// would be their corners. A grid whose cells are no larger tells nothing.
constexpr float coarsest = 0x1p-18f, safety_ratio = 0x1p-18f, least_cells_of_safety = 4;

Point operator-(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Point operator+(const Point& a, const Point& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
Point operator*(const Point& a, float s) { return {a[0] * s, a[1] * s, a[2] * s}; }
float dot(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
float length(const Point& a) { return std::sqrt(dot(a, a)); }
Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Point middle(const Point& a, const Point& b) { return (a + b) * 0.5f; }
Point to_float(const Vec3& p) { return {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])}; }

// Cells lie in bricks of 4 x 4 x 4: neighbours share cache lines.
int bricks(int cells) { return (cells + 3) / 4; }

struct Octahedral {
  std::uint32_t code;
  Point normal;  // as the device decodes it; its coordinates' absolute values sum to 1
};

Octahedral octahedral(const Point& n) {
  const float sum = std::fabs(n[0]) + std::fabs(n[1]) + std::fabs(n[2]);
  float x = n[0] / sum, y = n[1] / sum;
  if (n[2] < 0) {
    const float u = std::copysign(1 - std::fabs(y), x), v = std::copysign(1 - std::fabs(x), y);
    x = u;
    y = v;
  }
  const auto code = [](float a) { return static_cast<std::uint32_t>(std::lround((a * 0.5f + 0.5f) * 255)); };
  const std::uint32_t i = code(x), j = code(y);
  float a = static_cast<float>(i) * (2.0f / 255) - 1, b = static_cast<float>(j) * (2.0f / 255) - 1;
  const float c = 1 - std::fabs(a) - std::fabs(b), fold = std::max(-c, 0.0f);
  a -= std::copysign(fold, a);
  b -= std::copysign(fold, b);
  return {i | j << 8, {a, b, c}};
}

// The surfaces, cut into pieces no longer than `piece`. A piece lies in the hull of its points.
class Builder {
 public:
  // closed: media lie within closed shapes, so that cells reached from the border without crossing a surface need no
  // planes.
  Builder(FlightGrid& grid, float piece, bool closed)
      : grid_(grid), piece_(piece), closed_(closed), h_(grid.cell_size) {
    for (std::size_t k = 0; k < 3; ++k) {
      n_[k] = grid.cells[k] + 2 * padding;
      low_[k] = grid.low[k] - padding * h_;
      high_[k] = low_[k] + static_cast<float>(n_[k]) * h_;
    }
    marked_.resize(count());
  }

  // False: the grid would cost more than it is worth, or tell nothing.
  bool add(const Shape& shape) {
    left_through_ = closed_ && shape.interior >= 0;
    allowed_ += samples_a_primitive * (shape.mesh ? shape.mesh->triangle.size() : 1);
    if (shape.kind == Shape::Kind::mesh) {
      for (const auto& t : shape.mesh->triangle)
        add_any_triangle(shape.mesh->position[t[0]], shape.mesh->position[t[1]], shape.mesh->position[t[2]]);
    } else if (shape.kind == Shape::Kind::disk) {
      add_disk(shape);
    } else if (shape.kind == Shape::Kind::cylinder) {
      for (int quarter = 0; quarter < 4; ++quarter)
        add_strip(shape, {quarter * std::numbers::pi / 2, (quarter + 1) * std::numbers::pi / 2}, {0, 1});
    } else {
      add_sphere(shape);
    }
    return !given_up_;
  }

  void finish() {
    sort_points();
    measure_distances();
    find_outside();
    find_rows();
    parallel_for(grid_.cells[2], [&](int z) { fill_slice(z); });
  }

 private:
  struct Sample {
    Point position;
    Point normal;  // times area
    Point axis;    // unit; no normal of the surfaces here is farther from it than `chord`
    float chord;
  };

  std::size_t count() const {
    return static_cast<std::size_t>(n_[0]) * static_cast<std::size_t>(n_[1]) * static_cast<std::size_t>(n_[2]);
  }
  std::size_t at(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(n_[1]) + static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(n_[0]) +
           static_cast<std::size_t>(x);
  }
  int cell(float x, std::size_t axis) const {
    return std::clamp(static_cast<int>((x - low_[axis]) / h_), 0, n_[axis] - 1);
  }
  bool outside(const Box& box) {
    bool misses = false;
    for (std::size_t k = 0; k < 3; ++k) {
      misses |= box.high[k] < low_[k] || box.low[k] > high_[k];
      beyond_ |= box.low[k] < low_[k] || box.high[k] > high_[k];
    }
    return misses;
  }

  // Can a part of a surface of that size not be cut, or may none be any more?
  // size: of the surface, if its parts are placed from its middle
  bool gives_up(const Box& box, float size, float longest) {
    float largest = size;
    for (std::size_t k = 0; k < 3; ++k) largest = std::max({largest, std::fabs(box.low[k]), std::fabs(box.high[k])});
    given_up_ |=
        ++parts_ > allowed_ || samples_.size() > allowed_ || (longest > piece_ && longest < coarsest * largest);
    return given_up_;
  }

  // In double precision as long as the triangle reaches so far that rounded middles would lie beside it.
  void add_any_triangle(const Point& a, const Point& b, const Point& c) {
    constexpr float far_away = 64;
    float largest = 0, reach = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      largest = std::max({largest, std::fabs(a[k]), std::fabs(b[k]), std::fabs(c[k])});
      reach = std::max({reach, std::fabs(low_[k]), std::fabs(high_[k])});
    }
    if (largest <= far_away * reach) return add_triangle(a, b, c);
    const auto exact = [](const Point& p) { return Vec3{p[0], p[1], p[2]}; };
    add_large_triangle(exact(a), exact(b), exact(c), 2 * static_cast<double>(reach));
  }

  void add_large_triangle(const Vec3& a, const Vec3& b, const Vec3& c, double reach) {
    double longest = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double low = std::min({a[k], b[k], c[k]}), high = std::max({a[k], b[k], c[k]});
      if (high < static_cast<double>(low_[k]) || low > static_cast<double>(high_[k])) {
        beyond_ = true;
        return;
      }
      longest = std::max(longest, high - low);
    }
    if (longest <= reach) return add_triangle(to_float(a), to_float(b), to_float(c));
    const auto square = [](const Vec3& p, const Vec3& q) {
      double sum = 0;
      for (std::size_t k = 0; k < 3; ++k) sum += (p[k] - q[k]) * (p[k] - q[k]);
      return sum;
    };
    const auto halfway = [](const Vec3& p, const Vec3& q) {
      return Vec3{(p[0] + q[0]) / 2, (p[1] + q[1]) / 2, (p[2] + q[2]) / 2};
    };
    const double ab = square(a, b), bc = square(b, c), ca = square(c, a);
    if (ab >= bc && ab >= ca) {
      add_large_triangle(a, halfway(a, b), c, reach);
      add_large_triangle(halfway(a, b), b, c, reach);
    } else if (bc >= ca) {
      add_large_triangle(a, b, halfway(b, c), reach);
      add_large_triangle(a, halfway(b, c), c, reach);
    } else {
      add_large_triangle(a, b, halfway(c, a), reach);
      add_large_triangle(halfway(c, a), b, c, reach);
    }
  }

  void add_triangle(const Point& a, const Point& b, const Point& c) {
    const float ab = length(b - a), bc = length(c - b), ca = length(a - c);
    const float longest = std::max({ab, bc, ca});
    if (longest > piece_) {
      Box box;
      for (const Point& p : {a, b, c}) box.add(p);
      if (outside(box) || gives_up(box, 0, longest)) return;
      // Halved across the longest edge; equal points meet again in sort_points().
      if (ab == longest) {
        add_triangle(a, middle(a, b), c);
        add_triangle(middle(a, b), b, c);
      } else if (bc == longest) {
        add_triangle(a, b, middle(b, c));
        add_triangle(a, middle(b, c), c);
      } else {
        add_triangle(a, b, middle(c, a));
        add_triangle(middle(c, a), b, c);
      }
      return;
    }
    longest_ = std::max(longest_, longest);
    const Point normal = cross(b - a, c - a);
    add_piece({a, b, c}, normal, normal * (1.0f / 6));
  }

  // surface: normal of the plane in which all points lie, or 0.
  void add_piece(const std::vector<Point>& points, const Point& plane, const Point& normal) {
    Box box;
    for (const Point& p : points) box.add(p);
    if (outside(box)) return;
    const float size = length(normal);
    const bool known = left_through_ && size > 0;
    for (const Point& p : points)
      samples_.push_back({p, normal, known ? normal * (1 / size) : Point{0, 0, 0}, known ? 0 : any_normal});
    const float slack = 1e-3f * h_;
    const float reach = 0.5f * (h_ + slack) * (std::fabs(plane[0]) + std::fabs(plane[1]) + std::fabs(plane[2]));
    std::array<int, 3> first, last;
    for (std::size_t k = 0; k < 3; ++k) {
      first[k] = cell(box.low[k] - slack, k);
      last[k] = cell(box.high[k] + slack, k);
    }
    for (int z = first[2]; z <= last[2]; ++z)
      for (int y = first[1]; y <= last[1]; ++y)
        for (int x = first[0]; x <= last[0]; ++x)
          if (std::fabs(dot(plane, center(x, y, z) - points[0])) <= reach) marked_[at(x, y, z)] = 1;
  }

  Point center(int x, int y, int z) const {
    return {low_[0] + (static_cast<float>(x) + 0.5f) * h_, low_[1] + (static_cast<float>(y) + 0.5f) * h_,
            low_[2] + (static_cast<float>(z) + 0.5f) * h_};
  }

  // The polygon around the disk.
  void add_disk(const Shape& shape) {
    constexpr int sides = 64;
    const Point center = to_float(shape.center);
    const auto corner = [&](int i) {
      const double angle = 2 * std::numbers::pi * i / sides, r = 1 / std::cos(std::numbers::pi / sides);
      const double u = r * std::cos(angle), v = r * std::sin(angle);
      return to_float({shape.center[0] + u * shape.edge_u[0] + v * shape.edge_v[0],
                       shape.center[1] + u * shape.edge_u[1] + v * shape.edge_v[1],
                       shape.center[2] + u * shape.edge_u[2] + v * shape.edge_v[2]});
    };
    for (int i = 0; i < sides; ++i) add_triangle(center, corner(i), corner((i + 1) % sides));
  }

  void add_sphere(const Shape& shape) {
    const Point center = to_float(shape.center);
    const auto radius = static_cast<float>(shape.radius);
    const std::array<Point, 6> axes{{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}};
    for (std::size_t x = 0; x < 2; ++x)
      for (std::size_t y = 2; y < 4; ++y)
        for (std::size_t z = 4; z < 6; ++z) add_patch(center, radius, shape.flip_normals, axes[x], axes[y], axes[z]);
  }

  // The part of a sphere over the directions between a, b and c: within the hull of the triangle's corners and of the
  // corners of the parallel triangle that touches the sphere.
  void add_patch(const Point& center, float radius, bool flipped, const Point& a, const Point& b, const Point& c) {
    const Point n = cross(b - a, c - a);
    const float height = std::fabs(dot(n, a)) / length(n);
    const float outer = radius / height * (1 + 1e-6f);
    const std::vector<Point> corners{center + a * radius, center + b * radius, center + c * radius,
                                     center + a * outer,  center + b * outer,  center + c * outer};
    Box box;
    float longest = 0;
    for (const Point& p : corners) {
      box.add(p);
      for (const Point& q : corners) longest = std::max(longest, length(p - q));
    }
    if (outside(box) || gives_up(box, radius, longest)) return;
    if (longest > piece_) {
      const auto between = [](const Point& p, const Point& q) { return (p + q) * (1 / length(p + q)); };
      const Point ab = between(a, b), bc = between(b, c), ca = between(c, a);
      add_patch(center, radius, flipped, a, ab, ca);
      add_patch(center, radius, flipped, ab, b, bc);
      add_patch(center, radius, flipped, ca, bc, c);
      add_patch(center, radius, flipped, ab, bc, ca);
      return;
    }
    longest_ = std::max(longest_, longest);
    const Point out = (a + b + c) * (length(n) * radius * radius / 18);
    add_piece(corners, {0, 0, 0}, flipped ? out * -1.0f : out);
  }

  // The part of a cylinder between two angles and two places along the axis: within the hull of its corners and of the
  // edge in which the tangent planes at its sides meet.
  void add_strip(const Shape& shape, const std::array<double, 2>& angles, const std::array<double, 2>& along) {
    const double middle = (angles[0] + angles[1]) / 2, outer = (1 + 1e-6) / std::cos(angles[1] - middle);
    const auto at = [&](double angle, double radius, double place) {
      const double u = radius * std::cos(angle), v = radius * std::sin(angle);
      Vec3 p{};
      for (std::size_t k = 0; k < 3; ++k)
        p[k] = shape.center[k] + u * shape.edge_u[k] + v * shape.edge_v[k] + place * shape.axis[k];
      return to_float(p);
    };
    std::vector<Point> corners;
    for (const double place : along)
      for (const auto& [angle, radius] : {std::pair{angles[0], 1.0}, {angles[1], 1.0}, {middle, outer}})
        corners.push_back(at(angle, radius, place));
    Box box;
    float longest = 0;
    for (const Point& p : corners) {
      box.add(p);
      for (const Point& q : corners) longest = std::max(longest, length(p - q));
    }
    if (outside(box) || gives_up(box, static_cast<float>(shape.radius), longest)) return;
    const float width = length(corners[1] - corners[0]), height = length(corners[3] - corners[0]);
    if (longest > piece_) {
      const double half = (along[0] + along[1]) / 2;
      for (const int side : {0, 1}) {
        if (width > height)
          add_strip(shape, side ? std::array{middle, angles[1]} : std::array{angles[0], middle}, along);
        else
          add_strip(shape, angles, side ? std::array{half, along[1]} : std::array{along[0], half});
      }
      return;
    }
    longest_ = std::max(longest_, longest);
    const Point out = at(middle, 1, along[0]) - at(middle, 0, along[0]);
    const float share = width * height / 6 / length(out) * (shape.flip_normals ? -1.0f : 1.0f);
    add_piece(corners, {0, 0, 0}, out * share);
  }

  // Samples ordered by cell, those at one place merged.
  void sort_points() {
    const auto index = [&](const Sample& s) {
      return at(cell(s.position[0], 0), cell(s.position[1], 1), cell(s.position[2], 2));
    };
    first_.assign(count() + 1, 0);
    for (const Sample& s : samples_) ++first_[index(s) + 1];
    for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
    std::vector<Sample> sorted(samples_.size());
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    for (const Sample& s : samples_) sorted[next[index(s)]++] = s;
    std::size_t kept = 0;
    for (std::size_t i = 0; i + 1 < first_.size(); ++i) {
      const auto begin = sorted.begin() + first_[i], end = sorted.begin() + first_[i + 1];
      if (begin != end)
        std::stable_sort(begin, end, [](const Sample& a, const Sample& b) { return a.position < b.position; });
      first_[i] = static_cast<std::uint32_t>(kept);
      for (auto s = begin; s != end;) {
        const auto last = std::find_if(s, end, [&](const Sample& o) { return o.position != s->position; });
        samples_[kept++] = merged(s, last);
        s = last;
      }
    }
    first_.back() = static_cast<std::uint32_t>(kept);
    samples_.resize(kept);
  }

  template <class Iterator>
  static Sample merged(Iterator begin, Iterator end) {
    Sample all = *begin;
    for (auto s = begin + 1; s != end; ++s) {
      all.normal = all.normal + s->normal;
      all.axis = all.axis + s->axis;
    }
    const float size = length(all.axis);
    if (size > 0) all.axis = all.axis * (1 / size);
    all.chord = 0;
    for (auto s = begin; s != end; ++s) all.chord = std::max(all.chord, length(all.axis - s->axis) + s->chord);
    return all;
  }

  void find_outside() {
    outside_.assign(count(), 0);
    if (!closed_) return;
    std::vector<std::size_t> open;
    const auto visit = [&](std::size_t i) {
      if (marked_[i] || outside_[i]) return;
      outside_[i] = 1;
      open.push_back(i);
    };
    visit(0);
    const std::size_t row = static_cast<std::size_t>(n_[0]), slice = row * static_cast<std::size_t>(n_[1]);
    while (!open.empty()) {
      const std::size_t i = open.back();
      open.pop_back();
      const std::size_t x = i % row, y = i % slice / row, z = i / slice;
      if (x > 0) visit(i - 1);
      if (x + 1 < row) visit(i + 1);
      if (y > 0) visit(i - row);
      if ((y + 1) * row < slice) visit(i + row);
      if (z > 0) visit(i - slice);
      if ((z + 1) * slice < count()) visit(i + slice);
    }
  }

  // distance_: to the nearest marked cell, from centre to box, squared, in half cells.
  void measure_distances() {
    const auto square = [](int k) { return static_cast<std::uint16_t>(k == 0 ? 0 : (2 * k - 1) * (2 * k - 1)); };
    const std::uint16_t none = square(farthest + 1);
    const auto nx = static_cast<std::size_t>(n_[0]);
    std::vector<std::uint16_t> along_x(count()), along_y(count());
    distance_.resize(count());
    parallel_for(n_[2], [&](int z) {
      for (int y = 0; y < n_[1]; ++y) {
        const std::size_t row = at(0, y, z);
        int last = -1000;
        for (int x = 0; x < n_[0]; ++x) {
          if (marked_[row + static_cast<std::size_t>(x)]) last = x;
          along_x[row + static_cast<std::size_t>(x)] = square(std::min(x - last, farthest + 1));
        }
        last = 1000;
        for (int x = n_[0] - 1; x >= 0; --x) {
          if (marked_[row + static_cast<std::size_t>(x)]) last = x;
          auto& value = along_x[row + static_cast<std::size_t>(x)];
          value = std::min(value, square(std::min(last - x, farthest + 1)));
        }
      }
      for (int y = 0; y < n_[1]; ++y) nearest_row(along_x, along_y, at(0, y, z), y, n_[1], nx, nx, square, none);
    });
    parallel_for(n_[2], [&](int z) {
      const std::size_t slice = nx * static_cast<std::size_t>(n_[1]);
      for (int y = 0; y < n_[1]; ++y) nearest_row(along_y, distance_, at(0, y, z), z, n_[2], slice, nx, square, none);
    });
  }

  // to[row] = min over rows `stride` apart of from + square(rows between).
  template <class Square>
  static void nearest_row(const std::vector<std::uint16_t>& from, std::vector<std::uint16_t>& to, std::size_t row,
                          int i, int n, std::size_t stride, std::size_t length, const Square& square,
                          std::uint16_t none) {
    std::uint16_t* out = &to[row];
    std::copy_n(&from[row], length, out);
    std::uint16_t largest = none;
    for (int k = 1; k <= farthest && square(k) < largest; ++k) {
      const std::uint16_t more = square(k);
      largest = 0;
      for (const int side : {-k, k}) {
        if (i + side < 0 || i + side >= n) continue;
        const std::uint16_t* other =
            &from[row + static_cast<std::size_t>(side + n) * stride - static_cast<std::size_t>(n) * stride];
        for (std::size_t x = 0; x < length; ++x) out[x] = std::min(out[x], static_cast<std::uint16_t>(other[x] + more));
      }
      for (std::size_t x = 0; x < length; ++x) largest = std::max(largest, out[x]);
    }
  }

  void fill_slice(int z) {
    const auto words = [&](int x, int y) -> std::uint32_t& {
      const int brick = ((z >> 2) * bricks(grid_.cells[1]) + (y >> 2)) * bricks(grid_.cells[0]) + (x >> 2);
      return grid_.words[static_cast<std::size_t>(brick) * 64 +
                         static_cast<std::size_t>((z & 3) << 4 | (y & 3) << 2 | (x & 3))];
    };
    for (int y = 0; y < grid_.cells[1]; ++y)
      for (int x = 0; x < grid_.cells[0]; ++x) {
        const int px = x + padding, py = y + padding, pz = z + padding;
        float distance = 0.5f * h_ * std::sqrt(static_cast<float>(distance_[at(px, py, pz)]));
        if (beyond_)
          for (const auto& [p, n] : {std::pair{px, n_[0]}, {py, n_[1]}, {pz, n_[2]}})
            distance = std::min(distance, (static_cast<float>(std::min(p, n - 1 - p)) + 0.5f) * h_);
        const int steps = std::min(static_cast<int>(distance / grid_.ball_step), 255);
        words(x, y) = steps >= near_steps || outside_[at(px, py, pz)]
                          ? octahedral(gradient(px, py, pz)).code | FLIGHT_NO_PLANE << 16 |
                                static_cast<std::uint32_t>(steps) << 24
                          : plane_word(px, py, pz, steps);
      }
  }

  // Towards the nearest surface.
  Point gradient(int x, int y, int z) const {
    const auto d = [&](int i, int j, int k) { return static_cast<float>(distance_[at(i, j, k)]); };
    const Point g{d(x - 1, y, z) - d(x + 1, y, z), d(x, y - 1, z) - d(x, y + 1, z), d(x, y, z - 1) - d(x, y, z + 1)};
    return dot(g, g) > 0 ? g : Point{0, 0, 1};
  }

  // Usefulness of a free part of space to flights from its centre: 0 to 1. Averages d / (d + half a cell), d the
  // distance to the end of the ball or to the plane, over the cosine between flight and normal.
  float usefulness(float radius, float offset) const {
    const auto value = [&](float d) { return d / (d + 0.5f * h_); };
    float sum = 4 * value(radius);
    for (const float cosine : {0.125f, 0.375f, 0.625f, 0.875f})
      sum += value(std::max(std::min(radius, offset / cosine), 0.0f));
    return sum / 8;
  }

  // A piece that reaches into a ball has all its points within the ball's radius and this.
  float slack() const { return longest_ + grid_.safety; }

  // Finds the rows of cells beside a cell's own that hold samples within reach of its centre, and how far along them.
  void find_rows() {
    reach_ = static_cast<float>(largest_steps) * grid_.ball_step + slack();
    const int r = static_cast<int>(std::ceil(reach_ / h_ + 0.5f));
    const auto apart = [](int cells) { return std::max(std::abs(cells) - 1, 0); };
    for (int k = -r; k <= r; ++k)
      for (int j = -r; j <= r; ++j) {
        const float left = reach_ * reach_ - static_cast<float>(apart(k) * apart(k) + apart(j) * apart(j)) * h_ * h_;
        if (left >= 0) rows_.push_back({j, k, std::min(r, static_cast<int>(std::sqrt(left) / h_) + 2)});
      }
  }

  std::uint32_t plane_word(int x, int y, int z, int ball) const {
    const Point c = center(x, y, z);
    struct Near {
      Point position;
      const Sample* sample;
    };
    thread_local std::vector<Near> kept;
    std::vector<Near>& near = kept;  // whose place would else be asked for at every sample
    near.clear();
    Point normal{0, 0, 0};
    for (const Row& row : rows_) {
      const int j = y + row.y, k = z + row.z;
      if (j < 0 || j >= n_[1] || k < 0 || k >= n_[2]) continue;
      const std::uint32_t last = first_[at(std::min(x + row.x, n_[0] - 1), j, k) + 1];
      for (std::uint32_t i = first_[at(std::max(x - row.x, 0), j, k)]; i < last; ++i) {
        const Point p = samples_[i].position - c;
        const float square = dot(p, p);
        if (square > reach_ * reach_) continue;
        near.push_back({p, &samples_[i]});
        const float weight = 1 / (square + h_ * h_);
        normal = normal + samples_[i].normal * (weight * weight);
      }
    }
    if (dot(normal, normal) < 1e-30f) normal = {0, 0, 1};
    const Octahedral plane = octahedral(normal);
    const float norm = length(plane.normal);
    const Point axis = plane.normal * (1 / norm);
    std::array<float, plane_radius_steps.size()> offsets, squares, chords{};
    for (std::size_t i = 0; i < offsets.size(); ++i) {
      const float radius = static_cast<float>(plane_radius_steps[i]) * grid_.ball_step;
      offsets[i] = grid_.plane_range;
      squares[i] = (radius + slack()) * (radius + slack());
    }
    for (const auto& [p, sample] : near) {
      const float d = dot(plane.normal, p), square = dot(p, p), chord = length(axis - sample->axis) + sample->chord;
      for (std::size_t i = 0; i < offsets.size(); ++i) {
        offsets[i] = square <= squares[i] ? std::min(offsets[i], d) : offsets[i];
        chords[i] = square <= squares[i] ? std::max(chords[i], chord) : chords[i];
      }
    }
    std::uint32_t best = plane.code | FLIGHT_NO_PLANE << 16 | static_cast<std::uint32_t>(ball) << 24;
    float most = usefulness(static_cast<float>(ball) * grid_.ball_step, 1e30f);
    for (std::size_t i = 0; i < offsets.size(); ++i) {
      const float code = std::floor((offsets[i] + grid_.plane_range) / (2 * grid_.plane_range) * 254 - 1e-3f);
      const float radius = static_cast<float>(plane_radius_steps[i]) * grid_.ball_step;
      const float value = usefulness(radius, offsets[i] / norm);
      if (code < 0 || value <= most) continue;
      most = value;
      best = plane.code | static_cast<std::uint32_t>(code) << 16 | static_cast<std::uint32_t>(i) << 24 |
             cone_code(chords[i], norm) << 26;
    }
    return best;
  }

  // The least n . direction of the plane's normal n, of length `norm`, below 0, at which the direction opposes all
  // normals within a chord of n's direction.
  static std::uint32_t cone_code(float chord, float norm) {
    chord += 1e-3f;  // roundings
    if (chord >= std::numbers::sqrt2_v<float>) return FLIGHT_NO_CONE;
    const float sine = chord * std::sqrt(1 - 0.25f * chord * chord);
    return static_cast<std::uint32_t>(std::min(std::ceil(norm * sine * FLIGHT_NO_CONE), float{FLIGHT_NO_CONE}));
  }

  FlightGrid& grid_;
  float piece_;
  bool closed_;
  float h_;
  std::array<int, 3> n_{};
  Point low_{}, high_{};
  bool left_through_ = false;  // the shape being added: what is inside a medium can only leave through it
  bool beyond_ = false;        // some surface lies outside the padded grid
  bool given_up_ = false;
  std::size_t allowed_ = most_samples, parts_ = 0;  // of samples, and of parts that were looked at
  float longest_ = 0;
  std::vector<Sample> samples_;
  std::vector<std::uint32_t> first_;  // of each cell's samples
  struct Row {
    int y, z, x;  // beside the cell; up to so many cells along it
  };
  std::vector<Row> rows_;
  float reach_ = 0;  // of samples that say something about a cell, from its centre
  std::vector<std::uint8_t> marked_, outside_;
  std::vector<std::uint16_t> distance_;
};

}  // namespace

FlightGrid build_flight_grid(const Scene& scene) {
  FlightGrid grid;
  Box box;
  for (const Shape& shape : scene.shapes)
    if (shape.interior >= 0 || shape.exterior >= 0) box.add(box_of(shape));
  const float longest = box.longest_side();
  float largest = 0;
  for (std::size_t k = 0; k < 3; ++k) largest = std::max({largest, std::fabs(box.low[k]), std::fabs(box.high[k])});
  if (!(longest > 0)) return grid;
  std::size_t triangles = 0;
  for (const Shape& shape : scene.shapes)
    if (shape.mesh) triangles += shape.mesh->triangle.size();
  const int axis = triangles >= fine_from ? fine_axis : coarse_axis;
  grid.cell_size = longest / static_cast<float>(axis - 2);
  grid.ball_step = grid.cell_size / ball_steps;
  grid.plane_range = largest_steps * grid.ball_step;
  grid.safety = safety_ratio * largest;
  if (grid.cell_size < least_cells_of_safety * grid.safety) return {};
  std::size_t count = 1;
  for (std::size_t k = 0; k < 3; ++k) {
    grid.cells[k] = static_cast<int>(std::ceil((box.high[k] - box.low[k]) / grid.cell_size)) + 2;
    grid.low[k] = box.low[k] - grid.cell_size;
    count *= static_cast<std::size_t>(bricks(grid.cells[k]));
  }
  grid.words.resize(count * 64);
  bool closed = true;
  for (const Shape& shape : scene.shapes) closed &= shape.exterior < 0;
  Builder builder(grid, piece_cells * grid.cell_size, closed);
  for (const Shape& shape : scene.shapes)
    if (!builder.add(shape)) return {};  // flights are then traced
  builder.finish();
  return grid;
}

}  // namespace itn
