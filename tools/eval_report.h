// Where the findings of `itn eval` go.
#pragma once
#include <string>

#include "tools/common.h"
#include "tools/eval_result.h"

namespace itn::tools {

// {"schema":"itn.eval/1", ...}: README.md.
nlohmann::ordered_json to_json(const Evaluation& e);

// Tables and claims on standard output.
void print_evaluation(const Evaluation& e, const std::string& folder);

// folder/report.html, result.json and the pictures.
void write_evaluation(const std::string& folder, const Evaluation& e);

}  // namespace itn::tools
