#include "tools/image_loss.h"

#include "runtime/dataset/rendered_loss.h"
#include "runtime/error.h"
#include "runtime/random.h"
#include "tools/interrupt.h"

namespace itn::tools {
namespace {

constexpr int default_spp = 16;

class BatchLoss : public ImageLoss {
 public:
  BatchLoss(const std::string& kind, const CommonOptions& common, int spp, const std::string& folder,
            const Manifest& set, const DatasetImages& training)
      : seed_(common.seed),
        spp_(spp),
        training_(training),
        device_(common.device),
        loss_(device_, set, folder, kind == "ssn" ? Operator::single : Operator::full, &interrupt_flag()) {}

  std::string device() const { return device_.info().name + ", " + device_.info().platform; }

  Result evaluate(std::span<const std::size_t> examples, std::span<const double> parameters,
                  std::uint64_t step) override {
    std::vector<RerenderedImage> images;
    for (std::size_t i = 0; i < examples.size(); ++i)
      images.push_back({&training_.images[examples[i]],
                        {parameters[3 * i], parameters[3 * i + 1], parameters[3 * i + 2]},
                        random_bits(seed_, step, i),
                        &training_.luminance[examples[i]]});
    Result result;
    const auto n = static_cast<double>(images.size());
    const std::vector<LossGradient> losses = loss_.evaluate(images, spp_);
    for (std::size_t i = 0; i < losses.size(); ++i) {
      // The noise of the images themselves is no difference that another material could take away.
      result.loss += (losses[i].loss - training_.noise[examples[i]]) / n;
      for (const double derivative : losses[i].gradient) result.gradient.push_back(derivative / n);
    }
    return result;
  }

 private:
  std::uint64_t seed_;
  int spp_;
  const DatasetImages& training_;
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
