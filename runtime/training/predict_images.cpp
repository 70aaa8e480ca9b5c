#include "runtime/training/predict_images.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>

#include "network/dataset_examples.h"
#include "runtime/base/error.h"
#include "runtime/training/known_scene.h"
#include "runtime/training/trained_network.h"

namespace itn {
namespace {

// Shape and light of the images, for networks of six channels.
class Known {
 public:
  Known(const PredictionRequest& request, const NetworkDescription& network) : request_(request), network_(network) {
    if (request.scene) {
      look_at(*request.scene);
    } else if (!request.shape_buffers.empty()) {
      shapes_[0] = read_resampled_seen_shape(request.shape_buffers, network.size);
      double square = 0;
      for (const double part : request.light) square += part * part;
      if (!(square > 0 && std::isfinite(square))) throw UsageError("--light: need a direction");
      for (std::size_t i = 0; i < 3; ++i) light_[i] = request.light[i] / std::sqrt(square);
    } else {
      manifest_ = read_manifest(request.dataset);
      for (const Manifest::Image& image : manifest_.images)
        images_[canonical(std::filesystem::path(request.dataset) / image.file)] = &image;
    }
  }

  // What the scene's medium is inside of; none without a scene.
  const std::optional<Body>& body() const { return body_; }

  const SceneView* view() const { return view_ ? &*view_ : nullptr; }

  KnownScene of(const std::string& file) {
    if (view_) return view_->known();
    if (!request_.shape_buffers.empty()) return {shapes_.at(0), light_};
    const auto found = images_.find(canonical(file));
    if (found == images_.end())
      throw InputError(file + ": is no image of the data set " + request_.dataset +
                       "; give --shape-buffers and --light");
    const Manifest::Image& image = *found->second;
    if (!shapes_.count(image.shape)) {
      const std::string& buffers = manifest_.shapes[static_cast<std::size_t>(image.shape)].buffers;
      shapes_[image.shape] = read_resampled_seen_shape((std::filesystem::path(request_.dataset) / buffers).string(),
                                                       network_.size, manifest_.hash);
    }
    return {shapes_.at(image.shape), manifest_.lights[static_cast<std::size_t>(image.light)].direction};
  }

 private:
  void look_at(const Scene& scene) {
    const std::string who = "--scene " + scene.file;
    if (scene.media.size() != 1)
      throw UsageError(fmt::format("{}: the network knows one medium, the scene has {}", who, scene.media.size()));
    body_ = body_of(scene, 0, who);
    if (network_.channels > 1) view_.emplace(scene, request_.sensor, network_.size, *body_, who);
  }

  static std::string canonical(const std::filesystem::path& path) {
    std::error_code error;
    const std::filesystem::path result = std::filesystem::weakly_canonical(path, error);
    return error ? path.string() : result.string();
  }

  const PredictionRequest& request_;
  const NetworkDescription& network_;
  Manifest manifest_;
  std::map<std::string, const Manifest::Image*> images_;
  std::map<int, SeenShape> shapes_;
  std::array<double, 3> light_{};
  std::optional<Body> body_;
  std::optional<SceneView> view_;
};

void check(const PredictionRequest& request, const NetworkDescription& network) {
  if (request.showing.exemplars > 0 && !request.scene)
    throw UsageError("--exemplars: the network is shown renderings of a scene; which one (--scene)?");
  const bool one_by_one = !request.shape_buffers.empty() || !request.light.empty();
  if (network.channels == 1) {
    if (one_by_one || !request.dataset.empty())
      throw UsageError(request.run +
                       ": its network sees luminance alone; leave out --dataset, --shape-buffers and --light");
  } else if (!request.dataset.empty() + (request.scene != nullptr) + one_by_one != 1 ||
             request.shape_buffers.empty() != request.light.empty()) {
    throw UsageError(
        request.run +
        ": its network knows shape and light; give --dataset, or --scene, or both --shape-buffers and --light");
  }
}

}  // namespace

PredictedImages predict_images(const PredictionRequest& request, const std::atomic<bool>& cancel,
                               const std::function<void(const NetworkDescription&, const ImagePrediction&)>& each) {
  Network network = network_of(request.run);
  const NetworkDescription& description = network.description();
  check(request, description);
  std::optional<Known> known;
  if (description.channels > 1 || request.scene) known.emplace(request, description);

  std::optional<ShownScene> shown;
  if (request.showing.exemplars > 0) {
    double noise = 0;  // of the noisiest: of the others intervals are a little too wide
    for (const std::string& file : request.images)
      noise = std::max(noise, noise_share(file, description.size, request.photo));
    const SceneToShow scene{*request.scene, request.sensor, 0,
                            *known->body(), known->view(),  "--scene " + request.scene->file};
    shown.emplace(network, scene, noise, request.showing, cancel);
  }
  PredictedImages result{description, known && known->body(), shown ? shown->spp() : 0, {}};
  std::vector<float> input(network.image_values());
  for (const std::string& file : request.images) {
    if (cancel) throw Interrupted();
    const std::vector<float> luminance = read_resampled_luminance(file, description.size, request.photo);
    if (description.channels > 1) {
      const KnownScene scene = known->of(file);
      network_input(description, luminance, &scene, input);
    } else {
      network_input(description, luminance, nullptr, input);
    }
    const std::vector<float>& raw = network.forward(input, 1);
    ImagePrediction image{file, shown ? estimates_of(shown->posterior(raw)) : estimates_of(raw, description)};
    for (std::size_t i = 0; i < image.parameters.size(); ++i)
      if (result.in_scene && description.outputs[i].name == "sigma_t")
        for (double* number : {&image.parameters[i].value, &image.parameters[i].low, &image.parameters[i].high})
          *number = sigma_t_in_scene(*number, description, *known->body());
    if (each) each(description, image);
    result.images.push_back(std::move(image));
  }
  return result;
}

}  // namespace itn
