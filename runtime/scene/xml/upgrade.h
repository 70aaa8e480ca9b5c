// Scene files of earlier versions, read as Mitsuba 3 reads them.
#pragma once
#include <string>

#include "runtime/scene/xml/document.h"

namespace itn {

struct Version {
  int major = 0, minor = 0, patch = 0;
};

// "3.0.0", "2.1", "0.6.0": of the file's outermost element. Throws InputError at `where` for anything else, and for
// versions after 3.
Version parse_version(const std::string& text, const Location& where);

// Before 2.0: names of parameters in camel case become words with underscores, "diffuseReflectance" of diffuse becomes
// "reflectance", and uoffset, voffset, uscale, vscale become to_uv. Later versions need no change.
void upgrade(Element& element, const Version& version);

}  // namespace itn
