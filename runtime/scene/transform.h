// The algebra of vectors and of 4x4 transforms, which are composed as in Mitsuba.
#pragma once
#include "itn/scene.h"

namespace itn {

Transform operator*(const Transform& a, const Transform& b);
Transform translate(const Vec3& by);
Transform scale(const Vec3& by);
Transform rotate(const Vec3& axis, double degrees);  // a rotation for a unit axis; others shear, as in Mitsuba
// Columns: left, up, viewing direction, origin. up must not be parallel to target - origin.
Transform look_at(const Vec3& origin, const Vec3& target, const Vec3& up);

// A unit vector at right angles to a unit vector: the one that Mitsuba chooses.
Vec3 some_perpendicular(const Vec3& n);

Vec3 transform_point(const Transform& t, const Vec3& p);  // affine: the last row is not used
Vec3 transform_vector(const Transform& t, const Vec3& v);
double determinant(const Transform& t);  // of the upper left 3x3 block
// Does it keep lengths? Translations, rotations, reflections.
bool is_rigid(const Transform& t);
// Inverse transpose of the upper left 3x3 block (for normals). The determinant must not be zero.
Transform inverse_transpose(const Transform& t);

Vec3 operator+(const Vec3& a, const Vec3& b);
Vec3 operator-(const Vec3& a, const Vec3& b);
Vec3 operator*(double s, const Vec3& v);
double dot(const Vec3& a, const Vec3& b);
Vec3 cross(const Vec3& a, const Vec3& b);
double length(const Vec3& v);
Vec3 normalize(const Vec3& v);

}  // namespace itn
