// Writes the findings of an evaluation to files.
#pragma once
#include <nlohmann/json.hpp>
#include <string>

#include "network/evaluation/evaluation.h"

namespace itn {

// {"schema":"itn.eval/1", ...}: tools/README.md.
nlohmann::ordered_json to_json(const Evaluation& e);

// folder/report.html, result.json and the pictures. Throws ResultError.
void write_evaluation(const std::string& folder, const Evaluation& e);

}  // namespace itn
