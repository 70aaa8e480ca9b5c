// Results that let in who reads them.
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "tools/itn/common.h"

namespace itn::tools {

// As write_json(), but a file is for its owner alone.
void write_private_json(const CommonOptions& options, const nlohmann::ordered_json& result);

}  // namespace itn::tools
