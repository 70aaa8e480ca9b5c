#include "tools/image_loss.h"

#include <map>

#include "runtime/dataset/rendered_loss.h"
#include "runtime/error.h"
#include "runtime/random.h"
#include "tools/interrupt.h"

namespace itn::tools {
namespace {

constexpr int default_spp = 8;

class BatchLoss : public ImageLoss {
 public:
  BatchLoss(const std::string& kind, const CommonOptions& common, int spp, const std::string& folder,
            const Manifest& set, const DatasetImages& training)
      : seed_(common.seed),
        spp_(spp),
        size_(set.size),
        training_(training),
        device_(common.device),
        loss_(device_, set, folder, kind == "ssn" ? Operator::single : Operator::full, &interrupt_flag()) {}

  std::string device() const { return device_.info().name + ", " + device_.info().platform; }

  // Only the object counts: what else is seen is the same with any material, but for shadows and what leaves the object
  // for the floor, and single scattering leaves the floor black.
  Result evaluate(std::span<const std::size_t> examples, std::span<const double> parameters,
                  std::uint64_t step) override {
    std::vector<RerenderedImage> images;
    images.reserve(examples.size());
    for (std::size_t i = 0; i < examples.size(); ++i) {
      const Manifest::Image& image = training_.images[examples[i]];
      images.push_back({&image,
                        {parameters[3 * i], parameters[3 * i + 1], parameters[3 * i + 2]},
                        random_bits(seed_, step, i),
                        &training_.luminance[examples[i]],
                        &window(image.shape)});
    }
    Result result;
    const auto n = static_cast<double>(images.size());
    const std::vector<LossGradient> losses = loss_.evaluate(images, spp_);
    for (std::size_t i = 0; i < losses.size(); ++i) {
      // The noise of the images themselves is no difference that another material could take away.
      result.loss += (losses[i].loss - noise(examples[i])) / n;
      for (const double derivative : losses[i].gradient) result.gradient.push_back(derivative / n);
    }
    return result;
  }

 private:
  const ObjectWindow& window(int shape) {
    const auto found = windows_.find(shape);
    if (found != windows_.end()) return found->second;
    return windows_[shape] = object_window(training_.shapes[static_cast<std::size_t>(shape)].mask, size_);
  }

  // The mean square of the image's standard errors where its object is seen.
  double noise(std::size_t example) {
    const ObjectWindow& seen = window(training_.images[example].shape);
    const std::vector<float> errors = cut(training_.errors[example], size_, seen);
    double sum = 0, count = 0;
    for (std::size_t i = 0; i < errors.size(); ++i) {
      sum += seen.weight[i] * errors[i] * errors[i];
      count += seen.weight[i];
    }
    return sum / count;
  }

  std::uint64_t seed_;
  int spp_, size_;
  const DatasetImages& training_;
  std::map<int, ObjectWindow> windows_;  // by shape
  Device device_;
  RenderedLoss loss_;
};

}  // namespace

RenderedImageLoss make_image_loss(const std::string& kind, const CommonOptions& common, const std::string& folder,
                                  const Manifest& manifest, const DatasetImages& training) {
  const int spp = common.spp ? common.spp : default_spp;
  auto loss = std::make_unique<BatchLoss>(kind, common, spp, folder, manifest, training);
  nlohmann::ordered_json circumstances{{"spp", spp}, {"device", loss->device()}};
  return {std::move(loss), std::move(circumstances)};
}

}  // namespace itn::tools
