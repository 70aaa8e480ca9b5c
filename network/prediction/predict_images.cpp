#include "network/prediction/predict_images.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <utility>

#include "itn/error.h"
#include "itn/trained_network.h"
#include "network/dataset/dataset_scene.h"
#include "network/prediction/image_judge.h"
#include "network/prediction/known_scene.h"
#include "network/training/dataset_examples.h"

namespace itn {
namespace {

// One for each image, or one for all.
const std::string& one_of(const std::vector<std::string>& files, std::size_t index) {
  return files.size() == 1 ? files.front() : files[index];
}

// Shape, light, mask and flash of the images, as far as the network sees them.
class Known {
 public:
  Known(const PredictionRequest& request, const NetworkDescription& network)
      : request_(request), network_(network), needs_(network), colours_(sees(network, "rgb") ? 3 : 1) {
    if (request.scene) {
      look_at(*request.scene);
    } else if (!request.shape_buffers.empty()) {
      shapes_[0] = read_resampled_seen_shape(request.shape_buffers, network.size);
      double square = 0;
      for (const double part : request.light) square += part * part;
      if (!(square > 0 && std::isfinite(square))) throw UsageError("--light: need a direction");
      for (std::size_t i = 0; i < 3; ++i) light_[i] = request.light[i] / std::sqrt(square);
    } else if (!request.dataset.empty()) {
      manifest_ = read_manifest(request.dataset);
      if (needs_.flash && !(manifest_.flash > 0))
        throw UsageError("--dataset " + request.dataset + ": has no flash; the network sees one");
      for (const Manifest::Image& image : manifest_.images)
        images_[canonical(std::filesystem::path(request.dataset) / image.file)] = &image;
    }
  }

  // What the scene's medium is inside of; none without a scene.
  const std::optional<Body>& body() const { return body_; }

  struct Looked {
    Photographs photographs;
    double saturated = 0;  // share of the image, or of its flash's, that is
  };

  // Image `index`, and what is known of it.
  Looked look(std::size_t index) {
    const std::string& file = request_.images[index];
    std::optional<CutOut> object;
    if (network_.cut_out > 0 && !request_.mask.empty())
      object = cut_out(one_of(request_.mask, index), network_.size, network_.cut_out);
    Looked looked;
    const auto read = [&](const std::string& from, const char* prefix) {
      ResampledImage image =
          read_resampled_radiance(from, network_.size, colours_, request_.photo, prefix, object ? &*object : nullptr);
      looked.saturated = std::max(looked.saturated, image.saturated);
      return std::move(image.value);
    };
    Photographs& seen = looked.photographs;
    seen.size = network_.size;
    seen.image = read(file, "");
    if (needs_.flash) {
      if (request_.flash.empty()) {
        seen.flash = read(file, "flash.");
      } else {
        seen.flash = read(request_.flash[index], "");
        double sum = 0;
        for (std::size_t i = 0; i < seen.flash.size(); ++i) sum += seen.flash[i] -= seen.image[i];
        if (!(sum > 0))
          throw InputError(
              fmt::format("{}: is no brighter than {}; need the same with the flash on", request_.flash[index], file));
      }
    }
    seen.light = light_;
    if (view_) {
      const Seen known = view_->seen(seen.image);
      seen.shape = *known.shape;
      seen.light = *known.light;
    } else if (!request_.shape_buffers.empty()) {
      seen.shape = shapes_.at(0);
    } else if (object) {
      seen.shape = object->mask;
    } else if (!request_.mask.empty()) {
      seen.shape = read_mask(one_of(request_.mask, index), network_.size);
    } else if (needs_.shape || needs_.mask) {
      const Manifest::Image& image = of_set(file);
      seen.shape = manifest_.cameras ? read_resampled_seen_shape(file, network_.size, manifest_.hash)
                                     : shape_of_set(image.shape);
      seen.light = before_camera(image, manifest_.lights[static_cast<std::size_t>(image.light)].direction);
    }
    if (network_.cut_out > 0 && !object)
      keep_object(seen, cut_out(std::move(seen.shape.mask), seen.size, seen.size, seen.size, network_.cut_out, file));
    return looked;
  }

