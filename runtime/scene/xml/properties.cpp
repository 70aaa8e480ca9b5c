#include "runtime/scene/xml/properties.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "itn/file.h"
#include "itn/load_scene.h"
#include "runtime/scene/xml/message.h"
#include "runtime/scene/xml/transform.h"
#include "runtime/scene/xml/values.h"

namespace itn {
namespace {

void remember(std::vector<std::string>& names, const std::string& name) {
  if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
}

std::string tags_in_words(const std::vector<std::string>& tags) {
  std::string out;
  for (std::size_t i = 0; i < tags.size(); ++i)
    out += (i == 0 ? "<" : i + 1 < tags.size() ? ", <" : " or <") + tags[i] + ">";
  return out;
}

}  // namespace

Properties::Properties(const Document& document, const Element& element, Report& report)
    : document_(document), element_(element), report_(report) {
  std::map<std::string, const Element*> seen;
  for (const auto& child : element.children) {
    const std::string& name = child->attribute("name");
    if (name.empty() && !is_object_tag(child->tag) && child->tag != "ref" && child->tag != "alias")
      report_.add(child->where, title() + ": <" + child->tag + "> has no name; need name=\"...\"");
    if (name.empty()) continue;
    const auto [other, is_new] = seen.emplace(name, child.get());
    if (!is_new)
      report_.add(child->where, title() + ": " + quote(name) + " given twice, first at " +
                                    to_string(other->second->where) + "; need it once");
  }
}

std::string Properties::title() const { return element_.tag == "scene" ? "scene" : element_.tag + " " + quote(type()); }

void Properties::fail_at(const std::string& name, const std::string& what) const {
  for (const auto& child : element_.children)
    if (child->attribute("name") == name) fail(child->where, title() + ": " + what);
  fail(element_.where, title() + ": " + what);
}

const Element& Properties::resolve(const Element& child) const {
  return child.tag == "ref" ? *document_.by_id.at(child.attribute("id")) : child;
}

const Element* Properties::value_of(const std::string& name, const std::vector<std::string>& tags) {
  remember(known_, name);
  for (const auto& child : element_.children) {
    if (child->attribute("name") != name) continue;
    if (std::find(tags.begin(), tags.end(), child->tag) == tags.end())
      fail(child->where, title() + ": " + quote(name) + " is a <" + child->tag + ">; need " + tags_in_words(tags));
    if (child->tag != "transform" && child->tag != "vector" && child->tag != "point" && child->tag != "spectrum" &&
        !child->attributes.count("value"))
      fail(child->where, title() + ": " + quote(name) + " has no value; need value=\"...\"");
    used_.insert(child.get());
    return child.get();
  }
  return nullptr;
}

bool Properties::has(const std::string& name) {
  remember(known_, name);
  return std::any_of(element_.children.begin(), element_.children.end(),
                     [&](const auto& child) { return child->attribute("name") == name; });
}

double Properties::number(const std::string& name, double fallback) {
  const Element* value = value_of(name, {"float", "integer"});
  if (!value) return fallback;
  if (value->tag == "integer")
    return static_cast<double>(parse_integer(value->attribute("value"), value->where, title() + ": " + quote(name)));
  return parse_number(value->attribute("value"), value->where, title() + ": " + quote(name));
}

double Properties::number(const std::string& name) {
  if (!has(name))
    fail(element_.where, title() + " has no " + quote(name) + "; need <float name=" + quote(name) + " .../>");
  return number(name, 0);
}

long Properties::integer(const std::string& name, long fallback) {
  const Element* value = value_of(name, {"integer"});
  return value ? parse_integer(value->attribute("value"), value->where, title() + ": " + quote(name)) : fallback;
}

bool Properties::boolean(const std::string& name, bool fallback) {
  const Element* value = value_of(name, {"boolean"});
  return value ? parse_boolean(value->attribute("value"), value->where, title() + ": " + quote(name)) : fallback;
}

std::string Properties::text(const std::string& name, const std::string& fallback) {
  const Element* value = value_of(name, {"string"});
  return value ? value->attribute("value") : fallback;
}

std::string Properties::text(const std::string& name) {
  if (!has(name))
    fail(element_.where, title() + " has no " + quote(name) + "; need <string name=" + quote(name) + " .../>");
  return text(name, "");
}

std::string Properties::choice(const std::string& name, const std::vector<std::string>& allowed) {
  std::string got = lower_case(text(name, allowed[0]));
  if (std::find(allowed.begin(), allowed.end(), got) == allowed.end())
    fail_at(name, quote(name) + " is " + quote(got) + need_one_of(got, allowed));
  return got;
}

Vec3 Properties::vector(const std::string& name, const Vec3& fallback) {
  const Element* value = value_of(name, {"vector", "point"});
  if (!value) return fallback;
  const Vec3 out = any_vector(*value, name);
  for (const double v : out)
    if (!(std::fabs(v) <= largest_extent))
      fail(value->where, fmt::format("{}: {} has a coordinate of {:.3g}; need at most {:.0e}, for single precision",
                                     title(), quote(name), v, largest_extent));
  return out;
}

Vec3 Properties::any_vector(const Element& element, const std::string& name) const {
  const Element* value = &element;
  const std::string what = title() + ": " + quote(name);
  Vec3 out{0, 0, 0};
  if (value->attributes.count("value")) {
    const std::vector<double> v = parse_numbers(value->attribute("value"), value->where, what);
    if (v.size() == 1) return {v[0], v[0], v[0]};
    if (v.size() != 3) fail(value->where, what + " has " + std::to_string(v.size()) + " numbers; need 3 or 1");
    return {v[0], v[1], v[2]};
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const std::string axis(1, "xyz"[i]);
    if (!value->attributes.count(axis)) fail(value->where, what + " has no " + axis + "; need x, y and z, or value");
    out[i] = parse_number(value->attribute(axis), value->where, what);
  }
  return out;
}

bool Properties::is_vector(const std::string& name) const {
  const Element* child = child_named(name);
  return child && (child->tag == "vector" || child->tag == "point");
}

Transform Properties::transform(const std::string& name) {
  const Element* value = value_of(name, {"transform"});
  if (!value) return {};
  const Transform transform = parse_transform(*value);
  for (const double v : transform.m)
    if (!(std::fabs(v) <= largest_extent))
      fail(value->where, fmt::format("{}: {} moves or scales by {:.3g}; need at most {:.0e}, for single precision",
                                     title(), quote(name), v, largest_extent));
  return transform;
}

const Element* Properties::child_named(const std::string& name) const {
  for (const auto& child : element_.children)
    if (child->attribute("name") == name) return child.get();
  return nullptr;
}

Spectrum Properties::spectrum_of(const Element& value, const std::string& what) const {
  const std::string &text = value.attribute("value"), &file = value.attribute("filename");
  if (text.empty() == file.empty()) fail(value.where, what + ": need a value or a filename, and one of them");
  return file.empty() ? parse_spectrum(text, value.where, what) : read_spectrum(find_file(value, file));
}

Color Properties::color(const std::string& name, const Color& fallback, Quantity quantity) {
  const std::string what = title() + ": " + quote(name);
  if (is_spectrum(name)) {
    const Element& plugin = resolve(*child_named(name));
    object(plugin.tag, name);
    const Rgb rgb = spectrum_plugin(document_, plugin, quantity, report_);
    return {rgb, rgb[0] != rgb[1] || rgb[1] != rgb[2]};
  }
  const Element* value = value_of(name, {"float", "integer", "rgb", "spectrum"});
  if (!value) return fallback;
  if (value->tag == "spectrum") {
    const Spectrum spectrum = spectrum_of(*value, what);
    const Rgb rgb = to_rgb(spectrum, quantity, value->where, what, report_);
    return {rgb, !spectrum.is_uniform() || quantity == Quantity::emission};
  }
  const std::vector<double> v = parse_numbers(value->attribute("value"), value->where, what);
  if (v.size() == 1) return {{v[0], v[0], v[0]}, false};
  if (value->tag != "rgb" || v.size() != 3)
    fail(value->where, what + ": " + std::to_string(v.size()) + " numbers in <" + value->tag + ">; need " +
                           (value->tag == "rgb" ? "3 (linear sRGB) or 1" : "1"));
  return {{v[0], v[1], v[2]}, true};
}

bool Properties::is_spectrum(const std::string& name) {
  const Element* child = child_named(name);
  if (!child || (child->tag != "ref" && !is_object_tag(child->tag))) return false;
  const Element& target = resolve(*child);
  return (target.tag == "texture" || target.tag == "volume") && is_spectrum_type(target.attribute("type"));
}

std::string Properties::find_file(const Element& value, const std::string& given) const {
  FileResolver files = document_.files;
  files.append(folder_of(value.where.file));
  std::string file = files.find(given);
  if (!file.empty() && !is_folder(file)) return file;
  std::string folders;
  for (const std::string& folder : files.folders()) folders += (folders.empty() ? "" : ", ") + folder;
  fail(value.where, title() + ": no such file " + quote(given) + "; looked in " + folders);
}

std::string Properties::file(const std::string& name) {
  const std::string given = text(name);
  if (given.empty()) fail_at(name, quote(name) + " is empty; need a path");
  return find_file(*child_named(name), given);
}

bool Properties::is_object(const std::string& name) {
  remember(known_, name);
  return std::any_of(element_.children.begin(), element_.children.end(), [&](const auto& child) {
    return child->attribute("name") == name && (child->tag == "ref" || is_object_tag(child->tag));
  });
}

const Element* Properties::object(const std::string& tag, const std::string& name) {
  remember(objects_, "<" + tag + (name.empty() ? ">" : " name=" + quote(name) + ">"));
  const Element* found = nullptr;
  for (const auto& child : element_.children) {
    if (child->tag != "ref" && child->tag != tag) continue;
    if (!name.empty() && child->attribute("name") != name) continue;
    const Element& target = resolve(*child);
    if (target.tag != tag) {
      if (name.empty()) continue;  // a reference to something else: another call's, or finish() complains
      fail(child->where,
           title() + ": " + quote(name) + " refers to the " + target.tag + " " + quote(target.id) + "; need a " + tag);
    }
    if (found) fail(child->where, title() + ": more than one <" + tag + ">; need one");
    used_.insert(child.get());
    found = &target;
  }
  return found;
}

std::vector<const Element*> Properties::objects(const std::string& tag) {
  remember(objects_, "<" + tag + ">");
  std::vector<const Element*> out;
  for (const auto& child : element_.children) {
    if (child->tag != "ref" && child->tag != tag) continue;
    const Element& target = resolve(*child);
    if (target.tag != tag) continue;
    used_.insert(child.get());
    out.push_back(&target);
  }
  return out;
}

void Properties::finish() {
  for (const auto& child : element_.children) {
    if (used_.count(child.get()) || child->tag == "alias") continue;
    const std::string& name = child->attribute("name");
    if (child->tag == "ref" || is_object_tag(child->tag)) {
      const Element& target = resolve(*child);
      std::string message = title() + ": <" + target.tag + " type=" + quote(target.attribute("type")) + ">" +
                            (name.empty() ? "" : " named " + quote(name)) + " does not belong here; need ";
      for (std::size_t i = 0; i < objects_.size(); ++i) message += (i ? " or " : "") + objects_[i];
      if (objects_.empty()) message += "no nested object";
      if (!name.empty() && !known_.empty()) message += ", or one of the parameters " + list_of(known_);
      report_.add(child->where, message);
    } else if (!name.empty()) {
      report_.add(child->where, title() + ": unknown parameter " + quote(name) + need_one_of(name, known_));
    }
  }
}

}  // namespace itn
