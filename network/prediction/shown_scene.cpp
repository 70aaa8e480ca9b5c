#include "network/prediction/shown_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <span>

#include "network/prediction/answer_emulator.h"
#include "network/prediction/image_sums.h"
#include "network/prediction/known_scene.h"
#include "network/prediction/material_coordinates.h"
#include "network/prediction/scene_likeness.h"
#include "runtime/base/error.h"
#include "runtime/base/random.h"
#include "runtime/image/halves.h"
#include "runtime/inverse/posterior/low_discrepancy.h"

namespace itn {
namespace {

constexpr int pilot_spp = 16;  // of the rendering that tells how many samples are as noisy as the photo
constexpr int usual_spp = 64, least_spp = 4;
constexpr int most_spp = 256;              // then what an emulator cannot follow is more than the noise
constexpr int samples = 1000;              // of the posterior: ends of intervals to a twelfth of a deviation
constexpr int drawn_from = 256;            // samples of a posterior that says where exemplars shall lie
constexpr std::size_t least_a_photo = 3;   // exemplars where its material may be; of fewer, intervals hold less often
constexpr int sums_an_output = 3;          // of pixels
constexpr int refinements = 2;             // rounds of exemplars where the photos' materials may be
constexpr double step = 0.02;              // of a share, along derivative images
constexpr std::size_t most_in_group = 24;  // of photos of which each learns from what was rendered for the others

// Number k of those that are spread over the cube. Where no others follow they are as dense towards its faces as
// Chebyshev's points are: materials at these have neighbours on one side only.
Eigen::VectorXd spread_point(Eigen::Index dimensions, int k, bool others_follow) {
  Eigen::VectorXd point = low_discrepancy_point(dimensions, k);
  if (!others_follow) point = (std::numbers::pi / 2 * point.array()).sin();
  return point;
}

Eigen::VectorXd shares_of(const Eigen::VectorXd& point) { return (point.array() + 1) / 2; }

Eigen::Map<const Eigen::RowVectorXf> row_of(const std::vector<float>& pixels) {
  return {pixels.data(), static_cast<Eigen::Index>(pixels.size())};
}

double noise_share(const std::vector<float>& value, const std::vector<float>& noise) {
  double sum = 0, square = 0;
  for (const float v : value) sum += static_cast<double>(v);
  for (const float e : noise) square += static_cast<double>(e) * static_cast<double>(e);
  const auto pixels = static_cast<double>(value.size());
  return sum > 0 ? std::sqrt(square / pixels) / (sum / pixels) : 0;
}

// What a network sees of an image, and what it answers.
struct LookedAt {
  Eigen::RowVectorXf image;   // radiance as in the first channel of its input (network/model/input.h)
  Eigen::RowVectorXd answer;  // raw outputs of the parameters
};

// What the network sees of images of the scene, and what it answers.
class Look {
 public:
  Look(Network& network, const SceneView* view) : network_(network), view_(view), input_(network.image_values()) {}

