#include "itn/invert.h"

#include <nlohmann/json.hpp>
#include <string_view>

#include "itn/error.h"
#include "itn/save_scene.h"
#include "runtime/base/fingerprint.h"
#include "runtime/inverse/forward_model.h"
#include "runtime/inverse/gauss_newton/numbers_inversion.h"

namespace itn {
namespace {

using Json = StoredRun::Json;

std::string fingerprint_of_values(const std::vector<float>& values) {
  return fingerprint_text({reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float)});
}

// All that a rendering depends on, but for its samples and the parameters' values.
Json of_scene(const Device& device, const Scene& scene, const InvertRequest& request) {
  Json values = Json::object();
  for (const Parameter& parameter : list_parameters(scene))
    if (std::find(request.parameters.begin(), request.parameters.end(), parameter.name) == request.parameters.end() &&
        !parameter.has_values())
      values[parameter.name] = parameter.value;
  return {{"scene", fingerprint_of(scene.file)}, {"values", values},     {"parameters", request.parameters},
          {"sensors", request.sensors},          {"seed", request.seed}, {"device", device.info().name}};
}

Json of_request(const Json& scene, const InvertRequest& request, const TargetNoise& noise) {
  Json targets = Json::array();
  for (const TargetImage& target : request.targets)
    targets.push_back({fingerprint_of_values(target.value), fingerprint_of_values(target.weight),
                       fingerprint_of_values(target.error), fingerprint_of_values(target.noise)});
  return {{"of_scene", scene},      {"targets", targets},     {"method", request.method},
          {"range", request.range}, {"prior", request.prior}, {"exposure", request.exposure},
          {"spp", request.spp},     {"noise", noise.relative}};
}

}  // namespace

InvertResult invert(const Device& device, const Scene& scene, const InvertRequest& request,
                    const std::atomic<bool>* cancel) {
  if (request.targets.empty() || request.targets.size() != request.sensors.size())
    throw UsageError("sensors: " + std::to_string(request.sensors.size()) + " for " +
                     std::to_string(request.targets.size()) + " targets; need one for each");
  std::vector<TargetImage> targets = request.targets;
  NumbersQuestion question;
  question.scene = scene.file;
  question.folder = request.folder;
  question.targets.assign(targets.size(), "an image");
  question.method = request.method;
  question.spp = request.spp;
  question.noise = settle_noise(targets, {});
  question.exposure = request.exposure;
  question.range = request.range;
  question.prior = request.prior;
  question.seed = request.seed;
  question.of_scene = of_scene(device, scene, request);
  question.request = of_request(question.of_scene, request, question.noise);
  check(question, targets);
  RenderOptions options;
  options.seed = request.seed;
  options.cancel = cancel;
  ForwardModel model(device, scene, request.parameters, request.sensors, options);
  const NumbersAnswer answer = invert_numbers(question, {}, scene, targets, model, {});
  const auto json = to_json(answer, model.coordinates());
  InvertResult result;
  for (const auto& [name, of] : json.at("parameters").items())
    result.parameters[name] = {of.at("value"), of.at("low"), of.at("high"), of.at("holds")};
  result.converged = answer.converged();
  result.failure = failure(answer);
  result.verdict = verdict(answer, model.coordinates());
  result.json = json.dump();
  return result;
}

}  // namespace itn
