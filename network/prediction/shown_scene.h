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

#include "network/model/distribution.h"
#include "network/model/input.h"
#include "network/model/network.h"
#include "network/prediction/material_renderer.h"
#include "network/training/judge.h"
#include "runtime/render/device/device.h"

namespace itn {

struct Showing {
  int exemplars = 0;  // least_exemplars to most_exemplars, besides one a photo; 0: the network is shown nothing
  const Device* device = nullptr;
  // Samples a pixel, rounded up to 4, 6, 8 ...; 0: as noisy as the photos, 4 to 256, or 64 where nobody knows.
  int spp = 0;
  std::uint64_t seed = 0;
  std::function<void(double)> progress = {};  // fraction done
};

// What is known of a photo.
struct ShownAnswer {
  std::vector<ParameterEstimate> parameters;  // of the network, in its units
  // Is it like the scene, at any material (scene_likeness.h)? None where its noise is not known.
  std::optional<Verdict> verdict;
};

// Renders and looks. photos: one or more, in the pixels that the network sees. each: is told of every photo, in their
// order, as soon as it is answered. Returns the samples a pixel of an exemplar. cancel: once set, Interrupted is thrown
// soon. Throws UsageError, too: as require_exemplars(), a sensor that is not square, a medium without one number of
// each of the network's names.
int show_scene(Network& network, const SceneToShow& scene, const std::vector<ResampledImage>& photos,
               const Showing& how, const std::atomic<bool>& cancel,
               const std::function<void(const ShownAnswer&)>& each);

// Of each parameter its mean over the samples, and what 95 % of them lie between.
std::vector<ParameterEstimate> estimates_of(const std::vector<std::vector<double>>& samples);

}  // namespace itn
