#include "runtime/training/shown_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "runtime/base/error.h"
#include "runtime/base/file.h"
#include "runtime/base/random.h"
#include "runtime/image/exr.h"
#include "runtime/inversion/posterior/low_discrepancy.h"
#include "runtime/training/image_sums.h"
#include "runtime/training/known_scene.h"
#include "runtime/training/material_coordinates.h"

namespace itn {
namespace {

constexpr int pilot_spp = 16;  // of the rendering that tells how many samples are as noisy as the photo
constexpr int usual_spp = 64, least_spp = 4;
constexpr int most_spp = 256;             // then what an emulator cannot follow is more than the noise
constexpr int samples = 2000;             // of the posterior
constexpr int drawn_from = 256;           // samples of a posterior from which exemplars are drawn
constexpr std::size_t least_a_photo = 3;  // exemplars where its material may be; of fewer, intervals hold less often
constexpr int sums_an_output = 3;         // of pixels
constexpr int refinements = 2;            // rounds of exemplars where the photos' materials may be
constexpr double step = 0.02;             // of a share, along derivative images
constexpr double least_noise = 0.005;     // of what a network sees of a pixel
constexpr double tolerance = 1.1;         // of renderings' samples over those that make them as noisy as photos

// Number k of those that are spread over the cube. Where no others follow they are as dense towards its faces as
// Chebyshev's points are: materials at these have neighbours on one side only.
Eigen::VectorXd spread_point(Eigen::Index dimensions, int k, bool others_follow) {
  Eigen::VectorXd point = low_discrepancy_point(dimensions, k);
  if (!others_follow) point = (std::numbers::pi / 2 * point.array()).sin();
  return point;
}

Eigen::VectorXd shares_of(const Eigen::VectorXd& point) { return (point.array() + 1) / 2; }

double noise_share(const std::vector<float>& value, const std::vector<float>& noise) {
  double sum = 0, square = 0;
  for (const float v : value) sum += static_cast<double>(v);
  for (const float e : noise) square += static_cast<double>(e) * static_cast<double>(e);
  const auto pixels = static_cast<double>(value.size());
  return sum > 0 ? std::sqrt(square / pixels) / (sum / pixels) : 0;
}

// What the network sees of images of the scene, and what it answers.
class Look {
 public:
  Look(Network& network, const SceneView* view) : network_(network), view_(view), input_(network.image_values()) {}

  LookedAt at(std::span<const float> input) {
    LookedAt looked{seen_of(input), {}};
    const std::vector<float>& raw = network_.forward(input, 1);
    looked.answer.resize(static_cast<Eigen::Index>(network_.description().outputs.size()));
    for (Eigen::Index i = 0; i < looked.answer.size(); ++i)
      looked.answer[i] = static_cast<double>(raw[static_cast<std::size_t>(i)]);
    return looked;
  }

  LookedAt at(const Eigen::RowVectorXf& luminance) {
    see(luminance);
    return at(std::span<const float>(input_));
  }

  // By how much what is seen, and answered, changes along a way, from the images to both sides.
  LookedAt difference(const Eigen::RowVectorXf& luminance, const Eigen::RowVectorXf& way) {
    const LookedAt forth = at(luminance + way), back = at(luminance - way);
    return {(forth.image - back.image) / 2, (forth.answer - back.answer) / 2};
  }
  Eigen::RowVectorXf seen_difference(const Eigen::RowVectorXf& luminance, const Eigen::RowVectorXf& way) {
    return (see(luminance + way) - see(luminance - way)) / 2;
  }

 private:
  Eigen::RowVectorXf seen_of(std::span<const float> input) const {
    const Eigen::Index side = network_.description().size;
    return Eigen::Map<const Eigen::RowVectorXf>(input.data(), side * side);
  }
  Eigen::RowVectorXf see(const Eigen::RowVectorXf& luminance) {
    const std::span<const float> values(luminance.data(), static_cast<std::size_t>(luminance.size()));
    input_in_scene(network_.description(), values, view_, input_);
    return seen_of(input_);
  }

