#include "network/prediction/material_renderer.h"

#include <fmt/format.h>

#include <algorithm>

#include "runtime/base/error.h"

namespace itn {
namespace {

// The scene's numbers that an output of the network stands for: one, or a colour's three.
std::vector<Parameter> numbers_of(const Scene& scene, int medium, const OutputRange& output, const std::string& who) {
  std::vector<Parameter> found;
  for (const Parameter& p : list_parameters(scene)) {
    const bool of_medium = p.owner == Owner::medium || p.owner == Owner::phase;
    if (of_medium && p.member == output.name && p.belongs_to(medium) && !p.has_values()) found.push_back(p);
  }
  const bool one = std::all_of(found.begin(), found.end(), [&](const Parameter& p) { return p.id == found[0].id; });
  if (found.empty() || !one)
    throw UsageError(fmt::format("{}: the network knows media with one {}, and the scene's has {}", who, output.name,
                                 found.empty() ? "none" : "several"));
  return found;
}

}  // namespace

MaterialRenderer::MaterialRenderer(const NetworkDescription& network, const SceneToShow& shown, const Device& device,
                                   RenderOptions options)
    : outputs_(network.outputs), scene_(shown.scene) {
  film_for_network(scene_, shown.sensor, network.size, shown.who);
  scene_.sensors[static_cast<std::size_t>(shown.sensor)].luminance = true;
  options.sensor = shown.sensor;
  options.derivatives.clear();
  for (const OutputRange& output : outputs_) {
    numbers_.push_back(numbers_of(scene_, shown.medium, output, shown.who));
    for (const Parameter& number : numbers_.back()) options.derivatives.push_back(number.name);
  }
  sigma_t_unit_ = sigma_t_unit(scene_, shown.medium, network, shown.body);
  const auto count = static_cast<Eigen::Index>(outputs_.size());
  renderer_ = std::make_unique<Renderer>(device, at(Eigen::VectorXd::Constant(count, 0.5)), options);
}

MaterialImages MaterialRenderer::render(const Eigen::VectorXd& shares, int first_sample, int samples) {
  constexpr double small = 1e-4;
  renderer_->replace(at(shares));
  MaterialImages result{renderer_->render(first_sample, samples), {}};
  const auto pixels = static_cast<Eigen::Index>(result.image.mean.size());
  result.by_shares = ImageRows::Zero(shares.size(), pixels);
  std::size_t next = 0;
  for (std::size_t i = 0; i < outputs_.size(); ++i) {
    const double share = shares[static_cast<Eigen::Index>(i)];
    const double slope = (value(i, share + small) - value(i, share - small)) / (2 * small);
    for (std::size_t n = 0; n < numbers_[i].size(); ++n)
      result.by_shares.row(static_cast<Eigen::Index>(i)) +=
          static_cast<float>(slope) *
          Eigen::Map<const Eigen::RowVectorXf>(result.image.derivatives[next++].mean.data(), pixels);
  }
  return result;
}

double MaterialRenderer::value(std::size_t output, double share) const {
  return (outputs_[output].name == "sigma_t" ? sigma_t_unit_ : 1) * outputs_[output].parameter_of_share(share);
}

const Scene& MaterialRenderer::at(const Eigen::VectorXd& shares) {
  for (std::size_t i = 0; i < outputs_.size(); ++i)
    for (const Parameter& number : numbers_[i])
      set_parameter(scene_, number, value(i, shares[static_cast<Eigen::Index>(i)]));
  return scene_;
}

}  // namespace itn
