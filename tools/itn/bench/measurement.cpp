#include "tools/itn/bench/measurement.h"

#include <cmath>

#include "itn/load_scene.h"
#include "itn/renderer.h"
#include "runtime/base/statistics.h"

namespace itn {

void Repeats::add(double seconds, const std::vector<float>& pixels) {
  seconds_.push_back(seconds);
  if (mean_.empty()) {
    mean_.assign(pixels.size(), 0.0);
    square_.assign(pixels.size(), 0.0);
  }
  const auto count = static_cast<double>(seconds_.size());
  double total = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const double value = pixels[i], delta = value - mean_[i];
    mean_[i] += delta / count;
    square_[i] += delta * (value - mean_[i]);
    total += value;
  }
  image_means_.push_back(total / static_cast<double>(pixels.size()));
}

double Repeats::seconds() const { return median(seconds_); }

double Repeats::relative_variance(int spp) const {
  double variance = 0, power = 0;
  for (std::size_t i = 0; i < mean_.size(); ++i) {
    variance += square_[i] / static_cast<double>(seconds_.size() - 1);
    power += mean_[i] * mean_[i];
  }
  return variance / power * spp;
}

double Repeats::image_mean() const {
  double sum = 0;
  for (const double value : image_means_) sum += value;
  return sum / static_cast<double>(image_means_.size());
}

double Repeats::image_mean_stderr() const {
  const auto n = static_cast<double>(seconds_.size());
  double sum = 0;
  // The three channels of a pixel rise and fall together.
  for (std::size_t i = 0; i + 2 < square_.size(); i += 3) {
    const double spread = std::sqrt(square_[i]) + std::sqrt(square_[i + 1]) + std::sqrt(square_[i + 2]);
    sum += spread * spread;
  }
  return std::sqrt(sum / (n - 1) / n) / static_cast<double>(mean_.size());
}

double BenchRow::speed_ratio() const { return peer->seconds() / ours.seconds(); }

double BenchRow::efficiency_ratio() const {
  return speed_ratio() * peer->relative_variance(spp) / ours.relative_variance(spp);
}

double BenchRow::mean_z() const {
  return (ours.image_mean() - peer->image_mean()) / std::hypot(ours.image_mean_stderr(), peer->image_mean_stderr());
}

BenchRow measure(const Device& device, MitsubaPeer* peer, const BenchScene& scene, const BenchOptions& options) {
  const Scene loaded = load_scene(scene.file);
  RenderOptions render_options;
  render_options.spp = options.spp;
  render_options.cancel = options.cancel;
  BenchRow row;
  row.scene = scene;
  if (peer) row.peer.emplace();
  for (int run = 0; run <= options.runs; ++run) {
    render_options.seed = options.seed + static_cast<std::uint64_t>(run);
    const Rendering image = render(device, loaded, render_options);
    row.spp = image.spp;
    row.paths = static_cast<double>(image.paths);
    if (run > 0) row.ours.add(image.render_s, image.mean);
    if (!peer) continue;
    const PeerImage other = peer->render(scene.file, row.spp, render_options.seed);
    if (run > 0) row.peer->add(other.seconds, other.pixels);
  }
  return row;
}

std::vector<GeometricMean> geometric_means(const std::vector<BenchRow>& rows) {
  std::vector<std::string> groups;
  for (const BenchRow& row : rows)
    if (groups.empty() || groups.back() != row.scene.group) groups.push_back(row.scene.group);
  groups.emplace_back();
  std::vector<GeometricMean> means;
  for (const std::string& group : groups) {
    double speed = 0, efficiency = 0, count = 0;
    for (const BenchRow& row : rows) {
      if (!group.empty() && row.scene.group != group) continue;
      speed += std::log(row.speed_ratio());
      efficiency += std::log(row.efficiency_ratio());
      count += 1;
    }
    means.push_back({group, std::exp(speed / count), std::exp(efficiency / count)});
  }
  return means;
}

}  // namespace itn
