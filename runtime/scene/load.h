// Reads a Mitsuba 3 XML scene into the host model.
#pragma once
#include <map>
#include <string>

#include "runtime/scene/scene.h"

namespace itn {

// definitions fill $name in the file and win over its <default> elements. Throws InputError ("file:line:column: ...")
// for anything wrong in the scene or in a file it names, UsageError for a definition that the scene never uses. What is
// merely suspicious goes to Scene::warnings.
Scene load_scene(const std::string& file, const std::map<std::string, std::string>& definitions = {});

}  // namespace itn
