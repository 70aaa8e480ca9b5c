// A network that is shown the scene: renderings of it at known materials, with derivatives, and what its answers to
// these make of its answer to a photo (answer_emulator.h). Half of the materials are spread over the network's ranges,
// the others lie where those of the photos may, by what the first say; and the scene is rendered once more where each
// photo's material was found. Beside the network's answers sums of pixels are compared, those that materials move most
// (image_sums.h).
#pragma once
#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "network/distribution.h"
#include "network/judge.h"
#include "network/network.h"
#include "runtime/device/device.h"
#include "runtime/training/material_renderer.h"

namespace itn {

struct Showing {
  int exemplars = 0;  // least_exemplars to most_exemplars, besides one a photo; 0: the network is shown nothing
  const Device* device = nullptr;
  // Samples a pixel, rounded up to 4, 6, 8 ...; 0: as noisy as the photos, 4 to 256, or 64 where nobody knows.
  int spp = 0;
  std::uint64_t seed = 0;
  std::function<void(double)> progress = {};  // fraction done
};

// In the pixels that the network sees (read_resampled_luminance()).
struct ScenePhoto {
  std::vector<float> luminance;
  std::vector<float> errors;  // standard errors; zeros: the file does not say
};

struct ShownScene {
  int spp = 0;  // samples a pixel of an exemplar
  // What is known of a photo.
  struct Answer {
    std::vector<std::vector<double>> samples;  // of the network's parameters, in its units
    // Is it like the scene, at any material (scene_likeness.h)? None where its noise is not known.
    std::optional<Verdict> verdict;
  };
  std::vector<Answer> answers;  // to each photo
};

// Renders and looks. photos: one or more. cancel: once set, Interrupted is thrown soon. Throws UsageError, too: as
// require_exemplars(), a sensor that is not square, a medium without one number of each of the network's names.
ShownScene show_scene(Network& network, const SceneToShow& scene, const std::vector<ScenePhoto>& photos,
                      const Showing& how, const std::atomic<bool>& cancel);

// Of each parameter its mean over the samples, and what 95 % of them lie between.
std::vector<ParameterEstimate> estimates_of(const std::vector<std::vector<double>>& samples);

}  // namespace itn
