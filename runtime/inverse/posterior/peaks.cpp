#include "runtime/inverse/posterior/peaks.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

namespace itn {
namespace {

constexpr double least_rise = 1.5;    // of the log density over the pass
constexpr double least_share = 0.02;  // of the samples
constexpr Eigen::Index neighbours = 15;
constexpr Eigen::Index most_samples = 1500;  // that are looked at

}  // namespace

std::vector<Peak> peaks_of(const Eigen::MatrixXd& samples, const Eigen::VectorXd& log_density) {
  const Eigen::Index count = std::min(samples.cols(), most_samples);
  // In units of the samples' spread.
  const Eigen::VectorXd mean = samples.rowwise().mean();
  const Eigen::MatrixXd centred = samples.colwise() - mean;
  Eigen::MatrixXd covariance = centred * centred.transpose() / static_cast<double>(samples.cols());
  covariance.diagonal().array() += 1e-12;
  const Eigen::MatrixXd unit =
      Eigen::LLT<Eigen::MatrixXd>(covariance).matrixL().solve(Eigen::MatrixXd(centred.leftCols(count)));

  std::vector<Eigen::Index> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](Eigen::Index a, Eigen::Index b) { return log_density[a] > log_density[b]; });
  std::vector<Eigen::Index> parent(static_cast<std::size_t>(count), -1);  // -1: not reached yet; a root is its own
  const auto root = [&](Eigen::Index i) {
    while (parent[static_cast<std::size_t>(i)] != i) i = parent[static_cast<std::size_t>(i)];
    return i;
  };
  std::vector<std::pair<double, Eigen::Index>> distance(static_cast<std::size_t>(count));
  for (const Eigen::Index i : order) {
    for (Eigen::Index j = 0; j < count; ++j)
      distance[static_cast<std::size_t>(j)] = {(unit.col(j) - unit.col(i)).squaredNorm(), j};
    const auto near = distance.begin() + std::min(count, neighbours + 1);
    std::partial_sort(distance.begin(), near, distance.end());
    std::vector<Eigen::Index> roots;
    for (auto d = distance.begin(); d != near; ++d)
      if (d->second != i && parent[static_cast<std::size_t>(d->second)] >= 0) roots.push_back(root(d->second));
    if (roots.empty()) {
      parent[static_cast<std::size_t>(i)] = i;
      continue;
    }
    const Eigen::Index highest = *std::max_element(roots.begin(), roots.end(), [&](Eigen::Index a, Eigen::Index b) {
      return log_density[a] < log_density[b] || (log_density[a] == log_density[b] && a > b);
    });
    parent[static_cast<std::size_t>(i)] = highest;
    for (const Eigen::Index r : roots)
      if (r != highest && log_density[r] - log_density[i] < least_rise) parent[static_cast<std::size_t>(r)] = highest;
  }
  std::map<Eigen::Index, Peak> found;
  for (Eigen::Index i = 0; i < count; ++i) found[root(i)].samples.push_back(i);
  std::vector<Peak> peaks;
  for (auto& [top, peak] : found) {
    peak.top = samples.col(top);
    peak.share = static_cast<double>(peak.samples.size()) / static_cast<double>(count);
    if (peak.share >= least_share) peaks.push_back(std::move(peak));
  }
  std::stable_sort(peaks.begin(), peaks.end(), [](const Peak& a, const Peak& b) { return a.share > b.share; });
  return peaks;
}

}  // namespace itn
