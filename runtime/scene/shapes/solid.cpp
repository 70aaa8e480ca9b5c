#include "runtime/scene/shapes/solid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "runtime/scene/transform.h"

namespace itn {
namespace {

constexpr double pi = std::numbers::pi;

// Place at which the line from a to b is nearest to p: 0 at a, 1 at b.
template <typename Vector>
double nearest_share(const Vector& p, const Vector& a, const Vector& b) {
  double along = 0, length_squared = 0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    along += (p[k] - a[k]) * (b[k] - a[k]);
    length_squared += (b[k] - a[k]) * (b[k] - a[k]);
  }
  return length_squared > 0 ? std::clamp(along / length_squared, 0.0, 1.0) : 0.0;
}

// Distance to where both coordinates are negative, given the signed distances along each.
double join(double a, double b) {
  return std::min(std::max(a, b), 0.0) + std::hypot(std::max(a, 0.0), std::max(b, 0.0));
}

// A minimum with a quadratic piece where the two are within `blend`: of both slopes always a mean.
double smooth_minimum(double a, double b, double blend) {
  const double h = std::max(blend - std::abs(a - b), 0.0);
  return std::min(a, b) - h * h / (4 * blend);
}

// The point of the cylinder about z that is nearest to p: nowhere farther apart than the points were.
Vec3 within_reach(const Vec3& p, double reach) {
  const double factor = std::min(1.0, reach / std::max(std::hypot(p[0], p[1]), 1e-9));
  return {factor * p[0], factor * p[1], p[2]};
}

// Norm (|x|^n + |y|^n)^(1/n) without overflow.
double join_powers(double x, double y, double n) {
  x = std::abs(x), y = std::abs(y);
  const double large = std::max(x, y), small = std::min(x, y);
  return large > 0 ? large * std::pow(1 + std::pow(small / large, n), 1 / n) : 0;
}

// Greatest ratio of a norm of exponent n to the Euclidean one, in the plane.
double norm_slope(double n) { return n < 2 ? std::pow(2.0, 1 / n - 0.5) : 1.0; }

}  // namespace

Area disc(double radius) {
  return [radius](double x, double y) { return std::hypot(x, y) - radius; };
}

Area polygon(const std::vector<Vec2>& corners) {
  return [corners](double x, double y) {
    double nearest = std::numeric_limits<double>::infinity();
    bool inside = false;
    for (std::size_t i = 0, j = corners.size() - 1; i < corners.size(); j = i++) {
      const Vec2 &a = corners[i], &b = corners[j];
      const double t = nearest_share(Vec2{x, y}, a, b);
      const double dx = x - a[0] - t * (b[0] - a[0]), dy = y - a[1] - t * (b[1] - a[1]);
      nearest = std::min(nearest, dx * dx + dy * dy);
      // A ray towards +x crosses the edge.
      if ((a[1] > y) != (b[1] > y) && x < a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0])) inside = !inside;
    }
    return inside ? -std::sqrt(nearest) : std::sqrt(nearest);
  };
}

std::vector<Vec2> star_corners(int points, double outer, double inner) {
  std::vector<Vec2> corners;
  for (int i = 0; i < 2 * points; ++i) {
    const double angle = pi * i / points, radius = i % 2 == 0 ? outer : inner;
    corners.push_back({radius * std::cos(angle), radius * std::sin(angle)});
  }
  return corners;
}

Area rounded(const Area& area, double radius) {
  return [area, radius](double x, double y) { return area(x, y) - radius; };
}

Solid ball(const Vec3& center, double radius) {
  return [center, radius](const Vec3& p) { return length(p - center) - radius; };
}

Solid ellipsoid(const Vec3& radii) {
  const double least = std::min({radii[0], radii[1], radii[2]});
  return [radii, least](const Vec3& p) {
    return (length(Vec3{p[0] / radii[0], p[1] / radii[1], p[2] / radii[2]}) - 1) * least;
  };
}

Solid box(const Vec3& half_size) {
  return [half_size](const Vec3& p) {
    return join(join(std::abs(p[0]) - half_size[0], std::abs(p[1]) - half_size[1]), std::abs(p[2]) - half_size[2]);
  };
}

Solid cylinder(double radius, double half_height) { return extruded(disc(radius), half_height); }

