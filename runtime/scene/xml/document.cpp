#include "runtime/scene/xml/document.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <pugixml.hpp>
#include <set>

#include "itn/file.h"
#include "runtime/base/printable.h"
#include "runtime/scene/xml/message.h"
#include "runtime/scene/xml/references.h"
#include "runtime/scene/xml/upgrade.h"

namespace itn {
namespace {

namespace fs = std::filesystem;

const std::set<std::string> object_tags = {"scene", "sensor", "integrator", "film",    "rfilter", "sampler", "shape",
                                           "bsdf",  "medium", "phase",      "emitter", "texture", "volume"};

// Attributes that each tag takes; objects: type, id, name.
const std::map<std::string, std::vector<std::string>> attributes_of = {
    {"float", {"name", "value"}},
    {"integer", {"name", "value"}},
    {"boolean", {"name", "value"}},
    {"string", {"name", "value"}},
    {"rgb", {"name", "value"}},
    {"spectrum", {"name", "value", "filename"}},
    {"vector", {"name", "value", "x", "y", "z"}},
    {"point", {"name", "value", "x", "y", "z"}},
    {"ref", {"id", "name"}},
    {"transform", {"name"}},
    {"translate", {"value", "x", "y", "z"}},
    {"scale", {"value", "x", "y", "z"}},
    {"rotate", {"value", "x", "y", "z", "angle"}},
    {"lookat", {"origin", "target", "up"}},
    {"matrix", {"value"}},
    {"default", {"name", "value"}},
    {"include", {"filename", "name"}},
    {"alias", {"id", "as"}},
    {"path", {"value"}},
};

// Elements nest at most this deep: deeper files are hostile, and the readers recurse.
constexpr int max_nesting = 64;

// Files may include each other this deep, as in Mitsuba; and this many, since each could include the next one twice.
constexpr std::size_t deepest_include = 15, most_includes = 1000, most_paths = 1000, most_elements = 1'000'000;

// Definitions that use each other could otherwise grow without bound.
constexpr std::size_t longest_value = 1'000'000, longest_default = 1000;

// Limits for all files together, and for all values once names are replaced.
constexpr std::size_t most_bytes = 1 << 28, most_growth = 1 << 26;

// Turns a byte offset into line and column.
class LineTable {
 public:
  LineTable(std::string file, const std::string& text) : file_(std::move(file)) {
    for (std::size_t i = 0; i < text.size(); ++i)
      if (text[i] == '\n') starts_.push_back(i + 1);
  }
  Location locate(std::ptrdiff_t offset) const {
    const std::size_t position = offset < 0 ? 0 : static_cast<std::size_t>(offset);
    const auto next = std::upper_bound(starts_.begin(), starts_.end(), position);
    return {file_, static_cast<int>(next - starts_.begin()), static_cast<int>(position - *(next - 1)) + 1};
  }

