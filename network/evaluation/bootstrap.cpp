#include "network/evaluation/bootstrap.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "runtime/base/random.h"
#include "runtime/base/statistics.h"

namespace itn {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

// Number of times that each of `count` things counts.
using Weights = std::vector<double>;

// Kinds of draws, each from random numbers of its own.
enum Stream : std::uint64_t { clusters_stream, above_stream, below_stream };

Weights all_once(std::size_t count) { return Weights(count, 1.0); }

Weights drawn(std::size_t count, std::uint64_t seed, Stream stream, int draw) {
  Weights weights(count);
  for (std::size_t i = 0; i < count; ++i)
    ++weights[random_bits(seed, stream, static_cast<std::uint64_t>(draw) * count + i) % count];
  return weights;
}

double weighted_average(const Clustered& run, Average how, const Weights& clusters) {
  double sum = 0, count = 0;
  for (std::size_t c = 0; c < run.sum.size(); ++c) {
    sum += clusters[c] * run.sum[c];
    count += clusters[c] * run.count[c];
  }
  if (count == 0) return nan;
  return how == Average::mean ? sum / count : std::sqrt(std::max(0.0, sum / count));
}

double weighted_average(const Runs& runs, Average how, const Weights& clusters, const Weights& of_runs) {
  double sum = 0, count = 0;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    if (of_runs[r] == 0) continue;
    sum += of_runs[r] * weighted_average(runs[r], how, clusters);
    count += of_runs[r];
  }
  return sum / count;
}

// The middle 95 % of the draws that gave a number.
Estimate interval(double value, std::vector<double> draws) {
  draws.erase(std::remove_if(draws.begin(), draws.end(), [](double d) { return std::isnan(d); }), draws.end());
  if (draws.empty()) return {value, nan, nan};
  std::sort(draws.begin(), draws.end());
  const auto quantile = [&](double p) {
    const double at = p * static_cast<double>(draws.size() - 1);
    const auto i = static_cast<std::size_t>(at);
    const std::size_t next = std::min(i + 1, draws.size() - 1);
    return draws[i] == draws[next] ? draws[i] : draws[i] + (at - std::floor(at)) * (draws[next] - draws[i]);
  };
  return {value, quantile(0.025), quantile(0.975)};
}

// statistic(clusters, above, below): of those weights.
template <class Statistic>
Estimate bootstrap(const Runs& above, std::size_t below, const Resampling& resampling, Statistic&& statistic) {
  const std::size_t clusters = above.front().sum.size();
  const double value = statistic(all_once(clusters), all_once(above.size()), all_once(below));
  if (clusters < 2) return {value, nan, nan};
  std::vector<double> draws;
  draws.reserve(static_cast<std::size_t>(resampling.draws));
  for (int d = 0; d < resampling.draws; ++d)
    draws.push_back(statistic(drawn(clusters, resampling.seed, clusters_stream, d),
                              drawn(above.size(), resampling.seed, above_stream, d),
                              drawn(below, resampling.seed, below_stream, d)));
  return interval(value, std::move(draws));
}

}  // namespace

Clustered clustered(std::span<const double> values, std::span<const std::size_t> cluster) {
  std::map<std::size_t, std::pair<double, double>> sums;
  for (std::size_t i = 0; i < values.size(); ++i) {
    sums[cluster[i]].first += values[i];
    sums[cluster[i]].second += 1;
  }
  Clustered result;
  for (const auto& [_, of_cluster] : sums) {
    result.sum.push_back(of_cluster.first);
    result.count.push_back(of_cluster.second);
  }
  return result;
}

double average(const Clustered& run, Average how) { return weighted_average(run, how, all_once(run.sum.size())); }

Estimate estimate(const Runs& runs, Average how, const Resampling& resampling) {
  return bootstrap(runs, 0, resampling, [&](const Weights& clusters, const Weights& of_runs, const Weights&) {
    return weighted_average(runs, how, clusters, of_runs);
  });
}

Estimate ratio(const Runs& above, const Runs& below, Average how, const Resampling& resampling) {
  return bootstrap(above, below.size(), resampling, [&](const Weights& clusters, const Weights& a, const Weights& b) {
    return weighted_average(above, how, clusters, a) / weighted_average(below, how, clusters, b);
  });
}

Estimate ratio_of_medians(std::span<const double> above, std::span<const double> below, const Resampling& resampling) {
  const std::size_t count = above.size();
  const auto all = [](std::span<const double> values) { return std::vector<double>(values.begin(), values.end()); };
  const double value = median(all(above)) / median(all(below));
  if (count < 2) return {value, nan, nan};
  std::vector<double> draws;
  for (int d = 0; d < resampling.draws; ++d) {
    std::vector<double> a, b;
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t k =
          random_bits(resampling.seed, clusters_stream, static_cast<std::uint64_t>(d) * count + i) % count;
      a.push_back(above[k]);
      b.push_back(below[k]);
    }
    draws.push_back(median(std::move(a)) / median(std::move(b)));
  }
  return interval(value, std::move(draws));
}

}  // namespace itn
