// Images to compare with, from arrays or files.
#pragma once
#include <nanobind/nanobind.h>

#include <memory>
#include <vector>

#include "runtime/inverse/image_loss.h"

namespace itn::python {

// As Python passes several.
using Targets = std::vector<std::shared_ptr<TargetImage>>;

void bind_target(nanobind::module_& module);

}  // namespace itn::python
