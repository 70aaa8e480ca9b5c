// What somebody who looks at a rendering must know, since neither its values nor its standard errors say it.
#pragma once
#include <string>
#include <vector>

#include "itn/rendering.h"
#include "itn/scene.h"

namespace itn {

// A sentence each; empty where there is nothing to say.
std::vector<std::string> warnings_of(const Rendering& image, const Scene& scene);

}  // namespace itn