 private:
  const Manifest::Image& of_set(const std::string& file) const {
    const auto found = images_.find(canonical(file));
    if (found == images_.end())
      throw InputError(file + ": is no image of the data set " + request_.dataset +
                       "; give --shape-buffers and --light");
    return *found->second;
  }

  const SeenShape& shape_of_set(int shape) {
    if (!shapes_.count(shape)) {
      const std::string& buffers = manifest_.shapes[static_cast<std::size_t>(shape)].buffers;
      shapes_[shape] = read_resampled_seen_shape((std::filesystem::path(request_.dataset) / buffers).string(),
                                                 network_.size, manifest_.hash);
    }
    return shapes_.at(shape);
  }

  void look_at(const Scene& scene) {
    const std::string who = "--scene " + scene.file;
    if (scene.media.size() != 1)
      throw UsageError(fmt::format("{}: the network knows one medium, the scene has {}", who, scene.media.size()));
    body_ = body_of(scene, 0, who);
    if (needs_.shape || (needs_.mask && request_.mask.empty()))
      view_.emplace(scene, request_.sensor, network_, *body_, who);
  }

  static std::string canonical(const std::filesystem::path& path) {
    std::error_code error;
    const std::filesystem::path result = std::filesystem::weakly_canonical(path, error);
    return error ? path.string() : result.string();
  }

  const PredictionRequest& request_;
  const NetworkDescription& network_;
  Needs needs_;
  int colours_;
  Manifest manifest_;
  std::map<std::string, const Manifest::Image*> images_;
  std::map<int, SeenShape> shapes_;
  std::array<double, 3> light_{};
  std::optional<Body> body_;
  std::optional<SceneView> view_;
};

void check_files(const std::string& option, const std::vector<std::string>& files, std::size_t images,
                 bool one_for_all) {
  if (files.empty() || files.size() == images || (one_for_all && files.size() == 1)) return;
  throw UsageError(fmt::format("{}: {} files for {} images; need one for each{}", option, files.size(), images,
                               one_for_all ? ", or one for all" : ""));
}

void check(const PredictionRequest& request, const NetworkDescription& network) {
  const Needs needs(network);
  const bool one_by_one = !request.shape_buffers.empty() || !request.light.empty();
  const bool by_set = !request.dataset.empty() && !request.test_images;
  if (!needs.any() && (by_set || one_by_one || !request.mask.empty() || !request.flash.empty()))
    throw UsageError(request.run +
                     ": its network sees the image alone; leave out --dataset, --shape-buffers, --light, --mask and "
                     "--flash");
  if (request.longest_side_mm > 0 && (request.scene || !request.dataset.empty()))
    throw UsageError("--longest-side: --scene and --dataset know how large the object is; leave it out");
  check_files("--mask", request.mask, request.images.size(), true);
  check_files("--flash", request.flash, request.images.size(), false);
  const int sources = !request.dataset.empty() + (request.scene != nullptr) + one_by_one;
  if (needs.shape && (sources != 1 || request.shape_buffers.empty() != request.light.empty()))
    throw UsageError(
        request.run +
        ": its network knows shape and light; give --dataset, or --scene, or both --shape-buffers and --light");
  if (needs.shape && !request.mask.empty())
    throw UsageError("--mask: the network knows the shape, and the mask from that; leave it out");
  if (!needs.mask && !request.mask.empty()) throw UsageError("--mask: the network sees none; leave it out");
  if (!needs.flash && !request.flash.empty()) throw UsageError("--flash: the network sees none; leave it out");
  if (needs.mask && !needs.shape && sources + !request.mask.empty() != 1)
    throw UsageError(request.run + ": its network sees a mask of the object; give --mask, or --dataset, or --scene");
  if (needs.flash && request.flash.empty() && request.dataset.empty())
    throw UsageError(request.run +
                     ": its network sees the light of a flash; give --flash (the same photo with "
                     "the flash on), or --dataset");
}

// saturated: share of the pixels, or of the object's where the network sees it alone.
std::string saturation_warning(const std::string& file, double saturated) {
  constexpr double much = 0.01;
  if (saturated <= much) return {};
  return fmt::format(
      "{}: {:.0f} % of what the network looks at is saturated, in it or with the flash; take it anew, "
      "darker: what is said of it may be far off",
      file, 100 * saturated);
}

// Of one image after another.
class ImagePredictor {
 public:
  using Each = std::function<void(const NetworkDescription&, const ImagePrediction&)>;

