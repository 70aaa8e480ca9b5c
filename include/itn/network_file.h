// A network in a safetensors file: its weights, and in the metadata all that is needed to use them.
//
//   format "itn.network", version "1", kind, channels, size, width, luminance, mm_per_unit, outputs (JSON: name, low,
//   high, logarithmic), all as text; arrays named as in Network::weights(). Of a network that says a distribution also
//   distribution ("normal": distribution.h) and spread (JSON: a number an output).
#pragma once
#include <string>

#include "itn/network.h"
#include "itn/safetensors.h"

namespace itn {

// Writes the file whole or not at all. byte: for shipping, at a quarter of the size; errors change by less than 1 %
// (network/weights/README.md). Where a stage's images are one pixel, eight of nine weights of its 3x3 kernels meet
// nothing but the zeros around it: then it leaves them out (for images of 64 pixels 4.2 of 6.3 million), and the file's
// kernels are 1x1. Throws ResultError: no place to write to, weights that are not finite.
void write_network(const std::string& file, const Network& network, Precision precision);

// Throws InputError that names the file: unreadable, damaged, another format or version, arrays of other shapes,
// missing or unknown.
Network read_network(const std::string& file);
// The same from its bytes; `file` is for the messages.
Network parse_network(std::string_view bytes, const std::string& file);

// The metadata of a network, and a network without weights from it: checkpoints hold them too.
std::map<std::string, std::string> network_metadata(const NetworkDescription& description);
NetworkDescription network_description(const Safetensors& content, const std::string& file);

// Copies the array named prefix + to.name. Throws InputError: not there, or of another shape.
void read_tensor(const Safetensors& content, const std::string& prefix, Tensor& to, const std::string& file);

}  // namespace itn
