// A network in the Open Neural Network Exchange format, for tools that know nothing of ours: onnx.ai, operator set 13.
//
// Inputs of a plain network (is_plain()): "luminance" (N, 1, size, size), radiance as read_luminance() gives it; with
// six channels also "known" (N, 5, size, size): channels 1 to 5 of input.h. Of any other: each by its name in input.h
// (N, its channels, size, size), images and the flash's light as radiance; of one that sees the object alone the mask
// whether it sees that or not, and everything cut out as cut_planes() does it. Output: "parameters" (N, outputs), in
// their units, of a judge the probabilities; of a network that says a distribution also "low" and "high", the ends of
// their intervals of 95 %, laid out alike. What the network makes of radiance and the ranges of the outputs are part of
// the graph. The metadata are those of network_file.h.
#pragma once
#include <string>
#include <vector>

#include "itn/network.h"

namespace itn {

std::string onnx_bytes(const Network& network);

// The names of the graph's inputs and of its outputs.
std::vector<std::string> onnx_inputs(const NetworkDescription& network);
std::vector<std::string> onnx_outputs(const NetworkDescription& network);

}  // namespace itn
