// Uncertainty of an average over images: percentile bootstrap (Efron 1979), over clusters of images that belong
// together.
//
// Images of one shape under one light are alike, so whole clusters of them are drawn, not single images; and where
// several networks of a kind were trained, those are drawn too.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace itn {

// A value of many images, summed within each cluster.
struct Clustered {
  std::vector<double> sum, count;  // one a cluster
};

// cluster: any number for each value; those that occur become the clusters, in ascending order.
Clustered clustered(std::span<const double> values, std::span<const std::size_t> cluster);

// One a trained network: all of the same images.
using Runs = std::vector<Clustered>;

enum class Average { mean, root_of_mean };

struct Estimate {
  double value = 0;
  double low = 0, high = 0;  // 95 % interval; NaN: a single cluster, from which nothing can be said
};

struct Resampling {
  int draws = 2000;
  std::uint64_t seed = 0;
};

// Over all images; a root of a mean below 0 is 0. Without images: NaN.
double average(const Clustered& run, Average how);

// The mean over the runs of their averages.
Estimate estimate(const Runs& runs, Average how, const Resampling& resampling = {});

// The quotient of two such; of both, the same clusters are drawn.
Estimate ratio(const Runs& above, const Runs& below, Average how, const Resampling& resampling = {});

// The quotient of the medians of two values of the same images, which are drawn one by one.
Estimate ratio_of_medians(std::span<const double> above, std::span<const double> below,
                          const Resampling& resampling = {});

}  // namespace itn
