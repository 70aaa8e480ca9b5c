#include "runtime/scene/shapes/random_shape.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "runtime/base/random.h"
#include "runtime/scene/shapes/polygonise.h"
#include "runtime/scene/transform.h"

namespace itn {
namespace {

constexpr double pi = std::numbers::pi;

// Draws in their order. Each goes through a statement of its own where two are needed: the order in which arguments are
// evaluated is the compiler's.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : seed_(seed) {}
  double uniform(double low, double high) {
    constexpr std::uint64_t shapes = 0x7368617065730000u;  // the stream
    return low + (high - low) * random_uniform(seed_, shapes, drawn_++);
  }
  int whole(int low, int high) { return std::min(high, static_cast<int>(std::floor(uniform(low, high + 1)))); }
  bool chance(double probability) { return uniform(0, 1) < probability; }
  Vec3 vector(double low, double high) {
    Vec3 v;
    for (double& x : v) x = uniform(low, high);
    return v;
  }
  Vec3 direction() {
    const double z = uniform(-1, 1), angle = uniform(0, 2 * pi), r = std::sqrt(1 - z * z);
    return {r * std::cos(angle), r * std::sin(angle), z};
  }
  // Uniform: a rotation about z, then z to a uniform direction.
  Transform rotation() {
    const Transform spin = rotate({0, 0, 1}, uniform(0, 360));
    const double tilt = std::acos(uniform(-1, 1)) * 180 / pi, towards = uniform(0, 2 * pi);
    return rotate({std::cos(towards), std::sin(towards), 0}, tilt) * spin;
  }

