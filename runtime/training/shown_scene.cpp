#include "runtime/training/shown_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "runtime/base/error.h"
#include "runtime/base/file.h"
#include "runtime/image/exr.h"
#include "runtime/inversion/posterior/low_discrepancy.h"
#include "runtime/renderer.h"
#include "runtime/scene/parameters.h"

namespace itn {
namespace {

constexpr int pilot_spp = 16;  // of the rendering that tells how many samples are as noisy as the photo
constexpr int usual_spp = 64, least_spp = 4;
constexpr int most_spp = 256;  // then what a polynomial cannot follow is more than the noise
constexpr int samples = 2000;  // of the posterior

double noise_share(const std::vector<float>& value, const std::vector<float>& noise) {
  double sum = 0, square = 0;
  for (const float v : value) sum += static_cast<double>(v);
  for (const float e : noise) square += static_cast<double>(e) * static_cast<double>(e);
  const auto pixels = static_cast<double>(value.size());
  return sum > 0 ? std::sqrt(square / pixels) / (sum / pixels) : 0;
}

// The scene's numbers that an output of the network stands for: one, or a colour's three.
std::vector<Parameter> numbers_of(const Scene& scene, int medium, const OutputRange& output, const std::string& who) {
  std::vector<Parameter> found;
  for (const Parameter& p : list_parameters(scene)) {
    const bool of_medium = p.owner == Owner::medium || p.owner == Owner::phase;
    if (of_medium && p.member == output.name && p.belongs_to(medium) && !p.has_values()) found.push_back(p);
  }
  const bool one = std::all_of(found.begin(), found.end(), [&](const Parameter& p) { return p.id == found[0].id; });
  if (found.empty() || !one)
    throw UsageError(fmt::format("{}: the network knows media with one {}, and the scene's has {}", who, output.name,
                                 found.empty() ? "none" : "several"));
  return found;
}

// The scene on a film of the network's size, of any material.
class MaterialScene {
 public:
  MaterialScene(const NetworkDescription& network, const SceneToShow& shown)
      : scene_(shown.scene), outputs_(network.outputs) {
    film_for_network(scene_, shown.sensor, network.size, shown.who);
    scene_.sensors[static_cast<std::size_t>(shown.sensor)].luminance = true;
    for (const OutputRange& output : outputs_) numbers_.push_back(numbers_of(scene_, shown.medium, output, shown.who));
    sigma_t_unit_ = sigma_t_unit(scene_, shown.medium, network, shown.body);
  }

  const Scene& at(const Eigen::VectorXd& shares) {
    for (std::size_t i = 0; i < outputs_.size(); ++i) {
      const double unit = outputs_[i].name == "sigma_t" ? sigma_t_unit_ : 1;
      const double value = unit * outputs_[i].parameter_of_share(shares[static_cast<Eigen::Index>(i)]);
      for (const Parameter& number : numbers_[i]) set_parameter(scene_, number, value);
    }
    return scene_;
  }

 private:
  Scene scene_;
  std::vector<OutputRange> outputs_;
  std::vector<std::vector<Parameter>> numbers_;  // of each output
  double sigma_t_unit_ = 1;
};

}  // namespace

double noise_share(const std::string& image, int size, const PhotoOptions& options) {
  std::vector<float> value, noise;
  if (is_exr(read_file(image))) {
    value = luminance_of(read_exr(image), image, &noise);
  } else {
    const Photo photo = luminance_of(read_photo(image, options));
    value = photo.value;
    noise = photo.noise;
  }
  // Of as many pixels as the network sees as one.
  const double averaged = std::max(1.0, static_cast<double>(value.size()) / (static_cast<double>(size) * size));
  return noise_share(value, noise) / std::sqrt(averaged);
}

ShownScene::ShownScene(Network& network, const SceneToShow& shown, double noise, const Showing& how,
                       const std::atomic<bool>& cancel)
    : outputs_(network.description().outputs), seed_(how.seed) {
  const NetworkDescription& description = network.description();
  MaterialScene material(description, shown);
  const auto dimensions = static_cast<Eigen::Index>(outputs_.size());
  Eigen::MatrixXd shares(dimensions, how.exemplars), answers(dimensions, how.exemplars);
  for (int k = 0; k < how.exemplars; ++k) shares.col(k) = (low_discrepancy_point(dimensions, k).array() + 1) / 2;

  RenderOptions options;
  options.sensor = shown.sensor;
  options.seed = how.seed;
  options.cancel = &cancel;
  Renderer renderer(*how.device, material.at(Eigen::VectorXd::Constant(dimensions, 0.5)), options);
  spp_ = how.spp > 0 ? how.spp : usual_spp;
  int sample = 0;
  if (how.spp == 0 && noise > 0) {
    const Rendering pilot = renderer.render(sample, pilot_spp);
    sample += pilot_spp;
    const double wanted = pilot_spp * std::pow(noise_share(pilot.mean, pilot.stderr_) / noise, 2);
    spp_ = static_cast<int>(std::clamp<double>(std::round(wanted), least_spp, most_spp));
  }
  constexpr double most_samples = 1 << 30;  // that a pixel has
  if (static_cast<double>(spp_) * how.exemplars > most_samples)
    throw UsageError(fmt::format("{} exemplars with {} samples a pixel: need at most {} samples in all", how.exemplars,
                                 spp_, most_samples));
  std::vector<float> input(network.image_values());
  for (int k = 0; k < how.exemplars; ++k) {
    renderer.replace(material.at(shares.col(k)));
    const Rendering rendering = renderer.render(sample, spp_);
    sample += spp_;
    if (shown.view) {
      const KnownScene known = shown.view->known();
      network_input(description, rendering.mean, &known, input);
    } else {
      network_input(description, rendering.mean, nullptr, input);
    }
    const std::vector<float>& raw = network.forward(input, 1);
    for (Eigen::Index i = 0; i < dimensions; ++i) answers(i, k) = static_cast<double>(raw[static_cast<std::size_t>(i)]);
    if (how.progress) how.progress(static_cast<double>(k + 1) / how.exemplars);
  }
  emulator_ = std::make_unique<AnswerEmulator>(shares, answers);
}

std::vector<std::vector<double>> ShownScene::posterior(std::span<const float> raw) const {
  Eigen::VectorXd answer(static_cast<Eigen::Index>(outputs_.size()));
  for (Eigen::Index i = 0; i < answer.size(); ++i) answer[i] = static_cast<double>(raw[static_cast<std::size_t>(i)]);
  const Eigen::MatrixXd shares = emulator_->posterior(answer, samples, seed_);
  std::vector<std::vector<double>> result;
  for (Eigen::Index s = 0; s < shares.cols(); ++s) {
    std::vector<double>& sample = result.emplace_back();
    for (std::size_t i = 0; i < outputs_.size(); ++i)
      sample.push_back(outputs_[i].parameter_of_share(shares(static_cast<Eigen::Index>(i), s)));
  }
  return result;
}

std::vector<ParameterEstimate> estimates_of(const std::vector<std::vector<double>>& samples) {
  std::vector<ParameterEstimate> result;
  for (std::size_t i = 0; i < samples.front().size(); ++i) {
    std::vector<double> values;
    for (const std::vector<double>& sample : samples) values.push_back(sample[i]);
    std::sort(values.begin(), values.end());
    const auto count = static_cast<double>(values.size());
    double sum = 0;
    for (const double v : values) sum += v;
    const auto at = [&](double share) { return values[static_cast<std::size_t>(share * (count - 1))]; };
    result.push_back({sum / count, at(0.025), at(0.975)});
  }
  return result;
}

}  // namespace itn
