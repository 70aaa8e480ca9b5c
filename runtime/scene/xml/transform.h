// <transform> elements.
#pragma once
#include <string>
#include <vector>

#include "itn/scene.h"
#include "runtime/scene/xml/document.h"

namespace itn {

// Steps in document order, each applied after the ones before it. Throws InputError for a step that is not complete,
// and for a transform that is not finite, or flattens space.
Transform parse_transform(const Element& element);

// A warning for each <rotate> in the element whose axis is not a unit vector, and each <matrix> that is not affine.
void warn_of_transforms(const Element& element, std::vector<std::string>& warnings);

}  // namespace itn
