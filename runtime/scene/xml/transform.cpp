#include "runtime/scene/xml/transform.h"

#include <cmath>

#include "runtime/scene/transform.h"
#include "runtime/scene/xml/message.h"
#include "runtime/scene/xml/values.h"

namespace itn {
namespace {

// value="x, y, z", or one number for all three, as in Mitsuba; else x=, y=, z= with `fallback` for the missing ones.
Vec3 step_vector(const Element& step, double fallback) {
  if (step.attributes.count("value")) {
    for (const char* axis : {"x", "y", "z"})
      if (step.attributes.count(axis))
        fail(step.where, "<" + step.tag + ">: both value and " + axis + "; need one or the other");
    const std::vector<double> v = parse_numbers(step.attribute("value"), step.where, "<" + step.tag + ">");
    if (v.size() == 1) return {v[0], v[0], v[0]};
    if (v.size() != 3)
      fail(step.where, "<" + step.tag + ">: value=" + quote(step.attribute("value")) + " has " +
                           std::to_string(v.size()) + " numbers; need 3 or 1");
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

Transform parse_step(const Element& step) {
  if (step.tag == "translate") return translate(step_vector(step, 0));
  if (step.tag == "scale") return scale(step_vector(step, 1));
  if (step.tag == "rotate") {
    const Vec3 axis = step_vector(step, 0);
    if (!(length(axis) > 0)) fail(step.where, "<rotate>: the axis is (0, 0, 0); need for example y=\"1\"");
    if (!step.attributes.count("angle")) fail(step.where, "<rotate> has no angle; need degrees");
    return rotate(axis, parse_number(step.attribute("angle"), step.where, "<rotate> angle"));
  }
  if (step.tag == "lookat") {
    const Vec3 origin = lookat_vector(step, "origin"), target = lookat_vector(step, "target");
    const Vec3 forward = target - origin;
    if (!(length(forward) > 0)) fail(step.where, "<lookat>: origin and target are the same point; move one");
    Vec3 up{0, 0, 0};  // as in Mitsuba: any
    if (!step.attribute("up").empty()) up = lookat_vector(step, "up");
    if (!(length(up) > 0)) up = some_perpendicular(normalize(forward));
    if (!(length(cross(up, forward)) > 1e-9 * length(up) * length(forward)))
      fail(step.where, "<lookat>: up is parallel to the viewing direction; choose another up");
    return look_at(origin, target, up);
  }
  if (step.tag == "matrix") {
    const std::vector<double> v = parse_numbers(step.attribute("value"), step.where, "<matrix>");
    Transform out;
    if (v.size() == 16) {
      for (std::size_t i = 0; i < 12; ++i) out.m[i] = v[i];  // the last row is left out, as in Mitsuba
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

void warn_of_transforms(const Element& element, std::vector<std::string>& warnings) {
  if (element.tag == "rotate") {
    const double size = length(step_vector(element, 0));
    if (std::abs(size - 1) > 1e-3)
      warnings.push_back(to_string(element.where) + ": <rotate>: the axis has length " + to_text(size) +
                         ", so that it shears, as in Mitsuba; a turn needs a unit vector");
  }
  if (element.tag == "matrix") {
    const std::vector<double> v = parse_numbers(element.attribute("value"), element.where, "<matrix>");
    if (v.size() == 16 && !(v[12] == 0 && v[13] == 0 && v[14] == 0 && v[15] == 1))
      warnings.push_back(
          to_string(element.where) +
          ": <matrix>: the last row is not 0 0 0 1; it is left out, as in Mitsuba: transforms are affine");
  }
  for (const auto& child : element.children) warn_of_transforms(*child, warnings);
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
