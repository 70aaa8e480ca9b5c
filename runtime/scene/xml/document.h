// A scene file as a tree of elements, after <include>, <default> and $name, before any meaning is given to it.
#pragma once
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "itn/scene.h"
#include "runtime/scene/xml/file_resolver.h"
#include "runtime/scene/xml/report.h"

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
  FileResolver files{""};                       // finds what it names
};

// Tags that make objects (they have a type), as opposed to values and transform steps.
bool is_object_tag(const std::string& tag);

// Throws InputError with everything that is wrong with the file and those it includes; warnings go to the report.
Document read_document(const std::string& file, const std::map<std::string, std::string>& definitions, Report& report);

// As if `file` had this text, without definitions.
Document read_document_text(const std::string& file, const std::string& text, Report& report);

}  // namespace itn
