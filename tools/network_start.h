// A network's guess as the start of an inversion.
#pragma once
#include <string>
#include <vector>

#include "runtime/scene/scene.h"

namespace itn::tools {

// Gives each of the scene's `parameters` that is the sigma_t, albedo or g of a medium what the network of `run` sees in
// the image: sigma_t [1/mm] times the millimetres of a unit in the scenes that it learnt from, over the medium's scale;
// a colour gets the grey guess in every component. Those in `given` are left alone. Throws UsageError: another
// parameter that is not given, parameters of several media, a network that needs shape and light; InputError: a network
// or an image (read_luminance()) that cannot be used.
void set_network_start(Scene& scene, const std::vector<std::string>& parameters, const std::vector<std::string>& given,
                       const std::string& run, const std::string& image);

}  // namespace itn::tools