Solid torus(double radius, double tube) {
  return [radius, tube](const Vec3& p) { return std::hypot(std::hypot(p[0], p[1]) - radius, p[2]) - tube; };
}

Solid capsule(const Vec3& from, const Vec3& to, double from_radius, double to_radius) {
  return tube({{from, from_radius}, {to, to_radius}}, false);
}

Solid superquadric(const Vec3& radii, double around, double along) {
  const double least = std::min({radii[0], radii[1], radii[2]}) / (norm_slope(around) * norm_slope(along));
  return [=](const Vec3& p) {
    return (join_powers(join_powers(p[0] / radii[0], p[1] / radii[1], around), p[2] / radii[2], along) - 1) * least;
  };
}

Solid tube(const std::vector<BallOnLine>& line, bool closed) {
  struct Segment {
    Vec3 a, b;
    double a_radius, b_radius;
  };
  // Segments in runs, each in a ball: most runs are farther away than what was found before.
  struct Run {
    std::vector<Segment> segments;
    Vec3 center;
    double radius;
  };
  constexpr std::size_t run_length = 8;
  std::vector<Run> runs;
  double steepest = 0;
  const std::size_t count = closed ? line.size() : line.size() - 1;
  for (std::size_t i = 0; i < count; ++i) {
    const BallOnLine &a = line[i], &b = line[(i + 1) % line.size()];
    steepest = std::max(steepest, std::abs(b.radius - a.radius) / std::max(length(b.center - a.center), 1e-9));
    if (i % run_length == 0) runs.emplace_back();
    runs.back().segments.push_back({a.center, b.center, a.radius, b.radius});
  }
  for (Run& run : runs) {
    run.center = 0.5 * (run.segments.front().a + run.segments.back().b);
    run.radius = 0;
    for (const Segment& s : run.segments)
      run.radius = std::max({run.radius, length(s.a - run.center) + s.a_radius, length(s.b - run.center) + s.b_radius});
  }
  const double scale = 1 / std::hypot(1.0, steepest);
  return [runs, scale](const Vec3& p) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Run& run : runs) {
      if (length(p - run.center) - run.radius > nearest) continue;
      for (const Segment& s : run.segments) {
        const double t = nearest_share(p, s.a, s.b);
        const Vec3 d{p[0] - s.a[0] - t * (s.b[0] - s.a[0]), p[1] - s.a[1] - t * (s.b[1] - s.a[1]),
                     p[2] - s.a[2] - t * (s.b[2] - s.a[2])};
        nearest = std::min(nearest, length(d) - s.a_radius - t * (s.b_radius - s.a_radius));
      }
    }
    return nearest * scale;
  };
}

Solid extruded(const Area& area, double half_height) {
  return [area, half_height](const Vec3& p) { return join(area(p[0], p[1]), std::abs(p[2]) - half_height); };
}

Solid revolved(const Area& area) {
  return [area](const Vec3& p) { return area(std::hypot(p[0], p[1]), p[2]); };
}

Solid wavy_ball(double radius, const std::vector<RadialWave>& waves) {
  double sum = 0, slope = 0;
  for (const RadialWave& w : waves) {
    sum += std::abs(w.amplitude);
    slope += std::abs(w.amplitude) * length(w.wave);
  }
  // Within `core`, well inside, the direction shrinks with the position: no jump at the origin.
  const double core = std::max(0.5 * (radius - sum), 0.1 * radius);
  const double scale = 1 / (1 + slope / core);
  return [=](const Vec3& p) {
    const double distance = length(p);
    const Vec3 direction = (1 / std::max(distance, core)) * p;
    double surface = radius;
    for (const RadialWave& w : waves) surface += w.amplitude * std::cos(dot(w.wave, direction) + w.phase);
    return (distance - surface) * scale;
  };
}

Solid gyroid(double period, double thickness) {
  const double wave = 2 * pi / period;
  // The slope of the sum is sqrt(2) to sqrt(3) times the wave number on the sheet, and nowhere more.
  return [=](const Vec3& p) {
    const double x = wave * p[0], y = wave * p[1], z = wave * p[2];
    const double sum = std::sin(x) * std::cos(y) + std::sin(y) * std::cos(z) + std::sin(z) * std::cos(x);
    return std::abs(sum) / (std::sqrt(3.0) * wave) - 0.45 * thickness;
  };
}

