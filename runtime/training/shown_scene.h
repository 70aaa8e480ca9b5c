// A network that is shown the scene: renderings of it at materials spread over the network's ranges, and what its
// answers to these make of its answer to a photo (answer_emulator.h).
#pragma once
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "network/distribution.h"
#include "network/network.h"
#include "runtime/device/device.h"
#include "runtime/image/photo.h"
#include "runtime/scene/scene.h"
#include "runtime/training/answer_emulator.h"
#include "runtime/training/known_scene.h"

namespace itn {

struct Showing {
  int exemplars = 0;  // least_exemplars or more; 0: the network is shown nothing
  const Device* device = nullptr;
  int spp = 0;  // samples a pixel; 0: as noisy as the photos, 4 to 256, or 64 where nobody knows
  std::uint64_t seed = 0;
  std::function<void(double)> progress = {};  // fraction done
};

// Standard deviation of an image's noise over its mean, in the pixels that a network of this size sees; 0: the file
// does not say (channel stderr.Y of an EXR; photos always). Throws InputError.
double noise_share(const std::string& image, int size, const PhotoOptions& photo);

struct SceneToShow {
  const Scene& scene;
  int sensor = 0, medium = 0;
  const Body& body;
  const SceneView* view = nullptr;  // null: for networks of one channel
  std::string who;                  // as of body_of()
};

class ShownScene {
 public:
  // Renders and looks. noise: noise_share() of the noisiest photo. Throws UsageError: a sensor that is not square, a
  // medium without one number of each of the network's names; Interrupted soon after cancel is set.
  ShownScene(Network& network, const SceneToShow& shown, double noise, const Showing& how,
             const std::atomic<bool>& cancel);

  int spp() const { return spp_; }
  // Of the network's parameters, a sample each, in its units: what is known after it gave these raw outputs to a photo.
  std::vector<std::vector<double>> posterior(std::span<const float> raw) const;

 private:
  std::vector<OutputRange> outputs_;
  std::uint64_t seed_;
  int spp_ = 0;
  std::unique_ptr<AnswerEmulator> emulator_;
};

// Of each parameter its mean over the samples, and what 95 % of them lie between.
std::vector<ParameterEstimate> estimates_of(const std::vector<std::vector<double>>& samples);

}  // namespace itn
