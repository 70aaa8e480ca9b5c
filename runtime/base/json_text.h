// JSON from files that anybody may have written.
#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "runtime/base/error.h"

namespace itn {

// Throws InputError: brackets nest deeper than anything that is read here. Copies and comparisons recurse.
void check_nesting(std::string_view json, const std::string& file);

// Throws InputError, which names the file, where it is no JSON.
template <class Json>
Json parse_json(std::string_view text, const std::string& file) {
  check_nesting(text, file);
  try {
    return Json::parse(text);
  } catch (const typename Json::exception& error) {
    throw InputError(file + ": is no JSON; " + error.what());
  }
}

}  // namespace itn
