#include "runtime/scene/xml/upgrade.h"

#include <array>
#include <cctype>
#include <charconv>

#include "runtime/scene/xml/message.h"

namespace itn {
namespace {

bool is_upper(char c) { return std::isupper(static_cast<unsigned char>(c)) != 0; }
bool is_lower(char c) { return std::islower(static_cast<unsigned char>(c)) != 0; }
char to_lower(char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); }

// toWorld -> to_world, intIOR -> int_ior.
std::string with_underscores(const std::string& name) {
  std::string out;
  for (std::size_t i = 0; i < name.size(); ++i) {
    if (i == 0 || !is_lower(name[i - 1]) || !is_upper(name[i])) {
      out += name[i];
      continue;
    }
    out += '_';
    out += to_lower(name[i]);
    while (i + 1 < name.size() && is_upper(name[i + 1])) out += to_lower(name[++i]);
  }
  return out;
}

std::unique_ptr<Element> make_step(const std::string& tag, const Location& where) {
  auto step = std::make_unique<Element>();
  step->tag = tag;
  step->where = where;
  return step;
}

// uoffset, voffset, uscale and vscale, which were parameters, into one to_uv: first the shift, then the scale.
void gather_to_uv(Element& element) {
  std::unique_ptr<Element> shift, scale;
  for (std::size_t i = 0; i < element.children.size();) {
    const Element& child = *element.children[i];
    const std::string& name = child.attribute("name");
    const bool is_shift = name == "uoffset" || name == "voffset", is_scale = name == "uscale" || name == "vscale";
    if (!is_shift && !is_scale) {
      ++i;
      continue;
    }
    std::unique_ptr<Element>& step = is_shift ? shift : scale;
    if (!step) step = make_step(is_shift ? "translate" : "scale", child.where);
    step->attributes[name[0] == 'u' ? "x" : "y"] = child.attribute("value");
    element.children.erase(element.children.begin() + static_cast<std::ptrdiff_t>(i));
  }
  if (!shift && !scale) return;
  auto transform = make_step("transform", shift ? shift->where : scale->where);
  transform->attributes["name"] = "to_uv";
  if (shift) transform->children.push_back(std::move(shift));
  if (scale) transform->children.push_back(std::move(scale));
  element.children.push_back(std::move(transform));
}

}  // namespace

Version parse_version(const std::string& text, const Location& where) {
  std::array<int, 3> number{0, 0, 0};
  const char *at = text.data(), *end = text.data() + text.size();
  bool is_version = !text.empty();
  for (std::size_t i = 0; i < 3 && is_version && at != end; ++i) {
    const auto [stop, error] = std::from_chars(at, end, number[i]);
    is_version = error == std::errc() && number[i] >= 0;
    at = stop;
    if (is_version && at != end) is_version = *at++ == '.' && at != end;
  }
  if (!is_version || at != end) fail(where, "version " + quote(text) + "; need numbers with points, such as \"3.0.0\"");
  return {number[0], number[1], number[2]};
}

void upgrade(Element& element, const Version& version) {
  if (version.major >= 2) return;
  for (auto& child : element.children)
    if (const auto name = child->attributes.find("name"); name != child->attributes.end())
      name->second = with_underscores(name->second);
  if (element.attribute("type") == "diffuse")
    for (auto& child : element.children)
      if (child->attribute("name") == "diffuse_reflectance") child->attributes["name"] = "reflectance";
  gather_to_uv(element);
}

}  // namespace itn
