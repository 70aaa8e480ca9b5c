#include "runtime/training/network_start.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>

#include "network/loss.h"
#include "runtime/base/error.h"
#include "runtime/scene/parameters.h"
#include "runtime/training/known_scene.h"
#include "runtime/training/trained_network.h"

namespace itn {
namespace {

// By the outputs' names.
std::map<std::string, double> guess(Network& network, const std::string& image, const std::optional<SceneView>& view,
                                    const PhotoOptions& photo) {
  const NetworkDescription& description = network.description();
  std::vector<float> input(network.image_values());
  const std::vector<float> luminance = read_resampled_luminance(image, description.size, photo);
  if (view) {
    const KnownScene known = view->known();
    network_input(description, luminance, &known, input);
  } else {
    network_input(description, luminance, nullptr, input);
  }
  const std::vector<double> parameters = parameters_of(network.forward(input, 1), description.outputs);
  std::map<std::string, double> by_name;
  for (std::size_t i = 0; i < parameters.size(); ++i) by_name[description.outputs[i].name] = parameters[i];
  return by_name;
}

std::string output_name(const Parameter& p) {
  const bool of_medium = p.owner == Owner::medium || p.owner == Owner::phase;
  return of_medium && p.member != "scale" ? p.member : "";
}

}  // namespace

void set_network_start(Scene& scene, const std::vector<std::string>& parameters, const std::vector<std::string>& given,
                       const std::string& run, const std::string& image, int sensor, const PhotoOptions& photo) {
  const std::vector<Parameter> all = list_parameters(scene);
  std::vector<Parameter> guessed;
  for (const std::string& name : parameters) {
    if (std::find(given.begin(), given.end(), name) != given.end()) continue;
    guessed.push_back(find_parameter(all, name));
    const Parameter& parameter = guessed.back();
    if (output_name(parameter).empty())
      throw UsageError(fmt::format("--init {}: the network does not guess {}; give --start {}=VALUE", run, name, name));
    if (!parameter.belongs_to(guessed.front().indices.front()))
      throw UsageError(
          fmt::format("--init {}: the network knows one medium, and {} is of another one than the "
                      "parameters before it; give --start {}=VALUE",
                      run, name, name));
  }
  if (guessed.empty()) return;

  Network network = network_of(run);
  const auto index = static_cast<std::size_t>(guessed.front().indices.front());
  const std::string who = "--init " + run;
  const Body body = body_of(scene, guessed.front().indices.front(), who);
  std::optional<SceneView> view;
  if (network.description().channels > 1) view.emplace(scene, sensor, network.description().size, body, who);
  const std::map<std::string, double> guesses = guess(network, image, view, photo);
  for (const Parameter& parameter : guessed) {
    const auto found = guesses.find(output_name(parameter));
    if (found == guesses.end())
      throw UsageError(fmt::format("--init {}: the network does not guess {}; give --start {}=VALUE", run,
                                   parameter.name, parameter.name));
    double value = found->second;
    if (parameter.is(Owner::medium, "sigma_t")) {
      const double scale = scene.media.at(index).number("scale");
      value = sigma_t_in_scene(value, network.description(), body) / (scale > 0 ? scale : 1);
    }
    set_parameter(scene, parameter, value);
  }
}

}  // namespace itn
