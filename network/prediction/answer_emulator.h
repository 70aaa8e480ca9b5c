// What a network's answer to an image means in one scene.
//
// A network's outputs are sums of an image that tell materials apart; what they are at a material depends on the scene,
// and of that a network knows only what others like it were when it learnt. So it is shown the scene itself, rendered
// at materials that are known (exemplars): its answers to these, and how they change with the material, say what it
// answers here (gaussian_process.h), and how far from that, by noise and by what the process cannot follow. An answer
// to a photo then has a likelihood at every material (a synthetic likelihood, Wood 2010, with a network's outputs as
// the statistics, Fearnhead and Prangle 2012), and as the covariance comes from some exemplars, it is Student's
// (Sellentin and Heavens 2016). Any other numbers that an image has can be statistics beside the outputs.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>

#include "network/prediction/gaussian_process.h"

namespace itn {

constexpr int least_exemplars = 12;
constexpr int most_exemplars = 128;  // every look at a material takes their number squared
// Throws UsageError: fewer or more than somebody may ask for.
void require_exemplars(Eigen::Index count);

class AnswerEmulator {
 public:
  // points: the exemplars' materials, a column each, in the cube [-1, 1]^d. answers: of each exemplar its statistics,
  // then their derivatives by the d coordinates; a column a statistic. Throws UsageError: fewer than least_exemplars.
  AnswerEmulator(const Eigen::MatrixXd& points, const Eigen::MatrixXd& answers,
                 const MaterialCoordinates& coordinates = plain_place);

  // Log of the likelihood of an answer, but for a constant, at a material.
  double log_likelihood(const Eigen::VectorXd& answer, const Eigen::VectorXd& point) const;
  // Materials by how likely they are after the answer, where before all of the cube were alike: `count` samples, a
  // column each.
  Eigen::MatrixXd posterior(const Eigen::VectorXd& answer, int count, std::uint64_t seed) const;

  std::shared_ptr<const MaterialKernel> kernel() const { return process_->kernel(); }

 private:
  Eigen::Index exemplars_;
  Eigen::VectorXd mean_, deviation_;        // of each statistic over the exemplars
  std::optional<GaussianProcess> process_;  // of these, less their mean, over their deviation
  Eigen::MatrixXd root_;                    // turns its errors, over their deviations, into independent ones
};

}  // namespace itn
