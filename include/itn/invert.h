// Analysis by synthesis: numbers of a scene that images of it tell, with 95 % intervals. `itn invert` as a function.
#pragma once
#include <atomic>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "itn/device.h"
#include "itn/scene.h"
#include "itn/target_image.h"

namespace itn {

struct InvertRequest {
  std::vector<std::string> parameters;  // single numbers, by the names of list_parameters(): "medium.sigma_t"
  std::vector<TargetImage> targets;     // linear radiance; read_target() reads files
  std::vector<int> sensors = {0};       // one a target: the sensor of the scene that took it
  // A folder that is made or empty, for the state, result.json and report.html; with that of the same request before,
  // it goes on where that was stopped.
  std::string folder;
  std::string method;  // "posterior", "gauss-newton", "adam"; empty: posterior for up to eight numbers with ranges
  std::map<std::string, std::pair<double, double>> range;  // of the posterior: low, high of parameters
  std::map<std::string, std::pair<double, double>> prior;  // what is known before: 95 % intervals
  bool exposure = false;                                   // targets are known up to a factor each
  int spp = 0;                                             // samples a pixel; 0: the method's own
  std::uint64_t seed = 0;
};

struct ParameterInterval {
  double value = 0, low = 0, high = 0;  // 95 % interval, in the parameter's unit
  bool holds = false;                   // false: no fit was found, so that the interval says nothing
};

struct InvertResult {
  std::map<std::string, ParameterInterval> parameters;
  bool converged = false;
  std::string failure;               // why not; empty where it converged
  std::vector<std::string> verdict;  // sentences for people
  std::string json;                  // result.json (docs/reference/json.md)
};

// Parameters begin at the scene's values. cancel: ends it soon after with Interrupted; the folder goes on from there.
// Throws UsageError: what does not go together, an unknown parameter; InputError and ResultError as Renderer.
InvertResult invert(const Device& device, const Scene& scene, const InvertRequest& request,
                    const std::atomic<bool>* cancel = nullptr);

}  // namespace itn
