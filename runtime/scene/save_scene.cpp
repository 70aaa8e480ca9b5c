#include "itn/save_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "itn/error.h"
#include "runtime/scene/xml/document.h"
#include "runtime/scene/xml/spectrum.h"
#include "runtime/scene/xml/values.h"

namespace itn {
namespace {

// A '$' would begin a name.
std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '"')
      out += "&quot;";
    else if (c == '$')
      out += "\\$";
    else if (static_cast<unsigned char>(c) < ' ')
      out += fmt::format("&#{};", static_cast<int>(c));
    else
      out += c;
  }
  return out;
}

void write(const Element& element, const std::string& indent, std::string& out) {
  // The reader takes every spectrum of a type for a texture.
  const bool is_spectrum = element.tag == "texture" && is_spectrum_type(element.attribute("type"));
  const std::string tag = is_spectrum ? "spectrum" : element.tag;
  out += indent + "<" + tag;
  for (const char* first : {"version", "type", "name", "id"})
    if (const auto found = element.attributes.find(first); found != element.attributes.end())
      out += fmt::format(" {}=\"{}\"", first, escaped(found->second));
  for (const auto& [name, value] : element.attributes)
    if (name != "version" && name != "type" && name != "name" && name != "id")
      out += fmt::format(" {}=\"{}\"", name, escaped(value));
  if (element.children.empty()) {
    out += "/>\n";
    return;
  }
  out += ">\n";
  for (const auto& child : element.children) write(*child, indent + "  ", out);
  out += indent + "</" + tag + ">\n";
}

std::unique_ptr<Element> value_element(const std::string& tag, const std::string& name, const std::string& value) {
  auto element = std::make_unique<Element>();
  element->tag = tag;
  element->attributes = {{"name", name}, {"value", value}};
  return element;
}

Element* child_called(Element& element, const std::string& name) {
  for (auto& child : element.children)
    if (child->attribute("name") == name) return child.get();
  return nullptr;
}

// Gives the element's parameter a value, in place of whatever it has.
void set(Element& element, const std::string& member, const std::string& value, bool is_colour) {
  Element* old = child_called(element, member);
  if (old && is_object_tag(old->tag) && child_called(*old, "value")) return set(*old, "value", value, is_colour);
  const bool was_colour = old && (old->tag == "rgb" || old->tag == "spectrum" || is_object_tag(old->tag));
  std::unique_ptr<Element> set_to = value_element(is_colour || was_colour ? "rgb" : "float", member, value);
  if (old)
    *old = std::move(*set_to);
  else
    element.children.push_back(std::move(set_to));
}

void remove_child(Element& element, const std::string& name) {
  std::erase_if(element.children, [&](const auto& child) { return child->attribute("name") == name; });
}

// Numbers that the file has in one text: weights of a dictionary, values of a table.
bool set_in_list(Element& element, const std::string& member, double value) {
  const std::size_t end = member.find_last_not_of("0123456789");
  if (end == std::string::npos || end + 1 == member.size() || member[end] != '_') return false;
  Element* list = child_called(element, member.substr(0, end) + "s");
  if (!list || list->tag != "string") return false;
  std::vector<double> numbers = parse_numbers(list->attribute("value"), list->where, member);
  const std::size_t at = std::stoul(member.substr(end + 1));
  if (at >= numbers.size()) return false;
  numbers[at] = value;
  list->attributes["value"] = fmt::format("{}", fmt::join(numbers, ", "));
  return true;
}

Element* find_id(Element& element, const std::string& id) {
  if (element.id == id) return &element;
  for (auto& child : element.children)
    if (Element* found = find_id(*child, id)) return found;
  return nullptr;
}

void folders_of(const Element& element, std::vector<std::string>& folders) {
  const std::string folder = folder_of(element.where.file);
  if (std::find(folders.begin(), folders.end(), folder) == folders.end()) folders.push_back(folder);
  for (const auto& child : element.children) folders_of(*child, folders);
}

// The folders in which the scene's files are looked for, so that the first is looked in first: each goes before those
// that stand above it.
void add_paths(Document& document) {
  std::vector<std::string> folders = document.files.folders();
  folders_of(*document.root, folders);
  std::set<std::string> known;
  auto& children = document.root->children;
  for (const std::string& folder : folders) {
    std::error_code status;
    const std::filesystem::path whole = std::filesystem::weakly_canonical(folder, status);
    if (status || !known.insert(whole.string()).second || !std::filesystem::is_directory(whole, status)) continue;
    auto path = std::make_unique<Element>();
    path->tag = "path";
    path->attributes["value"] = whole.string();
    children.insert(children.begin(), std::move(path));
  }
}

bool is_same(double a, double b) { return a == b || std::fabs(a - b) <= 1e-9 * std::max(std::fabs(a), std::fabs(b)); }

// Is every value there when the text is read?
void check(const std::string& file, const std::string& text, const LoadOptions& options,
           const std::vector<Parameter>& parameters, const std::vector<double>& values) {
  std::vector<Parameter> there;
  try {
    there = list_parameters(load_scene_text(file, text, options));
  } catch (const InputError& error) {
    throw UsageError(fmt::format("the scene with these values is none that can be read again: {}", error.what()));
  }
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const Parameter& p = parameters[i];
    if (std::isnan(p.value)) continue;
    const auto found =
        std::find_if(there.begin(), there.end(), [&](const Parameter& other) { return other.name == p.name; });
    if (found == there.end() || !is_same(found->value, values[i]))
      throw UsageError(fmt::format("{}: the file has no place for its value, {}; it follows from something else there",
                                   p.name, values[i]));
  }
}

}  // namespace

std::string scene_text(const std::string& file, const std::map<std::string, std::string>& definitions,
                       const LoadOptions& options, const std::vector<Parameter>& parameters,
                       const std::vector<double>& values) {
  Report report;
  Document document = read_document(file, definitions, report);
  std::map<std::pair<std::string, std::string>, Rgb> colours;  // by id and member
  for (std::size_t i = 0; i < parameters.size(); ++i)
    if (const Parameter& p = parameters[i]; p.component >= 0)
      colours[{p.id, p.member}][static_cast<std::size_t>(p.component)] = values[i];
  std::set<std::string> by_name;  // ids of metals that were given by name
  const auto is_moved = [&](std::size_t i) {
    return !std::isnan(parameters[i].value) && parameters[i].value != values[i];
  };
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const Parameter& p = parameters[i];
    Element* owner = find_id(*document.root, p.id);
    if (!is_moved(i) || !owner || (p.member != "eta" && p.member != "k") || !child_called(*owner, "material")) continue;
    remove_child(*owner, "material");
    by_name.insert(p.id);
  }
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const Parameter& p = parameters[i];
    Element* owner = find_id(*document.root, p.id);
    const bool of_metal = by_name.count(p.id) > 0 && (p.member == "eta" || p.member == "k");
    if (!(is_moved(i) || of_metal) || !owner) continue;  // without an owner check() complains
    if (p.component >= 0) {
      const Rgb& colour = colours[{p.id, p.member}];
      set(*owner, p.member, fmt::format("{}, {}, {}", colour[0], colour[1], colour[2]), true);
    } else if (!set_in_list(*owner, p.member, values[i])) {
      set(*owner, p.member, fmt::format("{}", values[i]), false);
    }
  }
  add_paths(document);
  document.root->attributes["version"] = "3.0.0";
  std::string text = "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n";
  write(*document.root, "", text);
  check(file, text, options, parameters, values);
  return text;
}

}  // namespace itn
