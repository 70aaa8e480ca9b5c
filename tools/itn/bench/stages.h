// The time of a render, split up: the stages of a scene, and scattering beside the limit that a bare walk sets.
#pragma once
#include <nlohmann/json.hpp>
#include <string>

#include "itn/device.h"
#include "itn/renderer.h"
#include "itn/scene.h"

namespace itn {

// The second of two images rendered by the staged schedule: the first compiles the kernels.
Rendering time_stages(const Device& device, const Scene& scene, RenderOptions options);
nlohmann::ordered_json stages_to_json(const Rendering& image);

// Scattering events per second in a medium without surfaces in reach: of the renderer, and of the same free flights,
// phase function and random numbers in a loop of their own (kernels/walk.cl). Means over `runs`.
struct ScatteringSpeed {
  double renderer = 0, walk = 0;
};
ScatteringSpeed scattering_speed(const Device& device, int runs);

}  // namespace itn
