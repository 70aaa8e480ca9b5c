// A network in the Open Neural Network Exchange format, for tools that know nothing of ours: onnx.ai, operator set 13.
//
// Inputs: "luminance" (N, 1, size, size), radiance as read_luminance() gives it; with six channels also "known" (N, 5,
// size, size): channels 1 to 5 of input.h. Output: "parameters" (N, outputs), in their units; of a network that says a
// distribution also "low" and "high", the ends of their intervals of 95 %, laid out alike. What the network makes of
// the luminance and the ranges of the outputs are part of the graph. The metadata are those of network_file.h.
#pragma once
#include <string>

#include "network/network.h"

namespace itn {

// Throws UsageError: a network that is not is_plain().
std::string onnx_bytes(const Network& network);

}  // namespace itn
