#include "network/training/rendered_image_loss.h"

#include <algorithm>
#include <map>

#include "itn/error.h"
#include "network/dataset/rendered_loss.h"
#include "network/training/object_radiance.h"
#include "runtime/base/random.h"

namespace itn {
namespace {

constexpr int default_spp = 16;

class BatchLoss : public ImageLoss {
 public:
  BatchLoss(const ImageLossOptions& options, const std::string& folder, const Manifest& set,
            const DatasetImages& training, const DatasetImages& validation, const std::atomic<bool>* cancel)
      : seed_(options.seed),
        spp_(options.spp ? options.spp : default_spp),
        size_(set.size),
        least_square_(least_mean_square(training)),
        training_(training),
        validation_(validation),
        device_(options.device),
        loss_(device_, set, folder, options.kind == "ssn" ? Operator::single : Operator::full, cancel) {}

  nlohmann::ordered_json circumstances() const {
    return {{"spp", spp_}, {"device", device_.info().name + ", " + device_.info().platform}};
  }

  Result evaluate(std::span<const std::size_t> examples, std::span<const double> parameters,
                  std::uint64_t step) override {
    return evaluate(training_, examples, parameters, step);
  }
  double validate(std::span<const std::size_t> examples, std::span<const double> parameters) override {
    return evaluate(validation_, examples, parameters, validation_step + examples.front()).loss;
  }

 private:
  static constexpr std::uint64_t validation_step = std::uint64_t{1} << 63;  // no training gets there

  // Mean squared difference over that of black, where the object is seen. Only the object counts: what else is seen is
  // nearly the same with any material, and single scattering leaves the floor black. And each image counts alike:
  // without the division the few brightest objects of a batch made nearly all of the gradient (the greatest was 40
  // times the median), and that only by the albedo.
  Result evaluate(const DatasetImages& of, std::span<const std::size_t> examples, std::span<const double> parameters,
                  std::uint64_t step) {
    // Mirror images have the loss of what they mirror.
    const auto original = [&](std::size_t i) { return examples[i] % of.images.size(); };
    std::vector<RerenderedImage> images;
    images.reserve(examples.size());
    for (std::size_t i = 0; i < examples.size(); ++i) {
      const Manifest::Image& image = of.images[original(i)];
      images.push_back({&image,
                        {parameters[3 * i], parameters[3 * i + 1], parameters[3 * i + 2]},
                        random_bits(seed_, step, i),
                        &of.radiance[original(i)],
                        &window(image.shape)});
    }
    Result result;
    const std::vector<LossGradient> losses = loss_.evaluate(images, spp_);
    for (std::size_t i = 0; i < losses.size(); ++i) {
      const ObjectRadiance target = object_radiance(of, original(i));
      const double scale = 1 / (std::max(target.mean_square, least_square_) * static_cast<double>(images.size()));
      // The noise of the images themselves is no difference that another material could take away.
      result.loss += scale * (losses[i].loss - target.noise);
      for (const double derivative : losses[i].gradient) result.gradient.push_back(scale * derivative);
    }
    return result;
  }

  const ObjectWindow& window(int shape) {
    const auto found = windows_.find(shape);
    if (found != windows_.end()) return found->second;
    return windows_[shape] = object_window(training_.shapes[static_cast<std::size_t>(shape)].mask, size_);
  }

  std::uint64_t seed_;
  int spp_, size_;
  double least_square_;
  const DatasetImages &training_, &validation_;
  std::map<int, ObjectWindow> windows_;  // by shape
  Device device_;
  RenderedLoss loss_;
};

}  // namespace

RenderedImageLoss make_image_loss(const ImageLossOptions& options, const std::string& folder, const Manifest& manifest,
                                  const DatasetImages& training, const DatasetImages& validation,
                                  const std::atomic<bool>* cancel) {
  auto loss = std::make_unique<BatchLoss>(options, folder, manifest, training, validation, cancel);
  nlohmann::ordered_json circumstances = loss->circumstances();
  return {std::move(loss), std::move(circumstances)};
}

}  // namespace itn
