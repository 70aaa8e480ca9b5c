// Each derivative of an image against a central difference with common random numbers, in batches of different samples.
#pragma once
#include <atomic>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "itn/parameters.h"
#include "itn/renderer.h"
#include "runtime/render/derivative/difference.h"

namespace itn {

struct DerivativeCheck {
  static constexpr int batches = 4;
  static constexpr double significance = 0.0027;  // a false alarm in all scores together

  struct OfParameter {
    Parameter parameter;
    DifferenceStencil stencil;
    std::vector<DerivativeComparison::Channel> channels;
    bool passed = false;
  };
  std::vector<OfParameter> checks;
  std::vector<Parameter> not_differentiable;
  int width = 0, height = 0, spp = 0, channels = 3;
  std::uint64_t seed = 0;
  Operator op = Operator::full;
  double bound = 0, render_s = 0;

  bool passed() const;
};

// Plans a check of the named parameters; without names of all that are differentiable, and lists the others. Throws
// UsageError: unknown, not differentiable or named twice; none at all.
DerivativeCheck plan_check(const Scene& scene, const std::vector<std::string>& parameters);

// Renders the plan's images. options: sensor, seed, operator, cancel, progress, and spp, of all batches together (0:
// the sensor's). Throws as render().
void run_check(const Device& device, const Scene& scene, const RenderOptions& options, DerivativeCheck& check);

// {"schema":"itn.gradcheck/1", ...}: docs/reference/json.md. scene: as it is to be called.
nlohmann::ordered_json to_json(const DerivativeCheck& check, const std::string& scene, const Device& device);

}  // namespace itn
