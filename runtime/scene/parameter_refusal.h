// Checks of values that users give parameters.
#pragma once
#include <string>

#include "itn/parameters.h"

namespace itn {

// "got VALUE, need a number in RANGE", or that it is too large for the device's single precision, as any number of a
// scene is above 1e30; empty: nothing is wrong.
std::string refusal(const Parameter& parameter, double value);

}  // namespace itn
