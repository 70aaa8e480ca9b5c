// A scene file as a tree of elements, after <include>, <default> and $name, before any meaning is given to it.
#pragma once
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "runtime/scene/scene.h"

namespace itn {

struct Element {
  std::string tag;
  std::map<std::string, std::string> attributes;  // values after $name substitution
  Location where;
  std::vector<std::unique_ptr<Element>> children;

  // Empty when absent.
  const std::string& attribute(const std::string& name) const;
  // The id, or for an object without one its type and number ("homogeneous0").
  std::string id;
};

struct Document {
  std::unique_ptr<Element> root;                // the <scene>
  std::map<std::string, const Element*> by_id;  // with the names that <alias> adds
  std::vector<std::string> folders;             // where <path> looks for files
};

// Tags that make objects (they have a type), as opposed to values and transform steps.
bool is_object_tag(const std::string& tag);

// Where the file is that `named_in` calls `name`: beside it, else in one of the folders. It need not exist.
std::string find_file(const std::string& name, const std::string& named_in, const std::vector<std::string>& folders);

Document read_document(const std::string& file, const std::map<std::string, std::string>& definitions);

}  // namespace itn
