// Whether a photo is like renderings of a scene, at any material.
//
// Exemplars and their derivatives tell what the scene looks like at other materials: each pixel is a Gaussian process
// of the material (gaussian_process.h). What is left of a photo beside the material that fits it best is compared with
// what noise leaves, that of the photo and that of the exemplars, and with what the process does not know there, pixel
// by pixel and in squares of 3 x 3 and 7 x 7, where a wrong light, shape, boundary or focus shows far below the noise
// of a pixel. How much the process does not know is what exemplars leave beside what the others tell of them. So a
// photo is told best where an exemplar lies near its material.
#pragma once
#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "network/prediction/gaussian_process.h"
#include "runtime/inverse/posterior/exemplar.h"

namespace itn {

// Rendered exemplars, as something sees them. Rows of an exemplar: itself, then its derivatives by the d coordinates of
// the material.
struct SeenExemplars {
  ImageRows images;
  ImageRows halves;  // half of what the first half of the samples shows, less half of the second's
  ImageRows errors;  // standard errors, a row an exemplar

  Eigen::VectorXf noise() const;  // each pixel's standard deviation, over all exemplars
};

class SceneLikeness {
 public:
  // kernel: of any numbers of the exemplars. width: pixels of a row of the square images.
  SceneLikeness(const std::shared_ptr<const MaterialKernel>& kernel, const SeenExemplars& exemplars,
                Eigen::Index width);

  // The material that fits a photo best, looked for from another.
  Eigen::VectorXd best_fit(const Eigen::RowVectorXf& photo, Eigen::VectorXd from) const;
  // By how many standard deviations more is left of a photo than should be, at the scale where it is most. errors: of
  // its pixels. from: as of best_fit().
  double doubt(const Eigen::RowVectorXf& photo, const Eigen::RowVectorXf& errors, const Eigen::VectorXd& from) const;

  // What 5 % of photos that are like their scene exceed (README of the folder above).
  static constexpr double limit = 3.6;

 private:
  static constexpr Eigen::Index scales = 3;  // single pixels, and squares of two sizes
  using PerScale = Eigen::Array<double, 1, scales>;

  // Of an image over the noise, less the mean: what is left of it beside the material that fits it best, which is
  // looked for from `at`, and which that becomes.
  Eigen::RowVectorXd left_of(const Eigen::RowVectorXd& image, Eigen::VectorXd& at) const;
  // Logarithms of the sums of squares.
  PerScale log_sizes(const Eigen::RowVectorXd& left) const;

  // What an image of the scene may differ by from what is told of it: sums over the pixels of variances, over the
  // noise.
  struct Unknown {
    double noise = 0;  // of the image and of what is told
    double rest = 0;   // what the process does not know
  };
  struct LogSizes {
    PerScale mean, deviation;
  };
  LogSizes expected(const Unknown& unknown) const;
  void learn_rest(Eigen::Index scale, const Eigen::ArrayXd& log_sizes, const std::vector<Unknown>& unknown);
  double level_of(const Eigen::RowVectorXf& errors) const;

  Eigen::Index width_;
  Eigen::RowVectorXd mean_, noise_;
  std::optional<GaussianProcess> process_;  // of the images less the mean, over the noise
  double exemplars_;
  double exemplar_noise_;  // sum over the pixels of its variance, over the noise
  // Of noise, and of what the process does not know: what of its sum of squares is left at each scale, and how the
  // logarithm of that scatters.
  PerScale noise_share_, noise_scatter_, rest_share_, rest_scatter_;
};

}  // namespace itn
