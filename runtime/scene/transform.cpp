#include "runtime/scene/transform.h"

#include <cmath>

#include "runtime/scene/xml/message.h"
#include "runtime/scene/xml/values.h"

namespace itn {

Vec3 operator+(const Vec3& a, const Vec3& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
Vec3 operator-(const Vec3& a, const Vec3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Vec3 operator*(double s, const Vec3& v) { return {s * v[0], s * v[1], s * v[2]}; }
double dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double length(const Vec3& v) { return std::sqrt(dot(v, v)); }
Vec3 normalize(const Vec3& v) { return (1 / length(v)) * v; }

Transform operator*(const Transform& a, const Transform& b) {
  Transform out;
  for (std::size_t row = 0; row < 4; ++row) {
    for (std::size_t column = 0; column < 4; ++column) {
      double sum = 0;
      for (std::size_t k = 0; k < 4; ++k) sum += a.m[4 * row + k] * b.m[4 * k + column];
      out.m[4 * row + column] = sum;
    }
  }
  return out;
}

Transform translate(const Vec3& by) { return {{1, 0, 0, by[0], 0, 1, 0, by[1], 0, 0, 1, by[2], 0, 0, 0, 1}}; }

Transform scale(const Vec3& by) { return {{by[0], 0, 0, 0, 0, by[1], 0, 0, 0, 0, by[2], 0, 0, 0, 0, 1}}; }

Transform rotate(const Vec3& axis, double degrees) {
  const Vec3& a = axis;
  const double angle = degrees * M_PI / 180, c = std::cos(angle), s = std::sin(angle), k = 1 - c;
  return {{a[0] * a[0] * k + c, a[0] * a[1] * k - a[2] * s, a[0] * a[2] * k + a[1] * s, 0, a[1] * a[0] * k + a[2] * s,
           a[1] * a[1] * k + c, a[1] * a[2] * k - a[0] * s, 0, a[2] * a[0] * k - a[1] * s, a[2] * a[1] * k + a[0] * s,
           a[2] * a[2] * k + c, 0, 0, 0, 0, 1}};
}

Transform look_at(const Vec3& origin, const Vec3& target, const Vec3& up) {
  const Vec3 forward = normalize(target - origin);
  const Vec3 left = normalize(cross(up, forward));
  const Vec3 new_up = cross(forward, left);
  return {{left[0], new_up[0], forward[0], origin[0], left[1], new_up[1], forward[1], origin[1], left[2], new_up[2],
           forward[2], origin[2], 0, 0, 0, 1}};
}

Vec3 transform_vector(const Transform& t, const Vec3& v) {
  return {t.m[0] * v[0] + t.m[1] * v[1] + t.m[2] * v[2], t.m[4] * v[0] + t.m[5] * v[1] + t.m[6] * v[2],
          t.m[8] * v[0] + t.m[9] * v[1] + t.m[10] * v[2]};
}

Vec3 transform_point(const Transform& t, const Vec3& p) {
  return transform_vector(t, p) + Vec3{t.m[3], t.m[7], t.m[11]};
}

double determinant(const Transform& t) {
  return dot({t.m[0], t.m[1], t.m[2]}, cross({t.m[4], t.m[5], t.m[6]}, {t.m[8], t.m[9], t.m[10]}));
}

bool is_rigid(const Transform& t) {
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      double product = 0;
      for (std::size_t k = 0; k < 3; ++k) product += t.m[4 * i + k] * t.m[4 * j + k];
      if (!(std::abs(product - (i == j ? 1 : 0)) < 1e-4)) return false;
    }
  return true;
}

Transform inverse_transpose(const Transform& t) {
  const Vec3 r0{t.m[0], t.m[1], t.m[2]}, r1{t.m[4], t.m[5], t.m[6]}, r2{t.m[8], t.m[9], t.m[10]};
  const double s = 1 / determinant(t);
  const Vec3 c0 = s * cross(r1, r2), c1 = s * cross(r2, r0), c2 = s * cross(r0, r1);
  return {{c0[0], c0[1], c0[2], 0, c1[0], c1[1], c1[2], 0, c2[0], c2[1], c2[2], 0, 0, 0, 0, 1}};
}

namespace {

// value="x, y, z" (or one number, where `one_number_for_all`), else x=, y=, z= with `fallback` for the missing ones.
Vec3 step_vector(const Element& step, double fallback, bool one_number_for_all) {
  if (step.attributes.count("value")) {
    for (const char* axis : {"x", "y", "z"})
      if (step.attributes.count(axis))
        fail(step.where, "<" + step.tag + ">: both value and " + axis + "; need one or the other");
    const std::vector<double> v = parse_numbers(step.attribute("value"), step.where, "<" + step.tag + ">");
    if (v.size() == 1 && one_number_for_all) return {v[0], v[0], v[0]};
    if (v.size() != 3)
      fail(step.where, "<" + step.tag + ">: value=" + quote(step.attribute("value")) + " has " +
                           std::to_string(v.size()) + " numbers; need 3" + (one_number_for_all ? " or 1" : ""));
    return {v[0], v[1], v[2]};
  }
  Vec3 out{fallback, fallback, fallback};
  for (std::size_t i = 0; i < 3; ++i) {
    const std::string axis(1, "xyz"[i]);
    if (step.attributes.count(axis))
      out[i] = parse_number(step.attribute(axis), step.where, "<" + step.tag + "> " + axis);
  }
  return out;
}

Vec3 lookat_vector(const Element& step, const std::string& name) {
  if (!step.attributes.count(name))
    fail(step.where,
         "<lookat> has no " + name + "; need origin and target, for example origin=\"0, 0, 5\" target=\"0, 0, 0\"");
  const std::vector<double> v = parse_numbers(step.attribute(name), step.where, "<lookat> " + name);
  if (v.size() != 3)
    fail(step.where, "<lookat>: " + name + "=" + quote(step.attribute(name)) + " has " + std::to_string(v.size()) +
                         " numbers; need 3");
  return {v[0], v[1], v[2]};
}

// The one that Mitsuba chooses (Duff et al. 2017, Building an Orthonormal Basis, Revisited).
Vec3 some_perpendicular(const Vec3& n) {
  const double sign = std::copysign(1, n[2]), a = -1 / (sign + n[2]);
  return {1 + sign * n[0] * n[0] * a, sign * n[0] * n[1] * a, -sign * n[0]};
}

Transform parse_step(const Element& step) {
  if (step.tag == "translate") return translate(step_vector(step, 0, false));
  if (step.tag == "scale") return scale(step_vector(step, 1, true));
  if (step.tag == "rotate") {
    const Vec3 axis = step_vector(step, 0, false);
    if (!(length(axis) > 0)) fail(step.where, "<rotate>: the axis is (0, 0, 0); need for example y=\"1\"");
    if (!step.attributes.count("angle")) fail(step.where, "<rotate> has no angle; need degrees");
    return rotate(axis, parse_number(step.attribute("angle"), step.where, "<rotate> angle"));
  }
  if (step.tag == "lookat") {
    const Vec3 origin = lookat_vector(step, "origin"), target = lookat_vector(step, "target");
    const Vec3 forward = target - origin;
    if (!(length(forward) > 0)) fail(step.where, "<lookat>: origin and target are the same point; move one");
    const Vec3 up = step.attributes.count("up") ? lookat_vector(step, "up") : some_perpendicular(normalize(forward));
    if (!(length(cross(up, forward)) > 1e-9 * length(up) * length(forward)))
      fail(step.where, "<lookat>: up is zero or parallel to the viewing direction; choose another up");
    return look_at(origin, target, up);
  }
  if (step.tag == "matrix") {
    const std::vector<double> v = parse_numbers(step.attribute("value"), step.where, "<matrix>");
    Transform out;
    if (v.size() == 16) {
      for (std::size_t i = 0; i < 16; ++i) out.m[i] = v[i];
      if (v[12] != 0 || v[13] != 0 || v[14] != 0 || v[15] != 1)
        fail(step.where, "<matrix>: last row is not 0 0 0 1; need an affine transform, row by row");
    } else if (v.size() == 9) {
      for (std::size_t row = 0; row < 3; ++row)
        for (std::size_t column = 0; column < 3; ++column) out.m[4 * row + column] = v[3 * row + column];
    } else {
      fail(step.where, "<matrix>: " + std::to_string(v.size()) + " numbers; need 16 (4x4) or 9 (3x3), row by row");
    }
    return out;
  }
  fail(step.where, "<" + step.tag + "> in a <transform>" +
                       need_one_of(step.tag, {"translate", "rotate", "scale", "lookat", "matrix"}));
}

}  // namespace

void warn_of_shears(const Element& element, std::vector<std::string>& warnings) {
  if (element.tag == "rotate") {
    const double size = length(step_vector(element, 0, false));
    if (std::abs(size - 1) > 1e-3)
      warnings.push_back(to_string(element.where) + ": <rotate>: the axis has length " + to_text(size) +
                         ", so that it shears, as in Mitsuba; a turn needs a unit vector");
  }
  for (const auto& child : element.children) warn_of_shears(*child, warnings);
}

Transform parse_transform(const Element& element) {
  Transform out;
  for (const auto& step : element.children) out = parse_step(*step) * out;
  for (double v : out.m)
    if (!std::isfinite(v)) fail(element.where, "<transform>: not finite; check its steps");
  if (determinant(out) == 0)
    fail(element.where, "<transform> is singular (it flattens space); check scale and matrix steps");
  return out;
}

}  // namespace itn