 private:
  std::uint64_t seed_, drawn_ = 0;
};

// Balls melted into each other, each touching one before it.
Solid blob(Dice& dice) {
  std::vector<Vec3> centers{{0, 0, 0}};
  std::vector<double> radii{dice.uniform(0.3, 0.5)};
  const int count = dice.whole(3, 9);
  while (static_cast<int>(centers.size()) < count) {
    const auto at = static_cast<std::size_t>(dice.whole(0, static_cast<int>(centers.size()) - 1));
    const double radius = dice.uniform(0.14, 0.4);
    const Vec3 towards = dice.direction();
    const Vec3 center = centers[at] + (0.9 * std::max(radius, radii[at])) * towards;
    if (length(center) + radius > 1.3) continue;
    centers.push_back(center);
    radii.push_back(radius);
  }
  std::vector<Solid> parts;
  for (std::size_t i = 0; i < centers.size(); ++i) parts.push_back(ball(centers[i], radii[i]));
  return unite_smoothly(std::move(parts), dice.uniform(0.05, 0.35));
}

// A ball whose radius is a sum of waves over the directions: long ones high, short ones low.
Solid waves(Dice& dice) {
  std::vector<RadialWave> list;
  const int count = dice.whole(4, 12);
  const double roughness = dice.uniform(0.5, 1.0);
  for (int i = 0; i < count; ++i) {
    const double frequency = dice.uniform(1.5, 7);
    const Vec3 wave = frequency * dice.direction();
    const double amplitude = roughness * 0.55 / (count * std::pow(frequency / 1.5, 0.4));
    const double phase = dice.uniform(0, 2 * pi);
    list.push_back({wave, amplitude, phase});
  }
  return wavy_ball(0.8, list);
}

// From octahedra over balls and cylinders to boxes.
Solid superquadrics(Dice& dice) {
  const auto exponent = [&] { return std::pow(2.0, dice.chance(0.4) ? dice.uniform(0, 1) : dice.uniform(1, 4)); };
  const Vec3 radii = dice.vector(0.35, 1);
  const double around = exponent(), along = exponent();
  Solid one = superquadric(radii, around, along);
  if (dice.chance(0.5)) return one;
  const Transform pose = dice.rotation();
  const Vec3 other_radii = dice.vector(0.2, 0.8);
  const double other_around = exponent(), other_along = exponent();
  const Solid other = turned(superquadric(other_radii, other_around, other_along), pose);
  return dice.chance(0.5) ? unite({one, other}) : unite_smoothly({one, other}, dice.uniform(0.05, 0.3));
}

// A tube that winds q times about a ring while it goes around p times; round, and thick or thin by turns.
Solid torus_knot(Dice& dice) {
  constexpr int pairs[][2] = {{1, 0}, {1, 2}, {1, 3}, {2, 1}, {2, 3}, {2, 5}, {3, 2}, {3, 4}, {3, 5}, {1, 5}};
  const auto& [p, q] = pairs[dice.whole(0, 9)];
  const double swing = dice.uniform(0.2, 0.4), radius = dice.uniform(0.7, 0.85), height = dice.uniform(0.7, 1.3);
  const double thick = dice.uniform(0.07, 0.5 / (p + 0.25 * q)), change = dice.uniform(0, 0.45);
  const int waves = dice.whole(1, 6);
  std::vector<BallOnLine> line;
  const int steps = 48 * (p + q / 2);
  for (int i = 0; i < steps; ++i) {
    const double t = 2 * pi * i / steps, r = radius + swing * std::cos(q * t);
    line.push_back({{r * std::cos(p * t), r * std::sin(p * t), height * swing * std::sin(q * t)},
                    std::max(0.05, thick * (1 + change * std::sin(waves * t)))});
  }
  return tube(line, true);
}

// Spikes out of a ball in all directions, pointed or blunt.
Solid spikes(Dice& dice) {
  const double core = dice.uniform(0.3, 0.6), blend = dice.uniform(0.01, 0.2);
  std::vector<Solid> parts{ball({0, 0, 0}, core)};
  const int count = dice.whole(4, 22);
  const double foot = core * dice.uniform(0.25, 0.6), tip = dice.uniform(0.025, 0.14);
  for (int i = 0; i < count; ++i) {
    const Vec3 towards = dice.direction();
    const double reach = dice.uniform(core + 0.1, 1.1);
    parts.push_back(capsule({0, 0, 0}, reach * towards, foot, tip));
  }
  return unite_smoothly(std::move(parts), blend);
}

// A polygon or a star extruded upwards, twisted and tapered; edges sharp or round.
Solid prism(Dice& dice) {
  const int points = dice.whole(2, 9);
  const double inner = dice.uniform(0.35, 1.0) * 0.6, height = dice.uniform(0.12, 1.0);
  const double round = dice.chance(0.5) ? dice.uniform(0.02, 0.12) : 0.0;
  Solid solid = rounded(extruded(polygon(star_corners(points, 0.6, inner)), height), round);
  if (dice.chance(0.6)) {
    const double turn = dice.uniform(0.3, 2);
    solid = twisted(solid, dice.chance(0.5) ? turn : -turn, 0.6 + round);
  }
  if (dice.chance(0.6)) solid = tapered(solid, dice.uniform(0.25, 0.9), height, 0.6 + round);
  return solid;
}

// Two to six plain bodies joined or cut out of each other.
Solid carved(Dice& dice) {
  const auto body = [&](double size) -> Solid {
    const Vec3 half = dice.vector(0.3 * size, size);
    const int kind = dice.whole(0, 4);
    Solid solid = kind == 0   ? box(half)
                  : kind == 1 ? cylinder(half[0], half[2])
                  : kind == 2 ? ball({0, 0, 0}, half[0])
                  : kind == 3 ? torus(size - 0.35 * half[0], 0.35 * half[0])
                              : ellipsoid(half);
    const Transform pose = dice.rotation();
    return turned(solid, pose);
  };
  const double blend = dice.uniform(0.03, 0.15);
  const bool smooth = dice.chance(0.4);
  Solid solid = body(0.8);
  const int count = dice.whole(1, 5);
  for (int i = 0; i < count; ++i) {
    const Vec3 at = 0.7 * dice.direction();
    const Solid other = moved(body(0.5), at);
    if (dice.chance(0.6))
      solid = smooth ? unite_smoothly({solid, other}, blend) : unite({solid, other});
    else
      solid = smooth ? subtract_smoothly(solid, other, blend) : subtract(solid, other);
  }
  return solid;
}

// A tree of limbs, each thinner than the one it grows from.
Solid branches(Dice& dice) {
  struct Limb {
    Vec3 end, towards;
    double radius;
    int depth;
  };
  std::vector<Limb> limbs{{{0, 0, -0.8}, {0, 0, 1}, dice.uniform(0.12, 0.22), 0}};
  std::vector<Solid> parts;
  const int depth = dice.whole(2, 3), forks = depth == 2 ? dice.whole(2, 5) : dice.whole(2, 3);
  const double spread = dice.uniform(0.5, 1.2), blend = dice.uniform(0.02, 0.15);
  for (std::size_t i = 0; i < limbs.size(); ++i) {
    const Limb from = limbs[i];
    const int count = from.depth == 0 ? 1 : forks;
    for (int k = 0; k < count && from.depth <= depth; ++k) {
      const Vec3 aside = dice.direction();
      const Vec3 towards = from.depth == 0 ? from.towards : normalize(from.towards + spread * aside);
      const double reach = dice.uniform(0.3, 0.6), radius = std::max(0.05, from.radius * dice.uniform(0.55, 0.85));
      const Vec3 end = from.end + reach * towards;
      if (std::max({std::abs(end[0]), std::abs(end[1]), std::abs(end[2])}) > 1.5) continue;
      parts.push_back(capsule(from.end, end, from.radius, radius));
      limbs.push_back({end, towards, radius, from.depth + 1});
    }
  }
  return unite_smoothly(std::move(parts), blend);
}

// A body made of a periodic sheet with tunnels.
Solid porous(Dice& dice) {
  const double period = dice.uniform(0.8, 1.6), thickness = period * dice.uniform(0.13, 0.26);
  const Vec3 radii = dice.vector(0.6, 0.95), shift = dice.vector(0, period);
  const Transform pose = dice.rotation();
  const Solid whole = dice.chance(0.5) ? box(radii) : ellipsoid(radii);
  return intersect(whole, turned(moved(gyroid(period, thickness), shift), pose));
}

// A profile rotated about an axis, massive or hollowed from above: vases, bowls, chess pieces.
Solid turned_on_lathe(Dice& dice) {
  const int rings = dice.whole(3, 7);
  const bool hollow = dice.chance(0.5);
  const double wall = dice.uniform(0.08, 0.16);
  std::vector<Vec2> outer{{0, -0.9}}, inner{{0, -0.9 + 1.3 * wall}};
  for (int i = 0; i < rings; ++i) {
    const double z = -0.9 + 1.8 * i / (rings - 1), r = dice.uniform(0.25, 0.8);
    outer.push_back({r, z});
    // As far from the axis as the wall leaves; slanted walls come out thinner.
    inner.push_back({std::max(0.03, r - 1.4 * wall), i == 0 ? z + 1.3 * wall : i == rings - 1 ? z + 0.3 : z});
  }
  inner[1][1] = std::min(inner[1][1], 0.5 * (inner[0][1] + inner[2][1]));
  outer.push_back({0, 0.9});
  inner.push_back({0, 1.2});
  const double round = dice.chance(0.6) ? dice.uniform(0.02, 0.1) : 0.0;
  const Solid solid = revolved(rounded(polygon(outer), round));
  return hollow ? subtract(solid, revolved(polygon(inner))) : solid;
}

// A thin bowl or husk: the skin of another body, cut open.
Solid husk(Dice& dice) {
  const Solid body = dice.chance(0.5) ? blob(dice) : superquadrics(dice);
  const double thickness = dice.uniform(0.08, 0.16);
  const Vec3 towards = dice.direction();
  const double cut = dice.uniform(0.0, 0.25);
  return intersect(shell(body, thickness), [=](const Vec3& p) { return dot(p, towards) - cut; });
}

struct Family {
  std::string name;
  Solid (*solid)(Dice&);
};

const std::vector<Family>& families() {
  static const std::vector<Family> list{{"blob", blob},
                                        {"waves", waves},
                                        {"superquadric", superquadrics},
                                        {"knot", torus_knot},
                                        {"spikes", spikes},
                                        {"prism", prism},
                                        {"carved", carved},
                                        {"branches", branches},
                                        {"porous", porous},
                                        {"lathe", turned_on_lathe},
                                        {"husk", husk}};
  return list;
}

// Applies the random changes that any family may get.
Solid changed(Solid solid, Dice& dice) {
  if (dice.chance(0.25)) {
    const double period = dice.uniform(0.2, 0.5);
    solid = bumpy(solid, period * dice.uniform(0.03, 0.1), period);
  }
  if (dice.chance(0.2)) {
    const int count = dice.whole(1, 3);
    for (int i = 0; i < count; ++i) {
      const Transform pose = dice.rotation();
      const Vec3 at = dice.vector(-0.3, 0.3);
      const double radius = dice.uniform(0.08, 0.2);
      solid = subtract(solid, moved(turned(cylinder(radius, 4), pose), at));
    }
  }
  if (dice.chance(0.4)) solid = stretched(solid, dice.vector(0.6, 1));
  return turned(solid, dice.rotation());
}

}  // namespace

const std::vector<std::string>& random_families() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> list;
    for (const Family& family : families()) list.push_back(family.name);
    return list;
  }();
  return names;
}

Mesh RandomShape::mesh(int triangles) const { return shape_mesh(solid, triangles); }

RandomShape random_shape(std::uint64_t seed) {
  Dice dice(seed);
  const Family& family = families()[static_cast<std::size_t>(dice.whole(0, static_cast<int>(families().size()) - 1))];
  const Solid plain = family.solid(dice);
  return {family.name, changed(plain, dice)};
}

}  // namespace itn
