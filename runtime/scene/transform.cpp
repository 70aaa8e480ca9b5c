#include "runtime/scene/transform.h"

#include <cmath>

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

// Duff et al. 2017, Building an Orthonormal Basis, Revisited.
Vec3 some_perpendicular(const Vec3& n) {
  const double sign = std::copysign(1, n[2]), a = -1 / (sign + n[2]);
  return {1 + sign * n[0] * n[0] * a, sign * n[0] * n[1] * a, -sign * n[0]};
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

}  // namespace itn
