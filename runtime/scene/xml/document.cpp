#include "runtime/scene/xml/document.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <pugixml.hpp>
#include <set>
#include <sstream>

#include "runtime/scene/xml/message.h"

namespace itn {
namespace {

namespace fs = std::filesystem;

const std::set<std::string> object_tags = {"scene", "sensor", "integrator", "film",    "rfilter", "sampler", "shape",
                                           "bsdf",  "medium", "phase",      "emitter", "texture", "volume"};

// Which attributes each tag takes; objects: type, id, name.
const std::map<std::string, std::vector<std::string>> attributes_of = {
    {"float", {"name", "value"}},
    {"integer", {"name", "value"}},
    {"boolean", {"name", "value"}},
    {"string", {"name", "value"}},
    {"rgb", {"name", "value"}},
    {"spectrum", {"name", "value"}},
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
    {"include", {"filename"}},
    {"alias", {"id", "as"}},
    {"path", {"value"}},
};

// Elements nest at most this deep: deeper files are hostile, and the readers recurse.
constexpr int max_nesting = 64;

// Definitions that use each other could otherwise grow without bound.
constexpr std::size_t longest_value = 1'000'000;

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

class Reader {
 public:
  explicit Reader(const std::map<std::string, std::string>& definitions) : definitions_(definitions) {
    for (const auto& [name, value] : definitions) unused_.insert(name);
  }

  std::unique_ptr<Element> read_file(const std::string& file, const Location* included_from) {
    const auto complain = [&](const std::string& what) {
      if (included_from) fail(*included_from, what);
      throw InputError(file + ": " + what);
    };
    std::error_code status;
    const std::string canonical = fs::weakly_canonical(file, status).string();
    if (std::find(open_files_.begin(), open_files_.end(), canonical) != open_files_.end())
      complain("include: " + quote(file) + " includes itself; break the circle");
    if (!fs::exists(file, status)) complain("no such file " + quote(file) + "; check the path");
    if (fs::is_directory(file, status)) complain(quote(file) + " is a folder; need a scene file");
    std::ifstream stream(file, std::ios::binary);
    std::stringstream buffer;
    buffer << stream.rdbuf();
    if (!stream) complain("cannot read " + quote(file) + "; check its permissions");
    const std::string text = buffer.str();

    const LineTable lines(file, text);
    pugi::xml_document document;
    const pugi::xml_parse_result result = document.load_buffer(text.data(), text.size());
    if (!result)
      fail(lines.locate(result.offset), std::string("malformed XML: ") + result.description() + "; mend the file here");
    open_files_.push_back(canonical);
    const pugi::xml_node top = document.document_element();
    std::unique_ptr<Element> element = convert(top, lines, 0);
    open_files_.pop_back();
    if (element->tag != "scene")
      fail(element->where, "outermost element is <" + element->tag + ">; need <scene version=\"3.0.0\">");
    return element;
  }

  std::vector<std::string> folders;  // of <path>

  void check_definitions_used() const {
    if (unused_.empty()) return;
    const std::string& name = *unused_.begin();
    throw UsageError("-D " + name + "=" + definitions_.at(name) + ": the scene never uses $" + name +
                     "; take the definition away, or correct its name" + suggestion(name, used_));
  }

 private:
  std::string substitute(const std::string& text, const Location& where) {
    std::string out;
    for (std::size_t i = 0; i < text.size();) {
      if (text[i] != '$') {
        out += text[i++];
        continue;
      }
      std::size_t end = i + 1;
      while (end < text.size() && (std::isalnum(static_cast<unsigned char>(text[end])) || text[end] == '_')) ++end;
      const std::string name = text.substr(i + 1, end - i - 1);
      if (name.empty()) fail(where, "$ without a name in " + quote(text) + "; need $name");
      used_.push_back(name);
      unused_.erase(name);
      if (const auto given = definitions_.find(name); given != definitions_.end()) {
        out += given->second;
      } else if (const auto preset = defaults_.find(name); preset != defaults_.end()) {
        out += preset->second;
      } else {
        fail(where, "$" + name + " is not defined; give -D " + name + "=value, or put <default name=" + quote(name) +
                        " value=\"...\"/> before this line");
      }
      if (out.size() > longest_value)
        fail(where, "the value grows beyond " + std::to_string(longest_value) + " characters; check what $" + name +
                        " stands for");
      i = end;
    }
    return out;
  }

