// Indices of refraction by name.
#pragma once
#include <string>

#include "runtime/scene/xml/properties.h"

namespace itn {

// A number > 0, or the name of a material as Mitsuba knows it ("bk7", "water"); the fallback where nothing is given.
double parse_ior(Properties& properties, const std::string& name, double fallback);

}  // namespace itn
