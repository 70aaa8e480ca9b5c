#include "runtime/scene/shapes/named_shapes.h"

#include <cmath>
#include <numbers>

#include "runtime/scene/shapes/polygonise.h"
#include "runtime/scene/transform.h"

namespace itn {
namespace {

constexpr double pi = std::numbers::pi;

// A band that winds three times about a ring while it goes around twice.
Solid knot() {
  std::vector<BallOnLine> line;
  constexpr int steps = 160;
  for (int i = 0; i < steps; ++i) {
    const double t = 2 * pi * i / steps, r = 0.8 + 0.36 * std::cos(3 * t);
    line.push_back({{r * std::cos(2 * t), r * std::sin(2 * t), 0.42 * std::sin(3 * t)}, 0.19});
  }
  return turned(tube(line, true), rotate({1, 0, 0}, 62));
}

// A ball with spikes towards the corners of an icosahedron and of its dual, a dodecahedron.
Solid urchin() {
  const double golden = std::numbers::phi;
  std::vector<Solid> parts{ball({0, 0, 0}, 0.5)};
  const auto spike = [&](const Vec3& towards, double reach) {
    parts.push_back(capsule({0, 0, 0}, (reach / length(towards)) * towards, 0.24, 0.03));
  };
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const double a : {-1.0, 1.0})
      for (const double b : {-1.0, 1.0}) {
        Vec3 wide{}, slim{};
        wide[axis] = a, wide[(axis + 1) % 3] = b * golden;
        slim[axis] = a / golden, slim[(axis + 1) % 3] = b * golden;
        spike(wide, 1.0);
        spike({slim[1], slim[0], slim[2]}, 0.85);
      }
  for (int i = 0; i < 8; ++i) spike({i & 1 ? 1.0 : -1.0, i & 2 ? 1.0 : -1.0, i & 4 ? 1.0 : -1.0}, 0.85);
  return turned(unite_smoothly(std::move(parts), 0.06), rotate({1, 0, 0}, 20));
}

// A fluted column with sharp ridges that turns and narrows upwards, on two square steps.
Solid spire() {
  const Solid shaft = extruded(polygon(star_corners(7, 0.42, 0.29)), 0.9);
  const Solid column = moved(tapered(twisted(shaft, 1.1, 0.45), 0.35, 0.9, 0.45), {0, 0, 0.15});
  return unite({column, moved(box({0.52, 0.52, 0.08}), {0, 0, -0.92}), moved(box({0.42, 0.42, 0.08}), {0, 0, -0.78}),
                ball({0, 0, 1.12}, 0.2)});
}

// Thin walls around a deep inside, a sharp rim, a handle.
Solid cup() {
  const Solid wall = revolved(polygon({{0, -0.8},
                                       {0.46, -0.8},
                                       {0.46, -0.72},
                                       {0.66, 0.0},
                                       {0.72, 0.75},
                                       {0.655, 0.75},
                                       {0.59, 0.02},
                                       {0.40, -0.66},
                                       {0, -0.66}}));
  const Solid inside =
      revolved(polygon({{0, -0.66}, {0.40, -0.66}, {0.59, 0.02}, {0.655, 0.75}, {0.7, 1.2}, {0, 1.2}}));
  const Solid ring = stretched(turned(torus(0.42, 0.075), rotate({1, 0, 0}, 90)), {0.9, 1, 1});
  const Solid handle = subtract(moved(ring, {0.68, 0, 0.08}), inside);
  return unite_smoothly({wall, handle}, 0.06);
}

Solid hand() {
  std::vector<Solid> parts{moved(rounded(box({0.3, 0.08, 0.3}), 0.1), {0, 0, -0.1}),
                           capsule({0, 0, -0.4}, {0, 0.02, -0.95}, 0.24, 0.26)};
  struct Finger {
    double x, reach, spread, radius;
  };
  for (const Finger f : {Finger{-0.3, 0.46, -0.14, 0.085}, Finger{-0.1, 0.6, -0.03, 0.095},
                         Finger{0.1, 0.64, 0.05, 0.1}, Finger{0.3, 0.55, 0.15, 0.095}}) {
    const Vec3 base{f.x, 0, 0.22}, middle{f.x + f.spread * 0.6, -0.03, 0.25 + 0.55 * f.reach},
        tip{f.x + f.spread, -0.16, 0.25 + f.reach};
    parts.push_back(tube({{base, f.radius * 1.15}, {middle, f.radius}, {tip, f.radius * 0.8}}, false));
  }
  parts.push_back(
      tube({{{0.26, -0.03, -0.28}, 0.15}, {{0.56, -0.16, -0.02}, 0.115}, {{0.66, -0.26, 0.22}, 0.085}}, false));
  return unite_smoothly(std::move(parts), 0.09);
}

// A cube of a triply periodic sheet: many tunnels and sharp cuts.
Solid sponge() { return intersect(box({0.8, 0.8, 0.8}), gyroid(0.95, 0.17)); }

// A sitting animal with thin ears.
Solid hare() {
  const auto egg = [](const Vec3& at, const Vec3& radii, double tilt) {
    return moved(turned(ellipsoid(radii), rotate({0, 1, 0}, tilt)), at);
  };
  std::vector<Solid> parts{egg({-0.05, 0, -0.3}, {0.5, 0.38, 0.42}, -35), egg({-0.25, 0, -0.5}, {0.42, 0.42, 0.32}, 0),
                           egg({0.38, 0, 0.28}, {0.28, 0.2, 0.21}, 20), ball({-0.68, 0, -0.55}, 0.14),
                           ball({0.62, 0, 0.18}, 0.09)};
  for (const double side : {-1.0, 1.0}) {
    const Solid ear = stretched(ellipsoid({0.11, 0.15, 0.45}), {1, 0.45, 1});
    const Transform pose = rotate({1, 0, 0}, -side * 14) * rotate({0, 1, 0}, -28);
    parts.push_back(moved(turned(ear, pose), {0.1, side * 0.17, 0.78}));
    parts.push_back(capsule({0.2, side * 0.2, -0.35}, {0.34, side * 0.2, -0.74}, 0.13, 0.075));
    parts.push_back(egg({-0.1, side * 0.34, -0.58}, {0.34, 0.14, 0.22}, 20));
    parts.push_back(capsule({0.0, side * 0.37, -0.74}, {0.26, side * 0.37, -0.76}, 0.075, 0.06));
  }
  return unite_smoothly(std::move(parts), 0.1);
}

// A coiled body that thins out, with a row of spikes and a rough skin.
Solid serpent() {
  std::vector<BallOnLine> line;
  std::vector<Solid> spikes;
  constexpr int steps = 150;
  for (int i = 0; i <= steps; ++i) {
    const double t = double(i) / steps, angle = 4.6 * pi * t, r = 0.72 - 0.32 * t;
    const double thickness = 0.035 + 0.155 * std::sin(pi * std::min(1.0, 0.05 + 0.6 * t));
    const Vec3 at{r * std::cos(angle), r * std::sin(angle), -0.55 + 0.95 * t * t + 0.45 * t};
    line.push_back({at, thickness});
    if (i % 5 == 0 && i > 25 && i < 146) {
      const Vec3 out = normalize(Vec3{at[0], at[1], 0.9});
      spikes.push_back(capsule(at, at + (thickness + 0.13) * out, 0.075, 0.02));
    }
  }
  const Vec3 neck = line.back().center;
  const double angle = 4.6 * pi + 1.9;
  const Vec3 forward{std::cos(angle), std::sin(angle), -0.15};
  Solid head = tube({{neck, 0.19}, {neck + 0.2 * forward, 0.2}, {neck + 0.46 * forward, 0.1}}, false);
  const Solid body = bumpy(tube(line, false), 0.012, 0.13);
  return unite_smoothly({unite_smoothly({body, head}, 0.08), unite(std::move(spikes))}, 0.03);
}

// A spur gear with a hub, a bore with a keyway and five holes: all edges sharp.
Solid gear() {
  constexpr int teeth = 18;
  std::vector<Vec2> corners;
  for (int i = 0; i < teeth; ++i) {
    const double shares[4] = {0, 0.2, 0.42, 0.78}, radii[4] = {1, 1, 0.82, 0.82};
    for (int k = 0; k < 4; ++k) {
      const double angle = 2 * pi * (i + shares[k]) / teeth;
      corners.push_back({radii[k] * std::cos(angle), radii[k] * std::sin(angle)});
    }
  }
  const Solid rim = extruded(polygon(corners), 0.22);
  const Solid disk = subtract(subtract(rim, moved(subtract(cylinder(0.7, 0.15), cylinder(0.32, 1)), {0, 0, 0.22})),
                              moved(subtract(cylinder(0.7, 0.15), cylinder(0.32, 1)), {0, 0, -0.22}));
  const Solid hub = unite({disk, cylinder(0.32, 0.34)});
  const Solid holes = in_ring(moved(cylinder(0.12, 1), {0.51, 0, 0}), 5);
  const Solid bore = unite({cylinder(0.17, 1), moved(box({0.08, 0.05, 1}), {0.16, 0, 0})});
  return turned(subtract(subtract(hub, holes), bore), rotate({0, 0, 1}, 25) * rotate({1, 0, 0}, 90));
}

// A round body with a spout, a handle and a lid.
Solid teapot() {
  const Solid body = unite({intersect(ellipsoid({0.68, 0.68, 0.54}), moved(box({1, 1, 1}), {0, 0, 0.58})),
                            moved(cylinder(0.42, 0.03), {0, 0, -0.44}), moved(cylinder(0.37, 0.025), {0, 0, 0.47}),
                            moved(ellipsoid({0.33, 0.33, 0.12}), {0, 0, 0.49})});
  const Solid knob = unite_smoothly({ball({0, 0, 0.7}, 0.085), capsule({0, 0, 0.55}, {0, 0, 0.66}, 0.06, 0.04)}, 0.04);
  const Vec3 tip{1.1, 0, 0.38}, along{0.65, 0, 0.76};
  const Solid spout =
      tube({{{0.5, 0, -0.2}, 0.2}, {{0.8, 0, -0.06}, 0.13}, {{0.93, 0, 0.18}, 0.09}, {tip, 0.07}}, false);
  std::vector<BallOnLine> arc;
  for (int i = 0; i <= 24; ++i) {
    const double angle = pi * (0.42 + 1.16 * i / 24);
    arc.push_back({{-0.58 + 0.44 * std::cos(angle), 0, 0.02 + 0.3 * std::sin(angle)}, 0.06});
  }
  const Solid mouth = capsule(tip + -0.03 * along, tip + 0.3 * along, 0.035, 0.045);
  return subtract(unite_smoothly({body, knob, spout, tube(arc, false)}, 0.05), mouth);
}

}  // namespace

const std::vector<NamedShape>& named_shapes() {
  static const std::vector<NamedShape> shapes{
      {"knot", false, knot}, {"urchin", false, urchin}, {"spire", false, spire}, {"cup", false, cup},
      {"hand", false, hand}, {"sponge", false, sponge}, {"hare", true, hare},    {"serpent", true, serpent},
      {"gear", true, gear},  {"teapot", true, teapot}};
  return shapes;
}

Mesh NamedShape::mesh() const { return shape_mesh(solid(), 80000); }

}  // namespace itn
