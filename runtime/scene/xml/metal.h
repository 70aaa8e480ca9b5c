// Indices of refraction of metals by name.
#pragma once
#include <string>

#include "runtime/scene/xml/properties.h"

namespace itn {

// The `material`, "none" without one. It and the parameter `name`, eta or k, exclude each other.
std::string metal_instead_of(Properties& properties, const std::string& name);

// The parameter `name`, eta or k, of a metal: as given, or that of `material`; without either the fallback.
Rgb parse_metal(Properties& properties, const std::string& name, double fallback);

}  // namespace itn
