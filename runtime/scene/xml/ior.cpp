#include "runtime/scene/xml/ior.h"

#include <map>

#include "runtime/scene/xml/message.h"
#include "runtime/scene/xml/values.h"

namespace itn {
namespace {

// At 589.3 nm and room temperature. The names and values are those of Mitsuba 3, so that scenes mean the same there.
const std::map<std::string, double> index_of_refraction = {
    {"vacuum", 1.0},      {"helium", 1.000036},        {"hydrogen", 1.000132},
    {"air", 1.000277},    {"carbon dioxide", 1.00045}, {"water", 1.3330},
    {"acetone", 1.36},    {"ethanol", 1.361},          {"carbon tetrachloride", 1.461},
    {"glycerol", 1.4729}, {"benzene", 1.501},          {"silicone oil", 1.52045},
    {"bromine", 1.661},   {"water ice", 1.31},         {"fused quartz", 1.458},
    {"pyrex", 1.470},     {"acrylic glass", 1.49},     {"polypropylene", 1.49},
    {"bk7", 1.5046},      {"sodium chloride", 1.544},  {"amber", 1.55},
    {"pet", 1.5750},      {"diamond", 2.419},
};

}  // namespace

double parse_ior(Properties& properties, const std::string& name, double fallback) {
  if (!properties.has(name)) return fallback;
  bool is_text = false;
  for (const auto& child : properties.element().children)
    is_text = is_text || (child->attribute("name") == name && child->tag == "string");
  if (is_text) {
    const std::string material = lower_case(properties.text(name));
    const auto found = index_of_refraction.find(material);
    if (found != index_of_refraction.end()) return found->second;
    std::vector<std::string> names;
    names.reserve(index_of_refraction.size());
    for (const auto& [known, value] : index_of_refraction) names.push_back(known);
    properties.fail_at(name, quote(name) + ": unknown material " + quote(material) + need_one_of(material, names));
  }
  const double ior = properties.number(name);
  if (!(ior > 0)) properties.fail_at(name, quote(name) + " = " + std::to_string(ior) + "; need an index above 0");
  if (ior < least_ior || ior > greatest_ior)
    properties.fail_at(name, quote(name) + " = " + to_text(ior) + "; need an index from 0.001 to 1000");
  return ior;
}

}  // namespace itn