  ImagePredictor(const PredictionRequest& request, const std::atomic<bool>& cancel, const Each& each)
      : request_(request),
        cancel_(cancel),
        each_(each),
        network_(network_of(request.run)),
        result_{network_.description(), {}, false, {}} {
    check(request, result_.network);
    judge_ = ImageJudge::of(request.run, result_.network, request.judge);
    known_.emplace(request, result_.network);
    if (judge_ && (judge_->description().size != result_.network.size ||
                   std::fabs(judge_->description().cut_out - result_.network.cut_out) > 1e-6))
      judge_known_.emplace(request, judge_->description());
    result_.in_scene = known_->body().has_value();
  }

  PredictedImages all() {
    if (judge_) result_.doubt_limit = judge_->description().limit;
    std::vector<float> input(network_.image_values());
    for (std::size_t k = 0; k < request_.images.size(); ++k) {
      const auto [photographs, saturated] = known_->look(k);
      const Seen seen = photographs.seen();
      std::optional<Verdict> verdict;
      if (judge_) verdict = judge_->verdict(judge_known_ ? judge_known_->look(k).photographs.seen() : seen);
      network_input(result_.network, seen, input);
      add(estimates_of(network_.forward(input, 1), result_.network), verdict, saturated);
    }
    return std::move(result_);
  }

 private:
  // The next image.
  void add(std::vector<ParameterEstimate> parameters, const std::optional<Verdict>& verdict, double saturated) {
    if (cancel_) throw Interrupted();
    ImagePrediction image{request_.images[result_.images.size()], {}, std::move(parameters), verdict};
    for (const std::string& warning : {saturation_warning(image.file, saturated), doubt_warning(image)})
      if (!warning.empty()) image.warnings.push_back(warning);
    for (std::size_t i = 0; i < image.parameters.size(); ++i) {
      if (!result_.network.outputs[i].name.starts_with("sigma_t")) continue;
      for (double* number : {&image.parameters[i].value, &image.parameters[i].low, &image.parameters[i].high}) {
        if (result_.in_scene) *number = sigma_t_in_scene(*number, result_.network, *known_->body());
        if (request_.longest_side_mm > 0) *number *= result_.network.mm_per_unit / request_.longest_side_mm;
      }
    }
    if (each_) each_(result_.network, image);
    result_.images.push_back(std::move(image));
  }

  std::string doubt_warning(const ImagePrediction& image) const {
    return image.verdict ? judge_->warning(image.file, *image.verdict) : "";
  }

  const PredictionRequest& request_;
  const std::atomic<bool>& cancel_;
  const Each& each_;
  Network network_;
  PredictedImages result_;
  std::optional<ImageJudge> judge_;
  std::optional<Known> known_;        // looks at the network in result_
  std::optional<Known> judge_known_;  // where the judge sees fewer pixels or more, or larger objects
};

}  // namespace

PredictedImages predict_images(const PredictionRequest& request, const std::atomic<bool>& cancel,
                               const std::function<void(const NetworkDescription&, const ImagePrediction&)>& each) {
  return ImagePredictor(request, cancel, each).all();
}

}  // namespace itn
