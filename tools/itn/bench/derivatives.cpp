#include "tools/itn/bench/derivatives.h"

#include <cmath>

#include "itn/parameters.h"
#include "runtime/base/statistics.h"

namespace itn {
namespace {

MeanDerivative summary(const std::vector<double>& values) {
  const auto n = static_cast<double>(values.size());
  MeanDerivative s;
  for (const double v : values) s.value += v / n;
  for (const double v : values) s.variance += (v - s.value) * (v - s.value) / (n - 1);
  s.stderr_ = std::sqrt(s.variance / n);
  return s;
}

// The index in derivative_names that a parameter belongs to; -1: none.
int place(const Parameter& p) {
  if (p.is(Owner::medium, "sigma_t")) return 0;
  if (p.is(Owner::medium, "albedo")) return 1;
  return p.owner == Owner::phase ? 2 : -1;
}

}  // namespace

DerivativeCost derivative_cost(const Device& device, const Scene& scene, const std::string& file, RenderOptions options,
                               int runs, MitsubaPeer* peer) {
  std::vector<std::string> names;
  std::vector<std::size_t> places;
  for (const Parameter& p : list_parameters(scene))
    if (place(p) >= 0) {
      names.push_back(p.name);
      places.push_back(static_cast<std::size_t>(place(p)));
    }
  std::vector<double> value_s, derivatives_s, peer_s;
  std::array<std::vector<double>, 3> ours, others;
  const std::uint64_t seed = options.seed;
  for (int run = 0; run <= runs; ++run) {
    options.seed = seed + static_cast<std::uint64_t>(run);
    options.derivatives.clear();
    const Rendering value = render(device, scene, options);
    options.derivatives = names;
    const Rendering both = render(device, scene, options);
    if (run > 0) {
      value_s.push_back(value.render_s);
      derivatives_s.push_back(both.render_s);
      std::array<double, 3> sum{};
      for (std::size_t i = 0; i < names.size(); ++i)
        for (const double channel : both.derivatives[i].mean_of_image) sum[places[i]] += channel / both.channels;
      for (std::size_t k = 0; k < 3; ++k) ours[k].push_back(sum[k]);
    }
    if (!peer) continue;
    const PeerGradient gradient = peer->differentiate(file, value.spp, options.seed);
    if (run == 0) continue;
    peer_s.push_back(gradient.seconds);
    others[0].push_back(gradient.sigma_t);
    others[1].push_back(gradient.albedo);
    others[2].push_back(gradient.g);
  }
  DerivativeCost cost;
  cost.value_s = median(value_s);
  cost.derivatives_s = median(derivatives_s);
  if (peer) cost.peer_s = median(peer_s);
  for (std::size_t k = 0; k < 3; ++k) {
    cost.ours[k] = summary(ours[k]);
    if (peer) cost.peer[k] = summary(others[k]);
  }
  return cost;
}

}  // namespace itn
