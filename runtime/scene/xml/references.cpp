#include "runtime/scene/xml/references.h"

#include <algorithm>

namespace itn {
namespace {

constexpr int deepest = 64;  // of objects within objects: what builds them recurses

void collect_ids(Element& element, Document& document, Report& report) {
  if (is_object_tag(element.tag) && element.attributes.count("id")) {
    element.id = element.attribute("id");
    if (element.id.empty())
      report.add(element.where, "<" + element.tag + ">: empty id; give it a name or leave it out");
    const auto [other, is_new] = document.by_id.emplace(element.id, &element);
    if (!is_new)
      report.add(element.where, "id " + quote(element.id) + " is taken by the element at " +
                                    to_string(other->second->where) + "; ids must differ");
  }
  for (auto& child : element.children) collect_ids(*child, document, report);
}

void apply_alias(const Element& alias, Document& document) {
  const std::string &id = alias.attribute("id"), &as = alias.attribute("as");
  const auto target = document.by_id.find(id);
  if (target == document.by_id.end()) fail(alias.where, "<alias>: no element has the id " + quote(id));
  if (as.empty()) fail(alias.where, "<alias> has no as; need a second id");
  if (!document.by_id.emplace(as, target->second).second) fail(alias.where, "<alias>: id " + quote(as) + " is taken");
}

void apply_aliases(const Element& element, Document& document, Report& report) {
  for (const auto& child : element.children) {
    if (child->tag == "alias") report.attempt([&] { apply_alias(*child, document); });
    apply_aliases(*child, document, report);
  }
}

void check_target(const Element& ref, const Document& document) {
  const std::string& id = ref.attribute("id");
  if (id.empty()) fail(ref.where, "<ref> has no id; need id=\"...\"");
  if (document.by_id.count(id)) return;
  std::vector<std::string> ids;
  for (const auto& [name, element] : document.by_id) ids.push_back(name);
  constexpr std::size_t few = 30;  // more than these nobody reads
  fail(ref.where,
       "<ref>: no element has the id " + quote(id) +
           (ids.size() <= few ? need_one_of(id, ids)
                              : "; " + std::to_string(ids.size()) + " others are there" + suggestion(id, ids)));
}

void check_targets(const Element& element, const Document& document, Report& report) {
  for (const auto& child : element.children) {
    if (report.is_full()) return;
    if (child->tag == "ref") report.attempt([&] { check_target(*child, document); });
    check_targets(*child, document, report);
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

class Circles {
 public:
  explicit Circles(const Document& document) : document_(document) {}

  // Depth of the objects within `element`. `above`: the element's own depth.
  int height(const Element& element, int above) {
    if (above > deepest)
      fail(element.where, "objects and references nest more than " + std::to_string(deepest) + " deep");
    int& known = height_.emplace(&element, 0).first->second;
    if (known == open)
      fail(element.where,
           "<" + element.tag + ">: " + quote(element.id) + " contains a reference to itself; break the circle");
    if (known == 0) {
      known = open;
      int below = 0;
      for (const auto& child : element.children)
        if (const Element* target = target_of(*child)) below = std::max(below, height(*target, above + 1));
      known = below + 1;
    }
    if (above + known > deepest + 1)
      fail(element.where, "objects and references nest more than " + std::to_string(deepest) + " deep");
    return known;
  }

 private:
  static constexpr int open = -1;  // being visited

  const Element* target_of(const Element& child) const {
    if (child.tag == "ref") return document_.by_id.at(child.attribute("id"));
    return is_object_tag(child.tag) ? &child : nullptr;
  }

  const Document& document_;
  std::map<const Element*, int> height_;
};

}  // namespace

void resolve_references(Document& document, Report& report) {
  collect_ids(*document.root, document, report);
  apply_aliases(*document.root, document, report);
  check_targets(*document.root, document, report);
  report.raise();
  std::map<std::string, int> count;
  name_the_nameless(*document.root, document, count);
  Circles(document).height(*document.root, 0);
}

}  // namespace itn