  std::unique_ptr<Element> convert(pugi::xml_node node, const LineTable& lines, int depth) {
    auto element = std::make_unique<Element>();
    element->tag = node.name();
    element->where = lines.locate(node.offset_debug() - 1);  // pugixml points behind the '<'
    if (depth > max_nesting) fail(element->where, "elements nest more than " + std::to_string(max_nesting) + " deep");
    std::vector<std::string> allowed;
    if (element->tag == "scene") {
      allowed = {"version", "id", "type"};
    } else if (is_object_tag(element->tag)) {
      allowed = {"type", "id", "name"};
    } else if (const auto known = attributes_of.find(element->tag); known != attributes_of.end()) {
      allowed = known->second;
    } else {
      std::vector<std::string> tags(object_tags.begin(), object_tags.end());
      for (const auto& [tag, unused] : attributes_of) tags.push_back(tag);
      fail(element->where, "unknown element <" + element->tag + ">" + need_one_of(element->tag, tags));
    }
    for (pugi::xml_attribute attribute : node.attributes()) {
      const std::string name = attribute.name();
      if (std::find(allowed.begin(), allowed.end(), name) == allowed.end())
        fail(element->where, "<" + element->tag + ">: unknown attribute " + quote(name) + need_one_of(name, allowed));
      if (element->attributes.count(name))
        fail(element->where, "<" + element->tag + ">: attribute " + quote(name) + " given twice; need it once");
      element->attributes[name] = substitute(attribute.value(), element->where);
    }
    if (is_object_tag(element->tag) && element->tag != "scene" && element->attribute("type").empty())
      fail(element->where, "<" + element->tag + "> has no type; need <" + element->tag + " type=\"...\">");
    for (pugi::xml_node child : node.children()) {
      if (child.type() == pugi::node_pcdata || child.type() == pugi::node_cdata) {
        const std::string words = child.value();
        const std::size_t first = std::min(words.find_first_not_of(" \t\r\n"), words.size());
        fail(lines.locate(child.offset_debug() + static_cast<std::ptrdiff_t>(first)),
             "<" + element->tag + ">: text " + quote(words.substr(first, 20)) +
                 " between elements; values go into attributes");
      }
      if (child.type() == pugi::node_element) convert_child(child, lines, depth, *element);
    }
    return element;
  }

  void convert_child(pugi::xml_node node, const LineTable& lines, int depth, Element& parent) {
    std::unique_ptr<Element> child = convert(node, lines, depth + 1);
    if (child->tag == "scene") fail(child->where, "<scene> inside <" + parent.tag + ">; need it outermost");
    if (child->tag == "default") {
      const std::string& name = child->attribute("name");
      if (name.empty() || !child->attributes.count("value")) fail(child->where, "<default> needs a name and a value");
      defaults_.emplace(name, child->attribute("value"));
    } else if (child->tag == "include") {
      if (child->attribute("filename").empty()) fail(child->where, "<include> needs a filename");
      const fs::path folder = fs::path(child->where.file).parent_path();
      std::unique_ptr<Element> included = read_file((folder / child->attribute("filename")).string(), &child->where);
      for (auto& element : included->children) parent.children.push_back(std::move(element));
    } else if (child->tag == "path") {
      if (child->attribute("value").empty()) fail(child->where, "<path> has no value; need a folder");
      const fs::path folder = fs::path(child->where.file).parent_path() / child->attribute("value");
      std::error_code status;
      if (!fs::is_directory(folder, status)) fail(child->where, "<path>: no such folder " + quote(folder.string()));
      folders.push_back(folder.string());
    } else {
      parent.children.push_back(std::move(child));
    }
  }

  const std::map<std::string, std::string>& definitions_;
  std::map<std::string, std::string> defaults_;
  std::set<std::string> unused_;
  std::vector<std::string> used_;
  std::vector<std::string> open_files_;
};

void collect_ids(Element& element, Document& document) {
  if (is_object_tag(element.tag) && element.attributes.count("id")) {
    element.id = element.attribute("id");
    if (element.id.empty()) fail(element.where, "<" + element.tag + ">: empty id; give it a name or leave it out");
    const auto [other, is_new] = document.by_id.emplace(element.id, &element);
    if (!is_new)
      fail(element.where, "id " + quote(element.id) + " is taken by the element at " + to_string(other->second->where) +
                              "; ids must differ");
  }
  for (auto& child : element.children) collect_ids(*child, document);
}

void apply_aliases(const Element& element, Document& document) {
  for (const auto& child : element.children) {
    if (child->tag == "alias") {
      const std::string &id = child->attribute("id"), &as = child->attribute("as");
      const auto target = document.by_id.find(id);
      if (target == document.by_id.end()) fail(child->where, "<alias>: no element has the id " + quote(id));
      if (as.empty()) fail(child->where, "<alias> has no as; need a second id");
      if (!document.by_id.emplace(as, target->second).second)
        fail(child->where, "<alias>: id " + quote(as) + " is taken");
    }
    apply_aliases(*child, document);
  }
}

void name_the_nameless(Element& element, const Document& document, std::map<std::string, int>& count) {
  if (is_object_tag(element.tag) && element.id.empty()) {
    const std::string& type = element.attribute("type");
    do {
      element.id = type + std::to_string(count[type]++);
    } while (document.by_id.count(element.id));
  }
  for (auto& child : element.children) name_the_nameless(*child, document, count);
}

}  // namespace

const std::string& Element::attribute(const std::string& name) const {
  static const std::string empty;
  const auto found = attributes.find(name);
  return found == attributes.end() ? empty : found->second;
}

std::string find_file(const std::string& name, const std::string& named_in, const std::vector<std::string>& folders) {
  const fs::path path(name), beside = fs::path(named_in).parent_path() / path;
  if (path.is_absolute()) return name;
  std::error_code status;
  if (fs::is_regular_file(beside, status)) return beside.string();
  for (const std::string& folder : folders)
    if (fs::is_regular_file(fs::path(folder) / path, status)) return (fs::path(folder) / path).string();
  return beside.string();
}

bool is_object_tag(const std::string& tag) { return object_tags.count(tag) > 0; }

Document read_document(const std::string& file, const std::map<std::string, std::string>& definitions) {
  Reader reader(definitions);
  Document document;
  document.root = reader.read_file(file, nullptr);
  reader.check_definitions_used();
  document.folders = reader.folders;
  collect_ids(*document.root, document);
  apply_aliases(*document.root, document);
  std::map<std::string, int> count;
  name_the_nameless(*document.root, document, count);
  return document;
}

}  // namespace itn
