// The losses that training minimizes, and their gradients by the network's raw outputs.
#pragma once
#include <span>
#include <vector>

#include "itn/network.h"

namespace itn {

struct OutputLoss {
  double loss = 0;
  std::vector<float> gradient;  // d loss / d raw output, (batch, outputs)
};

// The supervised loss (paper, eq. 2): mean over batch and outputs of (share - share of the truth)^2. The paper does not
// say in which units; the shares (output_range.h) give the three parameters like weights, and sigma_t by its logarithm.
// outputs: raw, (batch, outputs); truth: parameters, laid out likewise.
OutputLoss supervised_loss(std::span<const float> outputs, std::span<const double> truth,
                           const std::vector<OutputRange>& ranges);

// The loss of training: likelihood_loss() (distribution.h) for networks that predict a distribution, else
// supervised_loss().
OutputLoss training_loss(std::span<const float> outputs, std::span<const double> truth,
                         const NetworkDescription& network);

// Raw outputs (batch, raw_outputs) to parameters (batch, outputs): of a distribution at the mean shares.
std::vector<double> parameters_of(std::span<const float> outputs, const NetworkDescription& network);

// The term that ITN and SSN add (paper, eq. 3): how far the images rendered with the predicted parameters are from the
// input images. The trainer asks through this interface, and knows no renderer.
class ImageLoss {
 public:
  virtual ~ImageLoss() = default;

  struct Result {
    double loss = 0;               // mean over the batch
    std::vector<double> gradient;  // d loss / d parameter, (batch, outputs)
  };
  // examples: which ones of the training set the batch holds; parameters: predicted, (batch, outputs). The result must
  // be a function of the arguments alone: noise is seeded by `step`, so that training can be repeated bit for bit.
  virtual Result evaluate(std::span<const std::size_t> examples, std::span<const double> parameters,
                          std::uint64_t step) = 0;
  // The loss alone, of examples of the validation set, with the same noise whenever it is asked for.
  virtual double validate(std::span<const std::size_t> examples, std::span<const double> parameters) = 0;
};

// loss.gradient += weight * the image loss's gradient, by the raw outputs; loss.loss += weight * its loss. Of each
// example the image's gradient is at most as long as its supervised one can be: otherwise one image that is far off,
// whose relative difference has no bound, drives the outputs to the ends of their ranges, where gradients vanish.
void add_image_loss(OutputLoss& loss, const ImageLoss::Result& image, double weight, std::span<const float> outputs,
                    const std::vector<OutputRange>& ranges);

}  // namespace itn
