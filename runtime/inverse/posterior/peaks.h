// Peaks of a density that is known at its samples: how many, where, and how much belongs to each. Samples are taken
// from the likeliest on; one whose likelier neighbours belong to two peaks is a pass between them. A peak counts that
// rises high enough over the pass to a higher one (persistence; ToMATo, Chazal et al. 2013) and holds enough of the
// samples.
#pragma once
#include <Eigen/Core>
#include <vector>

namespace itn {

struct Peak {
  Eigen::VectorXd top;  // its likeliest sample
  double share = 0;     // of all samples
  std::vector<Eigen::Index> samples;
};

// samples: a column each; log_density: of each. From the largest share on.
std::vector<Peak> peaks_of(const Eigen::MatrixXd& samples, const Eigen::VectorXd& log_density);

}  // namespace itn
