#include "tools/network_start.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>

#include "network/input.h"
#include "network/loss.h"
#include "network/network_file.h"
#include "runtime/error.h"
#include "runtime/scene/parameters.h"
#include "tools/run_folder.h"

namespace itn::tools {
namespace {

// By the outputs' names.
std::map<std::string, double> guess(Network& network, const std::string& image) {
  const NetworkDescription& description = network.description();
  std::vector<float> input(network.image_values());
  network_input(description, read_luminance(image, description.size), nullptr, input);
  const std::vector<double> parameters = parameters_of(network.forward(input, 1), description.outputs);
  std::map<std::string, double> by_name;
  for (std::size_t i = 0; i < parameters.size(); ++i) by_name[description.outputs[i].name] = parameters[i];
  return by_name;
}

std::string output_name(ParameterKind kind) {
  switch (kind) {
    case ParameterKind::sigma_t:
      return "sigma_t";
    case ParameterKind::albedo:
      return "albedo";
    case ParameterKind::g:
      return "g";
    default:
      return "";
  }
}

}  // namespace

void set_network_start(Scene& scene, const std::vector<std::string>& parameters, const std::vector<std::string>& given,
                       const std::string& run, const std::string& image) {
  Network network = read_network(network_file_of(run));
  if (network.description().channels != 1)
    throw UsageError("--init " + run +
                     ": the network needs to know shape and light; take one that sees luminance alone");
  const std::map<std::string, double> guesses = guess(network, image);
  const std::vector<Parameter> all = list_parameters(scene);
  std::optional<int> medium;
  for (const std::string& name : parameters) {
    if (std::find(given.begin(), given.end(), name) != given.end()) continue;
    const Parameter parameter = find_parameter(all, name);
    const auto found = guesses.find(output_name(parameter.kind));
    if (found == guesses.end())
      throw UsageError(fmt::format("--init {}: the network does not guess {}; give --start {}=VALUE", run, name, name));
    if (medium.value_or(parameter.index) != parameter.index)
      throw UsageError(
          fmt::format("--init {}: the network knows one medium, and {} is of another one than the "
                      "parameters before it; give --start {}=VALUE",
                      run, name, name));
    medium = parameter.index;
    double value = found->second;
    if (parameter.kind == ParameterKind::sigma_t) {
      const double scale = scene.media.at(static_cast<std::size_t>(parameter.index)).scale;
      value *= network.description().mm_per_unit / (scale > 0 ? scale : 1);
    }
    set_parameter(scene, parameter, value);
  }
}

}  // namespace itn::tools
