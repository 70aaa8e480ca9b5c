// A network that is shown the scene: renderings of it at known materials, with derivatives, and what its answers to
// these make of its answer to a photo (answer_emulator.h). Half of the materials are spread over the network's ranges,
// the others lie where those of the photos may, by what the first say. Beside the network's answers sums of pixels are
// compared, those that materials move most (image_sums.h).
#pragma once
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "network/distribution.h"
#include "network/judge.h"
#include "network/network.h"
#include "runtime/device/device.h"
#include "runtime/image/photo.h"
#include "runtime/scene/scene.h"
#include "runtime/training/answer_emulator.h"
#include "runtime/training/material_renderer.h"
#include "runtime/training/scene_likeness.h"

namespace itn {

struct Showing {
  int exemplars = 0;  // least_exemplars to most_exemplars; 0: the network is shown nothing
  const Device* device = nullptr;
  // Samples a pixel, rounded up to 4, 6, 8 ...; 0: as noisy as the photos, 4 to 256, or 64 where nobody knows.
  int spp = 0;
  std::uint64_t seed = 0;
  std::function<void(double)> progress = {};  // fraction done
};

// Standard deviation of an image's noise over its mean, in the pixels that a network of this size sees; 0: the file
// does not say (channel stderr.Y of an EXR; photos always). Throws InputError.
double noise_share(const std::string& image, int size, const PhotoOptions& photo);

// What a network sees of an image, and what it answers.
struct LookedAt {
  Eigen::RowVectorXf image;   // radiance as in the first channel of its input (network/input.h)
  Eigen::RowVectorXd answer;  // raw outputs of the parameters
};

class ShownScene {
 public:
  // Renders and looks. photos: what the network sees of each (network_input()), one or more. noises: noise_share() of
  // each. Throws UsageError: as require_exemplars(), a sensor that is not square, a medium without one number
  // of each of the network's names; Interrupted soon after cancel is set. The network must outlive this.
  ShownScene(Network& network, const SceneToShow& shown, const std::vector<std::vector<float>>& photos,
             std::vector<double> noises, const Showing& how, const std::atomic<bool>& cancel);

  int spp() const { return spp_; }
  // What is known of one of the photos.
  struct Answer {
    std::vector<std::vector<double>> samples;  // of the network's parameters, in its units
    // Is it like the scene, at any material (scene_likeness.h)? Nobody can tell where the photo's noise is not known,
    // or the noisiest photo's is stronger than that of the renderings.
    std::optional<Verdict> verdict;
  };
  Answer answer(std::size_t photo) const;
  // Of the verdicts; none where there is none.
  std::optional<double> doubt_limit() const;

 private:
  struct Exemplars;
  void compare(const Exemplars& exemplars);

  Network& network_;
  std::uint64_t seed_;
  int spp_ = 0;
  std::vector<LookedAt> photos_;
  std::vector<double> noises_;
  std::vector<Eigen::VectorXd> statistics_;  // of these, by the last comparison
  std::unique_ptr<AnswerEmulator> emulator_;
  std::optional<SceneLikeness> likeness_;
};

// Of each parameter its mean over the samples, and what 95 % of them lie between.
std::vector<ParameterEstimate> estimates_of(const std::vector<std::vector<double>>& samples);

}  // namespace itn