  Network& network_;
  const SceneView* view_;
  std::vector<float> input_;
};

// Samples a pixel that make renderings as noisy as the photos, from a pilot's.
double samples_as_noisy(double noise, const Rendering& pilot) {
  return pilot_spp * std::pow(noise_share(pilot.mean, pilot.stderr_) / noise, 2);
}

// Samples a pixel, of both halves: what is asked for, or as many as make renderings as noisy as the photos; 0: nobody
// knows how many.
int samples_for(const Showing& how, double as_noisy) {
  int spp = how.spp > 0 ? how.spp : usual_spp;
  if (how.spp == 0 && as_noisy > 0)
    spp = static_cast<int>(std::clamp<double>(std::round(as_noisy), least_spp, most_spp));
  constexpr double most_samples = 1 << 30;  // that a pixel has
  if (static_cast<double>(spp) * how.exemplars > most_samples)
    throw UsageError(fmt::format("{} exemplars with {} samples a pixel: need at most {} samples in all", how.exemplars,
                                 spp, most_samples));
  return std::max(least_spp, spp + spp % 2);  // in two halves
}

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

// What was seen of the exemplars. Rows of an exemplar: itself, then its derivatives by the coordinates.
struct ShownScene::Exemplars {
  Eigen::MatrixXd points;  // materials in the cube [-1, 1]^d, a column each
  Eigen::MatrixXd answers;
  ImageRows images, halves;  // halves: as of ImageSums
  Eigen::VectorXf variance;  // of each pixel's noise, summed over the exemplars

  // a, b: of as many samples each.
  void add(const Eigen::VectorXd& at, const MaterialImages& a, const MaterialImages& b, Look& look) {
    const Eigen::Index d = at.size(), first = points.cols() * (1 + d);
    const auto pixels = static_cast<Eigen::Index>(a.image.mean.size());
    const auto row = [&](const std::vector<float>& values) {
      return Eigen::Map<const Eigen::RowVectorXf>(values.data(), pixels);
    };
    const Eigen::RowVectorXf luminance = (row(a.image.mean) + row(b.image.mean)) / 2;
    const auto share = static_cast<float>(step);
    points.conservativeResize(d, points.cols() + 1);
    points.rightCols(1) = at;
    answers.conservativeResize(first + 1 + d, d);
    images.conservativeResize(first + 1 + d, pixels);
    halves.conservativeResize(first + 1 + d, pixels);
    const LookedAt seen = look.at(luminance);
    images.row(first) = seen.image;
    answers.row(first) = seen.answer;
    halves.row(first) = look.seen_difference(luminance, (row(a.image.mean) - row(b.image.mean)) / 2);
    for (Eigen::Index i = 0; i < d; ++i) {
      // Along derivative images; a share is half of a coordinate.
      const LookedAt slope = look.difference(luminance, share * (a.by_shares.row(i) + b.by_shares.row(i)) / 2);
      images.row(first + 1 + i) = slope.image / (2 * share);
      answers.row(first + 1 + i) = slope.answer / (2 * step);
      halves.row(first + 1 + i) =
          look.seen_difference(luminance, share * (a.by_shares.row(i) - b.by_shares.row(i)) / 2) / (2 * share);
    }
    if (variance.size() == 0) variance = Eigen::VectorXf::Zero(pixels);
    const Eigen::RowVectorXf error =
        (row(a.image.stderr_).cwiseAbs2() + row(b.image.stderr_).cwiseAbs2()).cwiseSqrt() / 2;
    variance += look.seen_difference(luminance, error).transpose().cwiseAbs2();
  }

