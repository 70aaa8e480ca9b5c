// The image loss of ITN and SSN (paper, eq. 3; relative, over the object): renders a batch again with the predicted
// parameters.
#pragma once
#include <atomic>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "itn/loss.h"
#include "network/dataset/manifest.h"
#include "network/training/dataset_examples.h"

namespace itn {

struct ImageLossOptions {
  std::string kind;    // itn: all light; ssn: single scattering
  std::string device;  // as for Device
  int spp = 0;         // samples a pixel, 2 or more; 0: 16
  std::uint64_t seed = 0;
};

struct RenderedImageLoss {
  std::unique_ptr<ImageLoss> loss;
  // All that its numbers depend on beside data set and seed (samples, device): training goes on only with the same.
  nlohmann::ordered_json circumstances;
};

// manifest: of the data set in `folder`. `training` and `validation` hold what the loss's `examples` are indices of,
// with the shapes. They and cancel must outlive the loss, which throws Interrupted soon after *cancel is set. Throws
// DeviceError.
RenderedImageLoss make_image_loss(const ImageLossOptions& options, const std::string& folder, const Manifest& manifest,
                                  const DatasetImages& training, const DatasetImages& validation,
                                  const std::atomic<bool>* cancel);

}  // namespace itn
