// A scene file again, with other values of its parameters.
#pragma once
#include <map>
#include <string>
#include <vector>

#include "itn/load_scene.h"
#include "itn/parameters.h"

namespace itn {

// The text of a Mitsuba 3 XML file: the scene of load_scene(file, definitions, options) with other values of its
// parameters, one for each that list_parameters() gave for it; those of textures are not looked at. Names, defaults and
// includes are written out, comments are not, and <path> elements say where the files are that it names, so that it may
// be kept anywhere on the same machine. It is read again before it is returned. Throws UsageError: a value that the
// file has no place for, because it follows from something else there.
std::string scene_text(const std::string& file, const std::map<std::string, std::string>& definitions,
                       const LoadOptions& options, const std::vector<Parameter>& parameters,
                       const std::vector<double>& values);

}  // namespace itn
