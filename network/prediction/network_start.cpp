#include "network/prediction/network_start.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "itn/distribution.h"
#include "itn/error.h"
#include "itn/parameters.h"
#include "itn/trained_network.h"
#include "network/model/random.h"
#include "network/prediction/image_judge.h"
#include "network/prediction/known_scene.h"

namespace itn {
namespace {

constexpr std::size_t drawn = 4096;  // samples of the distribution: its moments to some hundredths of a deviation

// Parameters drawn from the network's distribution, those outside of its ranges left out.
std::vector<std::vector<double>> draw(std::span<const float> raw, const NetworkDescription& network) {
  const ShareDistribution said = share_distribution(raw, network);
  const std::size_t n = said.mean.size();
  std::vector<std::vector<double>> samples;
  // Of a distribution whose mean lies inside of the ranges at least some eighth does.
  for (std::uint64_t k = 0; samples.size() < drawn && k < 64 * drawn; ++k) {
    std::vector<double> sample;
    for (std::size_t i = 0; i < n; ++i) {
      double sum = 0;
      for (std::size_t j = 0; j <= i; ++j) sum += said.factor[i * n + j] * random_normal(0, RANDOM_NOISE, k * n + j);
      const double share = said.mean[i] + said.deviation[i] * sum;
      if (share > 0 && share < 1) sample.push_back(network.outputs[i].parameter_of_share(share));
    }
    if (sample.size() == n) samples.push_back(sample);
  }
  return samples;
}

std::string output_name(const Parameter& p) {
  const bool of_medium = p.owner == Owner::medium || p.owner == Owner::phase;
  return of_medium && p.member != "scale" ? p.member : "";
}

// Those of the parameters that are not given. Throws as set_network_start().
std::vector<Parameter> asked_of_network(const Scene& scene, const std::vector<std::string>& parameters,
                                        const std::vector<std::string>& given, const std::string& run) {
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
  return guessed;
}

}  // namespace

Prior NetworkGuess::prior(const std::vector<Coordinate>& coordinates) const {
  Prior prior;
  if (parameters.empty()) return prior;
  std::vector<std::size_t> which;
  for (const std::string& name : parameters)
    for (std::size_t i = 0; i < coordinates.size(); ++i)
      if (coordinates[i].parameter().name == name) which.push_back(i);
  prior.add_samples(coordinates, which, samples);
  return prior;
}

std::vector<std::string> NetworkGuess::words() const {
  std::vector<std::string> text;
  for (std::size_t p = 0; p < parameters.size(); ++p) {
    std::vector<double> values;
    for (const std::vector<double>& sample : samples) values.push_back(sample[p]);
    std::sort(values.begin(), values.end());
    const auto at = [&](double share) { return values[static_cast<std::size_t>(share * double(values.size()))]; };
    text.push_back(fmt::format("{}={:.4g},{:.4g} (network)", parameters[p], at(0.025), at(0.975)));
  }
  return text;
}

NetworkGuess set_network_start(Scene& scene, const std::vector<std::string>& parameters,
                               const std::vector<std::string>& given, const std::string& run, const std::string& image,
                               int sensor, const PhotoOptions& photo) {
  const std::vector<Parameter> guessed = asked_of_network(scene, parameters, given, run);
  if (guessed.empty()) return {};

  Network network = network_of(run);
  if (!is_plain(network.description()))
    throw UsageError(fmt::format("--init {}: the network {}; itn predict gives its answer, --start and --prior take it",
                                 run, beyond_plain(network.description())));
  const int medium = guessed.front().indices.front();
  const std::string who = "--init " + run;
  const Body body = body_of(scene, medium, who);
  std::optional<SceneView> view;
  if (network.description().channels > 1) view.emplace(scene, sensor, network.description(), body, who);
  const NetworkDescription& description = network.description();
  const std::vector<float> luminance = read_resampled_radiance(image, description.size, 1, photo).value;
  const Seen seen = view ? view->seen(luminance) : Seen{luminance};
  std::vector<float> input(network.image_values());
  network_input(description, seen, input);
  const std::vector<float> raw = network.forward(input, 1);
  std::vector<std::vector<double>> samples;
  if (description.distribution) samples = draw(raw, description);
  NetworkGuess result;
  if (std::optional<ImageJudge> judge = ImageJudge::of(run, description)) {
    result.warning = judge->warning(image, judge->verdict(seen));
    if (!result.warning.empty())
      result.warning +=
          "; the inversion starts from that, and takes it for its prior unless --prior says another: leave out --init";
  }
  if (!samples.empty()) result.samples.resize(samples.size());
  for (const Parameter& parameter : guessed) {
    const auto found = std::find_if(description.outputs.begin(), description.outputs.end(),
                                    [&](const OutputRange& o) { return o.name == output_name(parameter); });
    if (found == description.outputs.end())
      throw UsageError(fmt::format("--init {}: the network does not guess {}; give --start {}=VALUE", run,
                                   parameter.name, parameter.name));
    const auto output = static_cast<std::size_t>(found - description.outputs.begin());
    const double unit = parameter.is(Owner::medium, "sigma_t") ? sigma_t_unit(scene, medium, description, body) : 1;
    set_parameter(scene, parameter, unit * found->parameter(static_cast<double>(raw[output])));
    const bool is_colour = std::count_if(guessed.begin(), guessed.end(), [&](const Parameter& p) {
                             return output_name(p) == output_name(parameter);
                           }) > 1;
    if (is_colour || samples.empty()) continue;
    result.parameters.push_back(parameter.name);
    for (std::size_t s = 0; s < samples.size(); ++s) result.samples[s].push_back(unit * samples[s][output]);
  }
  return result;
}

}  // namespace itn