 private:
  std::string file_;
  std::vector<std::size_t> starts_{0};
};

std::string read_text(const std::string& file) {
  if (!is_there(file)) throw InputError(file + ": no such file; check the path");
  if (is_folder(file)) throw InputError(file + ": is a folder; need a scene file");
  return read_file(file, most_bytes);
}

void check_id(const std::string& id, const Location& where) {
  constexpr std::size_t longest_id = 1000;
  if (id.size() > longest_id)
    fail(where, "an id of " + std::to_string(id.size()) + " characters; need at most " + std::to_string(longest_id));
  if (std::any_of(id.begin(), id.end(), [](unsigned char c) { return c < ' ' || c == 0x7f; }))
    fail(where, "an id with a control character; need one of letters");
}

std::string list_folders(const std::vector<std::string>& folders) {
  std::string out;
  for (const std::string& folder : folders) out += (out.empty() ? "" : ", ") + folder;
  return out;
}

[[noreturn]] void give_up(const Location& where, std::size_t most, const std::string& what) {
  throw TooMuch(where,
                to_string(where) + ": more than " + std::to_string(most) + " " + what + "; check what includes what");
}

// A parser stops at a character 0, as if the file ended there.
void check_characters(const std::string& text, const LineTable& lines) {
  const bool is_utf16 = text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff");
  const std::size_t end = is_utf16 ? std::string::npos : text.find('\0');
  if (end != std::string::npos)
    fail(lines.locate(static_cast<std::ptrdiff_t>(end)), "a character 0; need text in UTF-8: mend the file here");
}

// Text means nothing in a scene file, as in Mitsuba: it is told, but for spaces, and left out. in: where it stands
void warn_of_text(pugi::xml_node node, const LineTable& lines, const std::string& in, Report& report) {
  if (node.type() != pugi::node_pcdata && node.type() != pugi::node_cdata) return;
  const std::string words = node.value();
  const std::size_t first = words.find_first_not_of(" \t\r\n");
  if (first == std::string::npos) return;
  std::string shown = words.substr(first, 20);
  if (!is_utf8(shown)) shown = "...";
  report.warn(lines.locate(node.offset_debug() + static_cast<std::ptrdiff_t>(first)),
              in + ": the text " + quote(shown) + " is left out; values go into attributes");
}

// One element, and no other that would be left out.
void check_outermost(const pugi::xml_document& document, const LineTable& lines, Report& report) {
  bool found = false;
  for (const pugi::xml_node node : document.children()) {
    const std::ptrdiff_t at = node.offset_debug();
    warn_of_text(node, lines, "outside of the outermost element", report);
    if (node.type() != pugi::node_element) continue;
    if (found)
      fail(lines.locate(at - 1),
           std::string("a second outermost element <") + node.name() + ">; need one: mend the file");
    found = true;
  }
  if (!found) fail(lines.locate(0), "malformed XML: no element; need <scene version=\"3.0.0\">");
}

class Reader {
 public:
  Reader(const std::string& scene_file, const std::map<std::string, std::string>& definitions, Report& report)
      : resolver(scene_file), definitions_(definitions), report_(report) {
    for (const auto& [name, value] : definitions) {
      unused_.insert(name);
      longest_name_ = std::max(longest_name_, name.size());
    }
  }

  std::unique_ptr<Element> read_scene(const std::string& file, const std::string& text) {
    std::unique_ptr<Element> root = parse(file, text);
    if (root->tag != "scene")
      fail(root->where, "outermost element is <" + root->tag + ">; need <scene version=\"3.0.0\">");
    return root;
  }

  FileResolver resolver;
  std::vector<std::string> included_folders;  // of included files, and of their <path>: Mitsuba forgets these

  void check_definitions_used() const {
    if (unused_.empty()) return;
    const std::string& name = *unused_.begin();
    throw UsageError("-D " + name + "=" + definitions_.at(name) + ": the scene never uses $" + name +
                     "; take the definition away, or correct its name" + suggestion(name, used_));
  }

 private:
  std::unique_ptr<Element> parse(const std::string& file, const std::string& text) {
    const LineTable lines(file, text);
    if ((bytes_ += text.size()) > most_bytes) give_up({file, 1, 1}, most_bytes, "bytes in all files");
    check_characters(text, lines);
    pugi::xml_document document;
    const pugi::xml_parse_result result =
        document.load_buffer(text.data(), text.size(), pugi::parse_default | pugi::parse_fragment);
    if (!result)
      fail(lines.locate(result.offset), std::string("malformed XML: ") + result.description() + "; mend the file here");
    check_outermost(document, lines, report_);
    std::error_code status;
    open_files_.push_back(fs::weakly_canonical(fs::absolute(file, status), status).string());
    const pugi::xml_node top = document.document_element();
    const Location where = lines.locate(top.offset_debug() - 1);
    if (top.attribute("version").empty())
      fail(where, std::string("<") + top.name() + "> has no version; need version=\"3.0.0\"");
    versions_.push_back(parse_version(top.attribute("version").value(), where));
    if (versions_.back().major > 3)
      report_.warn(where, "version " + quote(top.attribute("version").value()) +
                              " is later than Mitsuba 3; read as a scene of version 3");
    std::unique_ptr<Element> element = convert(top, lines, 0);
    versions_.pop_back();
    open_files_.pop_back();
    return element;
  }

  // The value that a name stands for; null when nothing defines it.
  const std::string* value_of(const std::string& name) const {
    if (const auto given = definitions_.find(name); given != definitions_.end()) return &given->second;
    const auto preset = defaults_.find(name);
    return preset == defaults_.end() ? nullptr : &preset->second;
  }

  // Behind a '$': the longest defined name that the text goes on with, as in Mitsuba; else all that may be a name.
  std::string name_at(const std::string& text, std::size_t begin) const {
    for (std::size_t size = std::min(longest_name_, text.size() - begin); size > 0; --size)
      if (std::string name = text.substr(begin, size); value_of(name)) return name;
    std::size_t end = begin;
    while (end < text.size() && (std::isalnum(static_cast<unsigned char>(text[end])) || text[end] == '_')) ++end;
    return text.substr(begin, end - begin);
  }

