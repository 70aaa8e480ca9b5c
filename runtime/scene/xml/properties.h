// Typed access to what an element contains. Every name asked for becomes part of what is allowed; finish() then
// refuses everything the file has beyond that, so that nothing is ever ignored.
#pragma once
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "itn/scene.h"
#include "runtime/scene/xml/document.h"
#include "runtime/scene/xml/report.h"
#include "runtime/scene/xml/spectrum.h"

namespace itn {

struct Color {
  Rgb value;
  bool is_rgb = false;  // three values were given
};

class Properties {
 public:
  // Properties that do not belong into the element go to the report; values that cannot be read throw InputError.
  Properties(const Document& document, const Element& element, Report& report);

  const Element& element() const { return element_; }
  const std::string& type() const { return element_.attribute("type"); }

  bool has(const std::string& name);
  // With a fallback when the file says nothing; without, absence is an error.
  double number(const std::string& name, double fallback);
  double number(const std::string& name);
  long integer(const std::string& name, long fallback);
  bool boolean(const std::string& name, bool fallback);
  std::string text(const std::string& name, const std::string& fallback);
  std::string text(const std::string& name);
  // One of `allowed`, in lower or upper case; the first is the default.
  std::string choice(const std::string& name, const std::vector<std::string>& allowed);
  Vec3 vector(const std::string& name, const Vec3& fallback);
  bool is_vector(const std::string& name) const;  // given as <vector> or <point>
  Transform transform(const std::string& name);   // identity when absent
  // <float>, <rgb>, <spectrum>, or a nested spectrum plugin, in linear sRGB as in Mitsuba's rgb variants.
  Color color(const std::string& name, const Color& fallback, Quantity quantity = Quantity::reflectance);
  // Is the parameter a nested spectrum plugin, which is the same everywhere, rather than a texture?
  bool is_spectrum(const std::string& name);
  // <string> that names a file: searched in Mitsuba's folders, then beside the file that names it. Must exist.
  std::string file(const std::string& name);
  // Is the parameter a nested object (or reference to one) rather than a plain value?
  bool is_object(const std::string& name);

  // Nested or referenced objects of a tag. `name`: the name attribute it must carry; "": any.
  const Element* object(const std::string& tag, const std::string& name = "");
  std::vector<const Element*> objects(const std::string& tag);

  // Message about the parameter (or the element when it is absent).
  [[noreturn]] void fail_at(const std::string& name, const std::string& what) const;
  // `bsdf "roughdielectric"`
  std::string title() const;

  // Reports what the element has beyond everything that was asked for.
  void finish();

 private:
  Vec3 any_vector(const Element& element, const std::string& name) const;
  const Element* value_of(const std::string& name, const std::vector<std::string>& tags);
  const Element& resolve(const Element& child) const;
  const Element* child_named(const std::string& name) const;
  Spectrum spectrum_of(const Element& value, const std::string& what) const;
  std::string find_file(const Element& value, const std::string& given) const;

  const Document& document_;
  const Element& element_;
  Report& report_;
  std::vector<std::string> known_;    // parameter names asked for
  std::vector<std::string> objects_;  // what nested objects were asked for, in words
  std::set<const Element*> used_;
};

}  // namespace itn
