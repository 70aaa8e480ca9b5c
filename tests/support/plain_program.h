// Definitions for kernels that a test runs alone.
#pragma once
#include <map>
#include <string>

#include "runtime/render/compile/launch_data.h"

namespace itn::test {

// A program for the data without derivatives; `changes` on top.
inline std::map<std::string, std::string> plain_program(const LaunchData& data, int width,
                                                        const std::map<std::string, std::string>& changes = {}) {
  std::map<std::string, std::string> definitions = feature_definitions(data);
  for (const char* none : {"SCORES", "DERIVATIVES", "ALBEDOS", "PARTS", "BASELINES", "ADJOINT", "LIGHT_NUMBERS"})
    definitions[none] = "0";
  definitions["PART_RECORDS"] = "{0,{0,0,0}}";
  definitions["WIDTH"] = std::to_string(width);
  definitions["BOX_WIDTH"] = "4";
  for (const auto& [name, value] : changes) definitions[name] = value;
  return definitions;
}

}  // namespace itn::test
