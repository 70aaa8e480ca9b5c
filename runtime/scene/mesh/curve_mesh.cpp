#include "runtime/scene/mesh/curve_mesh.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "itn/error.h"
#include "itn/file.h"
#include "runtime/scene/mesh/mesh_text.h"
#include "runtime/scene/transform.h"

namespace itn {
namespace {

using std::numbers::pi;

// Corners of a circle, whose chords lie a fifth of a percent of the radius inside where there are 48, and steps of a
// spline from one control point to the next: fewer of many points, which are thin hairs.
struct Fineness {
  std::size_t sides, steps;
};
constexpr std::size_t many_points = 20'000;  // from where on what lies inside of a curve is left out
Fineness fineness_of(const std::vector<Curve>& curves) {
  std::size_t points = 0;
  for (const Curve& curve : curves) points += curve.size();
  return points < 2000 ? Fineness{48, 24} : points < many_points ? Fineness{16, 12} : Fineness{8, 4};
}
constexpr std::size_t most_curve_points = 500'000;  // of a file: up to 32 million triangles

// Mitsuba's texture coordinate u is the angle about the curve from z x tangent, over 2 pi.
struct Frame {
  Vec3 first, second;
};
Frame frame_about(const Vec3& tangent) {
  const Vec3 across = cross({0, 0, 1}, tangent);
  const Vec3 first = length(across) > 1e-9 ? normalize(across) : Vec3{tangent[2] > 0 ? 1.0 : -1.0, 0, 0};
  return {first, cross(tangent, first)};
}

std::array<float, 3> single(const Vec3& v) {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

void add_vertex(Mesh& mesh, const Vec3& position, const Vec3& normal, double u, double v) {
  mesh.position.push_back(single(position));
  mesh.normal.push_back(single(normal));
  mesh.texcoord.push_back({static_cast<float>(u), static_cast<float>(v)});
}

// Triangles between the ring of vertices that begins at `ring` and the one after it, each of sides + 1: the seam is
// double.
void join_rings(Mesh& mesh, std::size_t ring, std::size_t sides) {
  for (std::size_t k = 0; k < sides; ++k) {
    const auto a = static_cast<std::uint32_t>(ring + k), b = static_cast<std::uint32_t>(ring + sides + 1 + k);
    mesh.triangle.push_back({a, a + 1, b + 1});
    mesh.triangle.push_back({a, b + 1, b});
  }
}

// Vertices about the tangent, the first one twice: vertex_at(e) is position and normal in the direction e across it.
template <class Normal>
void add_ring(Mesh& mesh, const Vec3& tangent, std::size_t sides, double v, const Normal& vertex_at) {
  const Frame f = frame_about(tangent);
  for (std::size_t k = 0; k <= sides; ++k) {
    const double u = static_cast<double>(k) / static_cast<double>(sides), angle = 2 * pi * u;
    const Vec3 e = std::cos(angle) * f.first + std::sin(angle) * f.second;
    const auto [position, normal] = vertex_at(e);
    add_vertex(mesh, position, normal, u, v);
  }
}

// Up to the place along the tangent, in radii, behind which all is hidden.
void add_ball(Mesh& mesh, const ControlPoint& p, const Vec3& tangent, std::size_t sides, double v, double hidden = 1) {
  const std::size_t rings = sides / 2, first = mesh.position.size();
  for (std::size_t i = 0; i <= rings; ++i) {
    const double lean = pi * static_cast<double>(i) / static_cast<double>(rings);
    if (i > 0 && -std::cos(pi * static_cast<double>(i - 1) / static_cast<double>(rings)) > hidden - 1e-9) return;
    add_ring(mesh, tangent, sides, v, [&](const Vec3& e) {
      const Vec3 n = std::sin(lean) * e - std::cos(lean) * tangent;
      return std::pair(p.position + p.radius * n, n);
    });
    if (i > 0) join_rings(mesh, first + (i - 1) * (sides + 1), sides);
  }
}

// Uniform cubic B-spline of four values: the value, its first and its second derivative.
template <class Value>
std::array<Value, 3> spline(const Value& a, const Value& b, const Value& c, const Value& d, double t) {
  const double s = 1 - t;
  return {(s * s * s / 6) * a + ((3 * t * t * t - 6 * t * t + 4) / 6) * b +
              ((-3 * t * t * t + 3 * t * t + 3 * t + 1) / 6) * c + (t * t * t / 6) * d,
          (-s * s / 2) * a + ((3 * t * t - 4 * t) / 2) * b + ((-3 * t * t + 2 * t + 1) / 2) * c + (t * t / 2) * d,
          s * a + (3 * t - 2) * b + (1 - 3 * t) * c + t * d};
}

}  // namespace

std::vector<Curve> read_curves(const std::string& file, std::size_t least) {
  const std::string text = read_file(file);
  TextCursor cursor(text, file);
  std::vector<Curve> curves(1);
  std::size_t points = 0;
  const auto end_curve = [&] {
    if (curves.back().empty()) return;
    if (curves.back().size() < least)
      cursor.fail(fmt::format("a curve of {} points ends here; need {} or more", curves.back().size(), least));
    curves.emplace_back();
  };
  while (!cursor.at_end()) {
    std::string_view line = cursor.next_line();
    std::array<double, 4> values{};
    std::size_t count = 0;
    for (std::string_view word = take_word(line); !word.empty(); word = take_word(line)) {
      if (count == 4) cursor.fail("more than four numbers; need x, y, z and radius");
      if (!parse_whole(word, values[count]) || !std::isfinite(static_cast<float>(values[count])))
        cursor.fail(fmt::format("\"{}\" is no number; need x, y, z and radius", word));
      ++count;
    }
    if (count == 0) {
      end_curve();
      continue;
    }
    if (count < 4) cursor.fail(fmt::format("{} numbers; need x, y, z and radius", count));
    if (!(values[3] >= 0)) cursor.fail(fmt::format("radius {}; need 0 or more", values[3]));
    if (++points > most_curve_points)
      cursor.fail(fmt::format("more than {} points; split the file", most_curve_points));
    curves.back().push_back({{values[0], values[1], values[2]}, values[3]});
  }
  end_curve();
  curves.pop_back();
  if (curves.empty()) throw InputError(file + ": no curve; need lines of x, y, z and radius");
  return curves;
}

Mesh linear_curve_mesh(const std::vector<Curve>& curves) {
  Mesh mesh;
  const std::size_t sides = fineness_of(curves).sides;
  std::size_t segments = 0, segment = 0, points = 0;
  for (const Curve& curve : curves) {
    segments += curve.size() - 1;
    points += curve.size();
  }
  const auto place = [&](std::size_t at) { return static_cast<double>(at) / static_cast<double>(segments); };
  for (const Curve& curve : curves) {
    for (std::size_t i = 0; i + 1 < curve.size(); ++i, ++segment) {
      const ControlPoint &a = curve[i], &b = curve[i + 1];
      const double distance = length(b.position - a.position), lean = (a.radius - b.radius) / distance;
      const bool inside = !(distance > std::abs(a.radius - b.radius));  // one ball within the other
      const Vec3 tangent = distance > 0 ? normalize(b.position - a.position) : Vec3{0, 0, 1};
      add_ball(mesh, a, tangent, sides, place(segment), points < many_points || inside ? 1 : lean);
      if (i + 2 == curve.size()) add_ball(mesh, b, tangent, sides, place(segment + 1));
      if (inside) continue;
      const std::size_t ring = mesh.position.size();
      for (const ControlPoint* p : {&a, &b})
        add_ring(mesh, tangent, sides, place(p == &a ? segment : segment + 1), [&](const Vec3& e) {
          const Vec3 n = std::sqrt(1 - lean * lean) * e + lean * tangent;
          return std::pair(p->position + p->radius * n, n);
        });
      join_rings(mesh, ring, sides);
    }
  }
  return mesh;
}

Mesh bspline_curve_mesh(const std::vector<Curve>& curves) {
  Mesh mesh;
  const Fineness fineness = fineness_of(curves);
  const std::size_t sides = fineness.sides, steps = fineness.steps;
  std::size_t segments = 0, segment = 0;
  for (const Curve& curve : curves) segments += curve.size() - 3;
  for (const Curve& curve : curves) {
    Vec3 tangent{0, 0, 1};
    for (std::size_t i = 0; i + 3 < curve.size(); ++i, ++segment)
      for (std::size_t k = i == 0 ? 0 : 1; k <= steps; ++k) {
        const double t = static_cast<double>(k) / static_cast<double>(steps);
        const auto c =
            spline(curve[i].position, curve[i + 1].position, curve[i + 2].position, curve[i + 3].position, t);
        const auto r = spline(curve[i].radius, curve[i + 1].radius, curve[i + 2].radius, curve[i + 3].radius, t);
        const double speed = length(c[1]);
        if (speed > 0) tangent = normalize(c[1]);
        const std::size_t ring = mesh.position.size();
        const double v = (static_cast<double>(segment) + t) / static_cast<double>(segments);
        // The derivative by t moves the centre along the tangent, e against the curvature, and the radius.
        add_ring(mesh, tangent, sides, v, [&](const Vec3& e) {
          const double along = speed > 0 ? speed - r[0] * dot(e, c[2]) / speed : 1;
          const Vec3 n = along * e - r[1] * tangent;
          return std::pair(c[0] + r[0] * e, along > 0 ? normalize(n) : e);
        });
        if (i > 0 || k > 0) join_rings(mesh, ring - sides - 1, sides);
      }
  }
  return mesh;
}

}  // namespace itn