  // Standard deviation of each pixel.
  Eigen::VectorXf noise() const {
    return (variance.array() / static_cast<float>(points.cols()) + static_cast<float>(least_noise * least_noise))
        .sqrt();
  }
};

ShownScene::ShownScene(Network& network, const SceneToShow& shown, const std::vector<std::vector<float>>& photos,
                       std::vector<double> noises, const Showing& how, const std::atomic<bool>& cancel)
    : network_(network), seed_(how.seed), noises_(std::move(noises)) {
  require_exemplars(how.exemplars);
  const auto dimensions = static_cast<Eigen::Index>(network.description().outputs.size());
  Look look(network, shown.view);
  for (const std::vector<float>& photo : photos) photos_.push_back(look.at(photo));
  RenderOptions options;
  options.seed = how.seed;
  options.cancel = &cancel;
  MaterialRenderer renderer(network.description(), shown, *how.device, options);
  double as_noisy = 0;
  // Of the noisiest: of the others intervals are a little too wide.
  if (const double noise = *std::max_element(noises_.begin(), noises_.end()); noise > 0) {
    const Eigen::VectorXd middle = Eigen::VectorXd::Zero(dimensions);
    as_noisy = samples_as_noisy(noise, renderer.render(shares_of(middle), 0, pilot_spp).image);
  }
  spp_ = samples_for(how, as_noisy);

  Exemplars exemplars;
  const auto show = [&](const Eigen::VectorXd& point) {
    // Of samples that no other has, nor the pilot.
    const auto before = static_cast<int>(exemplars.points.cols());
    const int first = pilot_spp + before * spp_;
    const MaterialImages half = renderer.render(shares_of(point), first, spp_ / 2);
    exemplars.add(point, half, renderer.render(shares_of(point), first + spp_ / 2, spp_ / 2), look);
    if (how.progress) how.progress(static_cast<double>(exemplars.points.cols()) / how.exemplars);
  };
  // Where the photos' materials may be, if each gets some; else all lie where any photo's may.
  int refining = std::max(0, how.exemplars - std::max(least_exemplars, how.exemplars / 2));
  if (static_cast<std::size_t>(refining) < least_a_photo * photos.size()) refining = 0;
  for (int k = 0; k < how.exemplars - refining; ++k) show(spread_point(dimensions, k, refining > 0));
  compare(exemplars);
  for (int round = 0, k = 0; round < refinements && refining > 0; ++round) {
    std::map<std::size_t, Eigen::MatrixXd> where;  // by what is known of each photo now
    for (; k < refining * (round + 1) / refinements; ++k) {
      const std::size_t photo = static_cast<std::size_t>(k) % photos.size();
      if (!where.count(photo)) where[photo] = emulator_->posterior(statistics_[photo], drawn_from, seed_);
      const double u = random_uniform(seed_, 0, static_cast<std::uint64_t>(k));
      show(where[photo].col(static_cast<Eigen::Index>(u * drawn_from)));
    }
    compare(exemplars);
  }
  if (spp_ <= tolerance * as_noisy)
    likeness_.emplace(emulator_->kernel(), exemplars.images, exemplars.noise(), network.description().size);
}

void ShownScene::compare(const Exemplars& exemplars) {
  const ImageSums sums(exemplars.points, exemplars.images, exemplars.halves, exemplars.noise(),
                       sums_an_output * exemplars.points.rows());
  Eigen::MatrixXd all(exemplars.answers.rows(), exemplars.answers.cols() + sums.of_own().cols());
  all << exemplars.answers, sums.of_own();
  emulator_ = std::make_unique<AnswerEmulator>(exemplars.points, all, coordinates_for(network_.description().outputs));
  statistics_.clear();
  for (const LookedAt& photo : photos_)
    statistics_.emplace_back(all.cols()) << photo.answer.transpose(), sums.of(photo.image).transpose();
}

ShownScene::Answer ShownScene::answer(std::size_t photo) const {
  const std::vector<OutputRange>& outputs = network_.description().outputs;
  const Eigen::MatrixXd points = emulator_->posterior(statistics_[photo], samples, seed_);
  Answer result;
  for (Eigen::Index s = 0; s < points.cols(); ++s) {
    const Eigen::VectorXd shares = shares_of(points.col(s));
    std::vector<double>& sample = result.samples.emplace_back();
    for (std::size_t i = 0; i < outputs.size(); ++i)
      sample.push_back(outputs[i].parameter_of_share(shares[static_cast<Eigen::Index>(i)]));
  }
  if (likeness_ && noises_[photo] > 0) {
    const double doubt = likeness_->doubt(photos_[photo].image, points.rowwise().mean());
    result.verdict = {doubt, doubt > likeness_->limit()};
  }
  return result;
}

std::optional<double> ShownScene::doubt_limit() const {
  if (!likeness_) return {};
  return likeness_->limit();
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
