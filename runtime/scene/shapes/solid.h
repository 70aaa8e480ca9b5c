// Solids as functions of position: primitives, and what makes new solids of them.
#pragma once
#include <array>
#include <functional>
#include <vector>

#include "itn/scene.h"

namespace itn {

// Negative inside, positive outside, in the solid's own units. The slope is at most 1, |f(a) - f(b)| <= |a - b|, so
// that |f| is never more than the distance to the surface: polygonise() skips space on the strength of it. Every
// function below keeps that; sizes and radii are positive.
using Solid = std::function<double(const Vec3&)>;
using Area = std::function<double(double x, double y)>;  // the same in the plane

// --- areas ---
Area disc(double radius);
// The inside of a simple closed polygon, in either order.
Area polygon(const std::vector<Vec2>& corners);
// Corners of a star of 2 * points corners at two radii in turn; outer == inner: a regular polygon of twice the points.
std::vector<Vec2> star_corners(int points, double outer, double inner);
Area rounded(const Area& area, double radius);  // grown by radius, corners round

// --- primitives, about the origin unless said ---
Solid ball(const Vec3& center, double radius);
Solid ellipsoid(const Vec3& radii);
Solid box(const Vec3& half_size);
Solid cylinder(double radius, double half_height);  // about z
Solid torus(double radius, double tube);            // around z
Solid capsule(const Vec3& from, const Vec3& to, double from_radius, double to_radius);
// |x/a|, |y/b| joined with exponent `around`, the result and |z/c| with exponent `along`: 2 is round, 1 an edge along
// every axis plane, large is a box. Exponents >= 1.
Solid superquadric(const Vec3& radii, double around, double along);
// A tube along a line of balls, radius interpolated between them; the last is joined to the first when closed.
struct BallOnLine {
  Vec3 center;
  double radius;
};
Solid tube(const std::vector<BallOnLine>& line, bool closed);
Solid extruded(const Area& area, double half_height);  // along z
Solid revolved(const Area& area);                      // around z; the area's x is the distance from the axis
// The set where the distance from the origin is below radius + sum of amplitude * cos(wave . direction + phase).
struct RadialWave {
  Vec3 wave;
  double amplitude, phase;
};
Solid wavy_ball(double radius, const std::vector<RadialWave>& waves);
// A triply periodic sheet (the gyroid) with the given period and about the given thickness; endless.
Solid gyroid(double period, double thickness);

// --- operations ---
Solid unite(std::vector<Solid> parts);
// Unions whose joints are filled, differences whose edges are rounded, over about `blend`.
Solid unite_smoothly(std::vector<Solid> parts, double blend);
Solid intersect(const Solid& a, const Solid& b);
Solid subtract(const Solid& a, const Solid& b);
Solid subtract_smoothly(const Solid& a, const Solid& b, double blend);
Solid rounded(const Solid& solid, double radius);   // grown by radius, edges round
Solid shell(const Solid& solid, double thickness);  // the space within thickness / 2 of the surface
Solid moved(const Solid& solid, const Vec3& by);
Solid turned(const Solid& solid, const Transform& rotation);  // a rotation about the origin
Solid stretched(const Solid& solid, const Vec3& factors);
// Twist about z by `turn` radians a unit of height. `reach`: no part of the solid is farther from the axis.
Solid twisted(const Solid& solid, double turn, double reach);
// Cross-sections are scaled by 1 at the height -half_height, by `top` at +half_height, linearly between, constant
// beyond.
Solid tapered(const Solid& solid, double top, double half_height, double reach);
// The surface pushed in and out by amplitude * sin(x) sin(y) sin(z) with the given period.
Solid bumpy(const Solid& solid, double amplitude, double period);
// `count` copies in a ring around z, the first in place.
Solid in_ring(const Solid& solid, int count);

}  // namespace itn
