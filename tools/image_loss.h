// The image loss of ITN and SSN (paper, eq. 3) for `itn train`: renders a batch again with the predicted parameters.
#pragma once
#include <memory>

#include "network/dataset_examples.h"
#include "network/loss.h"
#include "tools/common.h"

namespace itn::tools {

struct RenderedImageLoss {
  std::unique_ptr<ImageLoss> loss;
  // All that its numbers depend on beside data set and seed (samples, device): training goes on only with the same.
  nlohmann::ordered_json circumstances;
};

// kind: itn (all light) or ssn (single scattering). `training` holds what the loss's `examples` are indices of, with
// the shapes, and must outlive it. The loss throws Interrupted soon after Ctrl-C.
RenderedImageLoss make_image_loss(const std::string& kind, const CommonOptions& common, const std::string& folder,
                                  const Manifest& manifest, const DatasetImages& training);

}  // namespace itn::tools
