// Analysis by synthesis: parameters for which the rendered images are those of the targets. Two methods with the same
// result, in the coordinates of coordinate.h; both are a sequence of iterations of which each starts from a state that
// can be stored, so an interrupted inversion goes on with the same numbers.
//
// Adam (Kingma and Ba 2015) as in the paper: the image loss and its unbiased gradient, the same few samples a pixel in
// every iteration, a step size that falls to 0 as a cosine.
//
// Gauss-Newton (Levenberg and Marquardt's form): the residuals weighted by their noise (least_squares.h), fresh samples
// in every iteration, more of them as soon as a step is lost in the rendering's noise. Near the solution the equations
// of all iterations are pooled (normal_equations.h), until the rendering's noise is a small part of what the target's
// own noise does to the parameters.
#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "itn/target_image.h"
#include "runtime/inverse/adam_step.h"
#include "runtime/inverse/gauss_newton/normal_equations.h"

namespace itn {

struct InversionOptions {
  enum class Method { adam, gauss_newton } method = Method::gauss_newton;
  int iterations = 0;  // at most; 0: 200 for Adam, 50 for Gauss-Newton
  int spp = 0;         // Adam: of every iteration, 0: 16. Gauss-Newton: at most, 0: 1024, more of few pixels
  TargetNoise noise;
  double learning_rate = 0.05;  // Adam
  bool exposure = false;        // each target is known up to a factor only
  bool white_balance = false;   // so are red and blue, all targets' alike; Gauss-Newton, of targets with three channels
  Prior prior;                  // of the coordinates; Gauss-Newton

  int iteration_limit() const { return iterations > 0 ? iterations : method == Method::adam ? 200 : 50; }
  int sample_limit(const std::vector<TargetImage>& targets) const;
};

struct InversionState {
  int iteration = 0;             // the next one
  int spp = 0, next_sample = 0;  // its samples
  std::vector<double> x;         // the unknowns (least_squares.h) that it renders
  bool done = false, converged = false;
  int joined = -1;  // abandoned since it was heading for the end of this earlier start (StoredInversion::join)
  // Gauss-Newton: the rendering that is the reference, the accepted point, and how far it trusts a step.
  std::vector<double> reference_x, accepted_x;
  int reference_spp = 0, reference_sample = 0;
  double accepted_loss = 0, accepted_loss_stderr = 0, damping = 0.01;
  bool accepted = false;
  std::vector<double> pool;  // NormalEquations of the renderings since
  AdamMoments moments;       // Adam
};

struct InversionStep {
  int iteration = 0, spp = 0;
  std::vector<double> x;  // where it rendered
  double loss = 0, loss_stderr = 0;
  bool accepted = true;  // false: the step that led here made it worse, and is taken back
  double distance = 0;   // Gauss-Newton: of the next step, root mean square over the unknowns, in standard errors
};

class Inversion {
 public:
  Inversion(ForwardModel& model, const std::vector<TargetImage>& targets, const InversionOptions& options);

  // x: coordinates of the parameters. Renders where exposures have to be guessed.
  InversionState start(const std::vector<double>& x);
  // One iteration; not of a state that is done.
  InversionStep advance(InversionState& state);

  // The results at the end of a state, from a new rendering there.
  struct Conclusion {
    std::vector<double> x;  // the unknowns
    Eigen::MatrixXd covariance;
    double loss = 0, loss_stderr = 0;
    double residual = 0;     // mean of r^2 / variance; 1: what the noise explains
    double residuals = 0;    // how many
    double distance = 0;     // from the least-squares solution, as InversionStep
    bool hidden = false;     // the derivatives' noise hides a direction in which the image tells little
    bool determined = true;  // all directions, by the image or by the prior
    bool converged = false;  // Adam: within one and a half standard errors of it
    std::vector<Reference> references;
    std::vector<Rendering> images;
    std::vector<WhiteResidual> white;  // what is left of each target
    ImageFit fit;
    std::vector<std::array<double, 3>> factors;  // camera_factors() of each target
  };
  // Gauss-Newton, where it has converged, ends with the small step that this rendering asks for.
  Conclusion conclude(const InversionState& state);

  // Names of the unknowns: parameters, then "exposure 0" and so on, then "white balance R" and B.
  std::vector<std::string> names() const;

 private:
  std::vector<double> clamped(std::vector<double> x) const;
  std::vector<Reference> references_of(const std::vector<Rendering>& images, const std::vector<double>& x) const;
  void take_reference(const std::vector<double>& x, int first, int spp);
  // Moves the state to where the next iteration renders; true: this iteration's rendering is its reference.
  bool gauss_newton(const LeastSquares& equations, InversionState& state, InversionStep& step) const;
  void adam(const std::vector<std::vector<Rendering>>& images, InversionState& state, InversionStep& step) const;

  ForwardModel& model_;
  const std::vector<TargetImage>& targets_;
  InversionOptions options_;
  std::vector<Reference> references_;  // of the state's reference_x
  std::vector<double> reference_x_;
  int reference_sample_ = -1;
};

}  // namespace itn