  std::string substitute(const std::string& text, const Location& where) {
    std::string out;
    for (std::size_t i = 0; i < text.size();) {
      if (text[i] == '\\' && i + 1 < text.size() && text[i + 1] == '$') {  // a '$' that means itself
        out += '$';
        i += 2;
        continue;
      }
      if (text[i] != '$') {
        out += text[i++];
        continue;
      }
      const std::string name = name_at(text, i + 1);
      if (name.empty()) fail(where, "$ without a name in " + quote(text) + "; need $name");
      used_.push_back(name);
      unused_.erase(name);
      const std::string* value = value_of(name);
      if (!value)
        fail(where, "$" + name + " is not defined; give -D " + name + "=value, or put <default name=" + quote(name) +
                        " value=\"...\"/> before this line");
      out += *value;
      if (out.size() > longest_value)
        fail(where, "the value grows beyond " + std::to_string(longest_value) + " characters; check what $" + name +
                        " stands for");
      if ((growth_ += value->size()) > most_growth)
        give_up(where, most_growth, "characters of what names like $" + name + " stand for");
      i += 1 + name.size();
    }
    return out;
  }

  std::vector<std::string> allowed_attributes(const Element& element, bool outermost) const {
    if (is_object_tag(element.tag)) {
      std::vector<std::string> allowed{"type", "id", "name"};
      if (outermost) allowed.emplace_back("version");
      return allowed;
    }
    const auto known = attributes_of.find(element.tag);
    if (known != attributes_of.end()) return known->second;
    std::vector<std::string> tags(object_tags.begin(), object_tags.end());
    for (const auto& [tag, unused] : attributes_of) tags.push_back(tag);
    fail(element.where, "unknown element <" + element.tag + ">" + need_one_of(element.tag, tags));
  }

  void read_attributes(pugi::xml_node node, bool outermost, Element& element) {
    const std::vector<std::string> allowed = allowed_attributes(element, outermost);
    for (pugi::xml_attribute attribute : node.attributes()) {
      const std::string name = attribute.name();
      if (std::find(allowed.begin(), allowed.end(), name) == allowed.end())
        fail(element.where, "<" + element.tag + ">: unknown attribute " + quote(name) + need_one_of(name, allowed));
      if (element.attributes.count(name))
        fail(element.where, "<" + element.tag + ">: attribute " + quote(name) + " given twice; need it once");
      std::string value = substitute(attribute.value(), element.where);
      // Values become names in images, JSON and messages.
      if (!is_utf8(value)) fail(element.where, quote(name) + " is no text in UTF-8; save the file in that encoding");
      if (name == "id" || name == "as") check_id(value, element.where);
      element.attributes[name] = std::move(value);
    }
    if (is_object_tag(element.tag) && element.tag != "scene" && element.attribute("type").empty())
      fail(element.where, "<" + element.tag + "> has no type; need <" + element.tag + " type=\"...\">");
  }

  std::unique_ptr<Element> convert(pugi::xml_node node, const LineTable& lines, int depth) {
    auto element = std::make_unique<Element>();
    element->tag = node.name();
    element->where = lines.locate(node.offset_debug() - 1);  // pugixml points behind the '<'
    if (depth > max_nesting) fail(element->where, "elements nest more than " + std::to_string(max_nesting) + " deep");
    if (++elements_ > most_elements) give_up(element->where, most_elements, "elements");
    // A spectrum of a type is a texture that is the same everywhere.
    if (element->tag == "spectrum" && node.attribute("type")) element->tag = "texture";
    if (element->tag == "lookAt" && versions_.back().major < 2) element->tag = "lookat";
    read_attributes(node, depth == 0, *element);
    for (pugi::xml_node child : node.children()) {
      warn_of_text(child, lines, "<" + element->tag + ">", report_);
      if (child.type() == pugi::node_element) report_.attempt([&] { convert_child(child, lines, depth, *element); });
    }
    if (is_object_tag(element->tag)) upgrade(*element, versions_.back());
    return element;
  }