  LookedAt at(const Eigen::RowVectorXf& luminance) {
    LookedAt looked{see(luminance), {}};
    const std::vector<float>& raw = network_.forward(input_, 1);
    looked.answer.resize(static_cast<Eigen::Index>(network_.description().outputs.size()));
    for (Eigen::Index i = 0; i < looked.answer.size(); ++i)
      looked.answer[i] = static_cast<double>(raw[static_cast<std::size_t>(i)]);
    return looked;
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
  Eigen::RowVectorXf see(const Eigen::RowVectorXf& luminance) {
    const std::span<const float> values(luminance.data(), static_cast<std::size_t>(luminance.size()));
    network_input(network_.description(), view_ ? view_->seen(values) : Seen{values}, input_);
    return Eigen::Map<const Eigen::RowVectorXf>(input_.data(), luminance.size());
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
int samples_for(const Showing& how, std::size_t photos, double as_noisy) {
  int spp = how.spp > 0 ? how.spp : usual_spp;
  if (how.spp == 0 && as_noisy > 0)
    spp = static_cast<int>(std::clamp<double>(std::round(as_noisy), least_spp, most_spp));
  constexpr double most_samples = 1 << 30;  // that a pixel has
  const double renderings = how.exemplars + static_cast<double>(photos);
  if (spp * renderings > most_samples)
    throw UsageError(fmt::format("{} exemplars and {} photos with {} samples a pixel: need at most {} samples in all",
                                 how.exemplars, photos, spp, most_samples));
  return std::max(least_spp, spp + spp % 2);  // in two halves
}

// Exemplars, as the network sees them.
struct Exemplars {
  Eigen::MatrixXd points;   // materials in the cube [-1, 1]^d, a column each
  Eigen::MatrixXd answers;  // rows as those of the images
  SeenExemplars seen;

  // a, b: of as many samples each.
  void add(const Eigen::VectorXd& at, const MaterialImages& a, const MaterialImages& b, Look& look) {
    const Eigen::Index d = at.size(), before = points.cols(), first = before * (1 + d);
    const auto pixels = static_cast<Eigen::Index>(a.image.mean.size());
    const Rendering whole = whole_of(a.image, b.image);
    const Eigen::RowVectorXf luminance = row_of(whole.mean);
    const auto share = static_cast<float>(step);
    points.conservativeResize(d, before + 1);
    points.rightCols(1) = at;
    answers.conservativeResize(first + 1 + d, d);
    seen.images.conservativeResize(first + 1 + d, pixels);
    seen.halves.conservativeResize(first + 1 + d, pixels);
    seen.errors.conservativeResize(before + 1, pixels);
    const LookedAt looked = look.at(luminance);
    seen.images.row(first) = looked.image;
    answers.row(first) = looked.answer;
    seen.halves.row(first) = look.seen_difference(luminance, (row_of(a.image.mean) - row_of(b.image.mean)) / 2);
    for (Eigen::Index i = 0; i < d; ++i) {
      // Along derivative images; a share is half of a coordinate.
      const LookedAt slope = look.difference(luminance, share * (a.by_shares.row(i) + b.by_shares.row(i)) / 2);
      seen.images.row(first + 1 + i) = slope.image / (2 * share);
      answers.row(first + 1 + i) = slope.answer / (2 * step);
      seen.halves.row(first + 1 + i) =
          look.seen_difference(luminance, share * (a.by_shares.row(i) - b.by_shares.row(i)) / 2) / (2 * share);
    }
    seen.errors.row(before) = look.seen_difference(luminance, row_of(whole.stderr_));
  }
};

// What exemplars say of photos.
class Comparison {
 public:
  Comparison(const Exemplars& exemplars, const NetworkDescription& network)
      : sums_(exemplars.points, exemplars.seen.images, exemplars.seen.halves, exemplars.seen.noise(),
              sums_an_output * exemplars.points.rows()),
        emulator_(exemplars.points, statistics_of(exemplars.answers, sums_.of_own()),
                  coordinates_for(network.outputs)) {}

  // Materials in the cube, a column each.
  Eigen::MatrixXd posterior(const LookedAt& photo, int count, std::uint64_t seed) const {
    return emulator_.posterior(statistics_of(photo.answer, sums_.of(photo.image)).transpose(), count, seed);
  }
  std::shared_ptr<const MaterialKernel> kernel() const { return emulator_.kernel(); }

 private:
  static Eigen::MatrixXd statistics_of(const Eigen::MatrixXd& answers, const Eigen::MatrixXd& sums) {
    Eigen::MatrixXd all(answers.rows(), answers.cols() + sums.cols());
    all << answers, sums;
    return all;
  }

  ImageSums sums_;
  AnswerEmulator emulator_;
};

class SceneShow {
 public:
  SceneShow(Network& network, const SceneToShow& scene, const std::vector<ResampledImage>& photos, const Showing& how,
            const std::atomic<bool>& cancel)
      : network_(network.description()),
        photos_(photos),
        how_(how),
        look_(network, scene.view),
        renderer_(network_, scene, *how.device, options_of(how, cancel)) {
    for (const ResampledImage& photo : photos) seen_.push_back(look_.at(row_of(photo.value)));
    const Eigen::VectorXd middle = Eigen::VectorXd::Zero(dimensions());
    double as_noisy = 0, noise = 0;
    // Of the noisiest: of the others intervals are a little too wide.
    for (const ResampledImage& photo : photos) noise = std::max(noise, noise_share(photo.value, photo.errors));
    if (noise > 0) as_noisy = samples_as_noisy(noise, renderer_.render(shares_of(middle), 0, pilot_spp).image);
    spp_ = samples_for(how, photos.size(), as_noisy);
  }

  // Returns the samples a pixel of an exemplar.
  int show(const std::function<void(const ShownAnswer&)>& each) {
    Exemplars shared;
    // Where the photos' materials may be, if each gets some; else all lie where any photo's may.
    int refining = std::max(0, how_.exemplars - std::max(least_exemplars, how_.exemplars / 2));
    if (static_cast<std::size_t>(refining) < least_a_photo * seen_.size()) refining = 0;
    for (int k = 0; k < how_.exemplars - refining; ++k) render(shared, spread_point(dimensions(), k, refining > 0));
    for (int round = 0, k = 0; round < refinements && refining > 0; ++round) {
      const Comparison comparison(shared, network_);
      std::map<std::size_t, Eigen::MatrixXd> where;  // by what is known of each photo now
      for (; k < refining * (round + 1) / refinements; ++k) {
        const std::size_t photo = static_cast<std::size_t>(k) % seen_.size();
        if (!where.count(photo)) where[photo] = comparison.posterior(seen_[photo], drawn_from, how_.seed);
        const double u = random_uniform(how_.seed, 0, static_cast<std::uint64_t>(k));
        render(shared, where[photo].col(static_cast<Eigen::Index>(u * drawn_from)));
      }
    }
    const std::vector<Eigen::VectorXd> found = materials_in(shared);
    const std::size_t groups = (found.size() + most_in_group - 1) / most_in_group;
    for (std::size_t group = 0; group < groups; ++group)
      answer(shared, found, group * found.size() / groups, (group + 1) * found.size() / groups, each);
    return spp_;
  }

 private:
  static RenderOptions options_of(const Showing& how, const std::atomic<bool>& cancel) {
    RenderOptions options;
    options.seed = how.seed;
    options.cancel = &cancel;
    return options;
  }
  Eigen::Index dimensions() const { return static_cast<Eigen::Index>(network_.outputs.size()); }

  void render(Exemplars& exemplars, const Eigen::VectorXd& point) {
    // Of samples that no other has, nor the pilot.
    const int first = pilot_spp + rendered_ * spp_;
    const MaterialImages half = renderer_.render(shares_of(point), first, spp_ / 2);
    exemplars.add(point, half, renderer_.render(shares_of(point), first + spp_ / 2, spp_ / 2), look_);
    ++rendered_;
    if (how_.progress) how_.progress(rendered_ / (how_.exemplars + static_cast<double>(seen_.size())));
  }

  // Of each photo the material that fits it best by what exemplars say.
  std::vector<Eigen::VectorXd> materials_in(const Exemplars& exemplars) const {
    const Comparison comparison(exemplars, network_);
    const SceneLikeness likeness(comparison.kernel(), exemplars.seen, network_.size);
    std::vector<Eigen::VectorXd> found;
    for (const LookedAt& photo : seen_) {
      const Eigen::VectorXd mean = comparison.posterior(photo, drawn_from, how_.seed).rowwise().mean();
      found.push_back(likeness.best_fit(photo.image, mean));
    }
    return found;
  }

  // Of photos from one to another, after the scene is rendered where the material of each was found, too.
  void answer(Exemplars exemplars, const std::vector<Eigen::VectorXd>& found, std::size_t from, std::size_t to,
              const std::function<void(const ShownAnswer&)>& each) {
    for (std::size_t photo = from; photo < to; ++photo) render(exemplars, found[photo]);
    const Comparison comparison(exemplars, network_);
    const SceneLikeness likeness(comparison.kernel(), exemplars.seen, network_.size);
    for (std::size_t photo = from; photo < to; ++photo) {
      const Eigen::MatrixXd points = comparison.posterior(seen_[photo], samples, how_.seed);
      std::vector<std::vector<double>> values;
      for (Eigen::Index s = 0; s < points.cols(); ++s) values.push_back(values_of(points.col(s)));
      each({estimates_of(values), verdict(photo, likeness, points.rowwise().mean())});
    }
  }

  std::optional<Verdict> verdict(std::size_t photo, const SceneLikeness& likeness, const Eigen::VectorXd& from) {
    const std::vector<float>&value = photos_[photo].value, &errors = photos_[photo].errors;
    if (!(noise_share(value, errors) > 0)) return {};
    const double doubt = likeness.doubt(seen_[photo].image, look_.seen_difference(row_of(value), row_of(errors)), from);
    return Verdict{doubt, doubt > SceneLikeness::limit};
  }

  std::vector<double> values_of(const Eigen::VectorXd& point) const {
    const Eigen::VectorXd shares = shares_of(point);
    std::vector<double> values;
    for (std::size_t i = 0; i < network_.outputs.size(); ++i)
      values.push_back(network_.outputs[i].parameter_of_share(shares[static_cast<Eigen::Index>(i)]));
    return values;
  }

  const NetworkDescription& network_;
  const std::vector<ResampledImage>& photos_;
  const Showing& how_;
  Look look_;
  MaterialRenderer renderer_;
  std::vector<LookedAt> seen_;  // of the photos
  int spp_ = 0, rendered_ = 0;
};

}  // namespace

int show_scene(Network& network, const SceneToShow& scene, const std::vector<ResampledImage>& photos,
               const Showing& how, const std::atomic<bool>& cancel,
               const std::function<void(const ShownAnswer&)>& each) {
  require_exemplars(how.exemplars);
  return SceneShow(network, scene, photos, how, cancel).show(each);
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
