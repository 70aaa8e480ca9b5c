// Warnings about a rendering that neither its values nor its standard errors can give.
#pragma once
#include <string>
#include <vector>

#include "itn/rendering.h"
#include "itn/scene.h"

namespace itn {

// A sentence each; empty where there is nothing to say.
std::vector<std::string> warnings_of(const Rendering& image, const Scene& scene);

}  // namespace itn