  void convert_child(pugi::xml_node node, const LineTable& lines, int depth, Element& parent) {
    std::unique_ptr<Element> child = convert(node, lines, depth + 1);
    if (child->tag == "scene") fail(child->where, "<scene> inside <" + parent.tag + ">; need it outermost");
    if (child->tag == "default") {
      const std::string& name = child->attribute("name");
      if (name.empty() || !child->attributes.count("value")) fail(child->where, "<default> needs a name and a value");
      if (name.size() > longest_default)
        fail(child->where, "<default>: a name of " + std::to_string(name.size()) + " characters; need at most " +
                               std::to_string(longest_default));
      longest_name_ = std::max(longest_name_, name.size());
      defaults_.emplace(name, child->attribute("value"));
    } else if (child->tag == "include") {
      include(*child, parent);
    } else if (child->tag == "path") {
      add_path(*child);
    } else {
      parent.children.push_back(std::move(child));
    }
  }

  // The elements of an included scene become those of the parent; an included object becomes its child.
  void include(const Element& element, Element& parent) {
    const std::string& name = element.attribute("filename");
    if (name.empty()) fail(element.where, "<include> needs a filename");
    if (open_files_.size() >= deepest_include)
      fail(element.where, "files include each other more than " + std::to_string(deepest_include) + " deep");
    if (++includes_ > most_includes) give_up(element.where, most_includes, "files included");
    const FileResolver before = resolver;
    resolver.prepend(folder_of(element.where.file));
    report_.attempt([&] { splice(element, name, parent); });
    for (const std::string& folder : resolver.folders()) included_folders.push_back(folder);
    resolver = before;
  }

  void splice(const Element& element, const std::string& name, Element& parent) {
    const std::string file = resolver.find(name);
    if (file.empty())
      fail(element.where, "include: no such file " + quote(name) + "; looked in " + list_folders(resolver.folders()));
    std::error_code status;
    const std::string canonical = fs::weakly_canonical(fs::absolute(file, status), status).string();
    if (std::find(open_files_.begin(), open_files_.end(), canonical) != open_files_.end())
      fail(element.where, "include: " + quote(file) + " includes itself; break the circle");
    std::string text;
    try {
      text = read_text(file);
    } catch (const InputError& error) {
      fail(element.where, std::string("include: ") + error.what());
    }
    std::unique_ptr<Element> included = parse(file, text);
    if (included->tag != "scene") {
      included->attributes.erase("version");
      if (!element.attribute("name").empty()) included->attributes["name"] = element.attribute("name");
      parent.children.push_back(std::move(included));
      return;
    }
    for (auto& child : included->children) parent.children.push_back(std::move(child));
  }

  void add_path(const Element& element) {
    const std::string& value = element.attribute("value");
    if (++paths_ > most_paths) give_up(element.where, most_paths, "<path>");
    if (value.empty()) fail(element.where, "<path> has no value; need a folder");
    std::string folder = (fs::path(folder_of(element.where.file)) / value).string();
    if (!is_reachable(folder)) folder = resolver.find(value);
    if (folder.empty() || !is_folder(folder))
      fail(element.where, "<path>: no such folder " + quote(value) + "; looked in " + folder_of(element.where.file) +
                              ", " + list_folders(resolver.folders()));
    resolver.prepend(folder);
  }

  const std::map<std::string, std::string>& definitions_;
  Report& report_;
  std::map<std::string, std::string> defaults_;
  std::set<std::string> unused_;
  std::vector<std::string> used_;
  std::vector<std::string> open_files_;  // the scene and the includes that lead to where the reader is
  std::vector<Version> versions_;        // theirs
  std::size_t bytes_ = 0, growth_ = 0, includes_ = 0, paths_ = 0, elements_ = 0, longest_name_ = 0;
};

}  // namespace

const std::string& Element::attribute(const std::string& name) const {
  static const std::string empty;
  const auto found = attributes.find(name);
  return found == attributes.end() ? empty : found->second;
}

bool is_object_tag(const std::string& tag) { return object_tags.count(tag) > 0; }

namespace {

Document read(const std::string& file, const std::string& text, const std::map<std::string, std::string>& definitions,
              Report& report) {
  Reader reader(file, definitions, report);
  Document document;
  document.root = reader.read_scene(file, text);
  report.raise();  // what a broken file means would be guesswork
  reader.check_definitions_used();
  document.files = reader.resolver;
  for (const std::string& folder : reader.included_folders) document.files.append(folder);
  resolve_references(document, report);
  return document;
}

}  // namespace

Document read_document(const std::string& file, const std::map<std::string, std::string>& definitions, Report& report) {
  return read(file, read_text(file), definitions, report);
}

Document read_document_text(const std::string& file, const std::string& text, Report& report) {
  return read(file, text, {}, report);
}

}  // namespace itn