Solid unite(std::vector<Solid> parts) {
  return [parts = std::move(parts)](const Vec3& p) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Solid& part : parts) nearest = std::min(nearest, part(p));
    return nearest;
  };
}

Solid unite_smoothly(std::vector<Solid> parts, double blend) {
  return [parts = std::move(parts), blend](const Vec3& p) {
    double nearest = parts.front()(p);
    for (std::size_t i = 1; i < parts.size(); ++i) nearest = smooth_minimum(nearest, parts[i](p), blend);
    return nearest;
  };
}

Solid intersect(const Solid& a, const Solid& b) {
  return [a, b](const Vec3& p) { return std::max(a(p), b(p)); };
}

Solid subtract(const Solid& a, const Solid& b) {
  return [a, b](const Vec3& p) { return std::max(a(p), -b(p)); };
}

Solid subtract_smoothly(const Solid& a, const Solid& b, double blend) {
  return [a, b, blend](const Vec3& p) { return -smooth_minimum(-a(p), b(p), blend); };
}

Solid rounded(const Solid& solid, double radius) {
  return [solid, radius](const Vec3& p) { return solid(p) - radius; };
}

Solid shell(const Solid& solid, double thickness) {
  return [solid, thickness](const Vec3& p) { return std::abs(solid(p)) - thickness / 2; };
}

Solid moved(const Solid& solid, const Vec3& by) {
  return [solid, by](const Vec3& p) { return solid(p - by); };
}

Solid turned(const Solid& solid, const Transform& rotation) {
  // The inverse of a rotation is its transpose.
  Transform back;
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t column = 0; column < 3; ++column) back.m[4 * row + column] = rotation.m[4 * column + row];
  return [solid, back](const Vec3& p) { return solid(transform_vector(back, p)); };
}

Solid stretched(const Solid& solid, const Vec3& factors) {
  const double least = std::min({factors[0], factors[1], factors[2]});
  return [solid, factors, least](const Vec3& p) {
    return least * solid({p[0] / factors[0], p[1] / factors[1], p[2] / factors[2]});
  };
}

Solid twisted(const Solid& solid, double turn, double reach) {
  // A shear by s stretches by at most (s + sqrt(s^2 + 4)) / 2.
  const double shear = std::abs(turn) * reach, stretch = (shear + std::sqrt(shear * shear + 4)) / 2;
  return [=](const Vec3& p) {
    const Vec3 q = within_reach(p, reach);
    const double c = std::cos(turn * q[2]), s = std::sin(turn * q[2]);
    const double inside = solid({c * q[0] + s * q[1], c * q[1] - s * q[0], q[2]}) / stretch;
    return std::max(inside, std::hypot(p[0], p[1]) - reach);
  };
}

Solid tapered(const Solid& solid, double top, double half_height, double reach) {
  const double least = std::min(1.0, top), widest = reach * std::max(1.0, top);
  const double shear = std::abs(top - 1) / (2 * half_height) * widest / least;
  const double stretch = (shear + std::sqrt(shear * shear + 4)) / 2 / least;
  return [=](const Vec3& p) {
    const Vec3 q = within_reach(p, widest);
    const double share = std::clamp((q[2] + half_height) / (2 * half_height), 0.0, 1.0);
    const double factor = 1 + (top - 1) * share;
    return std::max(solid({q[0] / factor, q[1] / factor, q[2]}) / stretch, std::hypot(p[0], p[1]) - widest);
  };
}

Solid bumpy(const Solid& solid, double amplitude, double period) {
  const double wave = 2 * pi / period, scale = 1 / (1 + std::abs(amplitude) * wave);
  return [=](const Vec3& p) {
    return (solid(p) + amplitude * std::sin(wave * p[0]) * std::sin(wave * p[1]) * std::sin(wave * p[2])) * scale;
  };
}

Solid in_ring(const Solid& solid, int count) {
  std::vector<Solid> copies{solid};
  for (int i = 1; i < count; ++i) copies.push_back(turned(solid, rotate({0, 0, 1}, 360.0 * i / count)));
  return unite(std::move(copies));
}

}  // namespace itn
