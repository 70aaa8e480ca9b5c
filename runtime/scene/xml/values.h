// Numbers, booleans and colours written in attributes.
#pragma once
#include <string>
#include <vector>

#include "itn/scene.h"

namespace itn {

// `what` names the value in messages. All throw InputError at `where`. Numbers must be finite.
double parse_number(const std::string& text, const Location& where, const std::string& what);
long parse_integer(const std::string& text, const Location& where, const std::string& what);
bool parse_boolean(const std::string& text, const Location& where, const std::string& what);
// Separated by spaces or commas; at least one.
std::vector<double> parse_numbers(const std::string& text, const Location& where, const std::string& what);

std::string lower_case(std::string text);

}  // namespace itn
