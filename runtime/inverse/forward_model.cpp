#include "runtime/inverse/forward_model.h"

#include "runtime/inverse/image_loss.h"

namespace itn {

ForwardModel::ForwardModel(const Device& device, const Scene& scene, const std::vector<std::string>& parameters,
                           const std::vector<int>& sensors, const RenderOptions& options)
    : scene_(scene) {
  const std::vector<Parameter> all = list_parameters(scene);
  for (const std::string& name : parameters) coordinates_.emplace_back(find_parameter(all, name));
  for (std::size_t i = 0; i < sensors.size(); ++i) {
    RenderOptions of_image = options;
    of_image.sensor = sensors[i];
    of_image.seed = options.seed + i;
    of_image.derivatives = parameters;
    renderers_.push_back(std::make_unique<Renderer>(device, scene, of_image));
  }
}

std::vector<double> ForwardModel::start() const {
  std::vector<double> x;
  for (const Coordinate& c : coordinates_) x.push_back(c.of(c.parameter().value));
  return x;
}

void ForwardModel::set_values(const std::vector<double>& values) {
  if (values == values_) return;
  values_.clear();
  for (std::size_t p = 0; p < coordinates_.size(); ++p) set_parameter(scene_, coordinates_[p].parameter(), values[p]);
  for (const auto& renderer : renderers_) renderer->replace(scene_);
  values_ = values;
}

void ForwardModel::set(const std::vector<double>& x) {
  std::vector<double> values;
  for (std::size_t p = 0; p < coordinates_.size(); ++p) values.push_back(coordinates_[p].value(x[p]));
  set_values(values);
}

std::vector<Rendering> ForwardModel::render_values(const std::vector<double>& values, int first, int spp) {
  set_values(values);
  std::vector<Rendering> images;
  for (const auto& renderer : renderers_) images.push_back(renderer->render(first, spp));
  return images;
}

std::vector<Rendering> ForwardModel::render(const std::vector<double>& x, int first, int spp) {
  set(x);
  std::vector<Rendering> images;
  for (const auto& renderer : renderers_) images.push_back(renderer->render(first, spp));
  return images;
}

std::vector<std::vector<Rendering>> ForwardModel::render_groups(const std::vector<double>& x, int first, int spp) {
  set(x);
  std::vector<std::vector<Rendering>> images;
  for (const auto& renderer : renderers_) {
    std::vector<Rendering>& groups = images.emplace_back();
    int sample = first;
    for (const int samples : split_samples(spp)) {
      groups.push_back(renderer->render(sample, samples));
      sample += samples;
    }
  }
  return images;
}

}  // namespace itn
