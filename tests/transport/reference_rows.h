// Rows of data/transport.json as scenes of scenes/test: what the tests against the deterministic solutions share.
#pragma once
#include <nlohmann/json.hpp>
#include <string>

#include "transport.h"

namespace itn::test {

struct Row {
  std::string what, scene;
  Definitions definitions;
  Operator op = Operator::full;
  double expected = 0;
};

const nlohmann::json& reference_data();

// A number or a string as the text of a definition.
std::string number(const nlohmann::json& value);

// A sphere seen at distance b from its centre.
Row sphere_row(const nlohmann::json& row, const std::string& b, double expected);

// Reflectance ('R') or transmittance ('T') of a slab at an angle.
Row slab_row(const nlohmann::json& row, char which, const std::string& theta, double expected);

}  // namespace itn::test
