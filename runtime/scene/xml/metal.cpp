#include "runtime/scene/xml/metal.h"

#include <map>
#include <vector>

#include "runtime/scene/xml/message.h"

namespace itn {
namespace {

struct Metal {
  Rgb eta, k;
};

// The names are those of Mitsuba 3, which are chemical formulas: case matters.
const std::map<std::string, Metal>& metals() {
  static const std::map<std::string, Metal> all = {
#include "runtime/scene/xml/metals.inc"
  };
  return all;
}

}  // namespace

std::string metal_instead_of(Properties& properties, const std::string& name) {
  std::string material = properties.text("material", "none");
  if (material != "none" && properties.has(name))
    properties.fail_at(name, quote(name) + " and \"material\" given; need one or the other");
  return material;
}

Rgb parse_metal(Properties& properties, const std::string& name, double fallback) {
  const std::string material = metal_instead_of(properties, name);
  if (material == "none") return properties.color(name, {{fallback, fallback, fallback}}, Quantity::unbounded).value;
  const auto found = metals().find(material);
  if (found != metals().end()) return name == "eta" ? found->second.eta : found->second.k;
  std::vector<std::string> names{"none"};
  names.reserve(metals().size() + 1);
  for (const auto& [known, metal] : metals()) names.push_back(known);
  properties.fail_at("material", "\"material\": unknown metal " + quote(material) + need_one_of(material, names));
}

}  // namespace itn
