#include "itn/scene.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "runtime/scene/model/phase_formula.h"

namespace itn {

void Texture::become(const TextureModel& of) {
  model = &of;
  colours.clear();
  for (const DeclaredColour& c : of.colours) colours.push_back({c.fallback, c.fallback, c.fallback});
}

const MeshAttribute* Mesh::attribute(const std::string& name) const {
  const auto found =
      std::find_if(attributes.begin(), attributes.end(), [&](const MeshAttribute& a) { return a.name == name; });
  return found == attributes.end() ? nullptr : &*found;
}

Texture make_bitmap(std::shared_ptr<const Bitmap> bitmap) {
  Texture texture;
  texture.become(*find_texture("bitmap"));
  texture.bitmap = std::move(bitmap);
  return texture;
}

void Instance::become(const Model& of, int its_variant) {
  model = &of;
  variant = its_variant;
  values.clear();
  for (const DeclaredParameter& p : of.parameters) {
    Texture value;
    value.value = {p.fallback, p.fallback, p.fallback};
    values.push_back(value);
  }
}

Texture& Instance::value(const std::string& name) {
  const auto index = static_cast<std::size_t>(&model->parameter(name) - model->parameters.data());
  return values.at(index);
}

const Texture& Instance::value(const std::string& name) const {
  const auto index = static_cast<std::size_t>(&model->parameter(name) - model->parameters.data());
  return values.at(index);
}

std::vector<std::size_t> Instance::values_called(const std::string& owner_id, const std::string& name) const {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (owner(i) == owner_id && model->parameters[i].shown() == name) found.push_back(i);
  return found;
}

std::vector<double> Instance::slots() const {
  std::vector<double> result;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto channels = static_cast<std::ptrdiff_t>(model->parameters[i].kind.channels);
    result.insert(result.end(), values[i].value.begin(), values[i].value.begin() + channels);
  }
  return result;
}

Instance Instance::showing(std::size_t parameter, std::size_t colour) const {
  Instance result = *this;
  Texture constant;
  constant.value = values.at(parameter).colours.at(colour);
  result.values[parameter] = constant;
  return result;
}

bool Instance::has_grid() const {
  return std::any_of(values.begin(), values.end(), [](const Texture& value) { return value.is_grid(); });
}

Bsdf make_bsdf(const std::string& type, const std::string& distribution) {
  Bsdf bsdf;
  if (type == "null") return bsdf;
  const Model* model = find_model(bsdf_models(), type);
  if (!model) throw std::logic_error("no BSDF " + type);
  const auto& variants = model->variants;
  const auto found = std::find(variants.begin(), variants.end(), distribution);
  bsdf.become(*model, found == variants.end() ? 0 : static_cast<int>(found - variants.begin()));
  return bsdf;
}

bool Medium::has_grid() const { return Instance::has_grid() || phase.has_grid(); }

std::vector<double> Medium::slots() const {
  std::vector<double> result = Instance::slots();
  if (const int slot = model->mean_cosine_slot(); slot >= 0)
    result[static_cast<std::size_t>(slot)] = mean_cosine(*phase.model, phase.slots())[0];
  return result;
}

Environment::Environment() { become(*find_model(environment_models(), "constant")); }

Environment make_environment(const std::string& type) {
  const Model* model = find_model(environment_models(), type);
  if (!model) throw std::logic_error("no environment " + type);
  Environment environment;
  environment.become(*model);
  return environment;
}

Medium::Medium() {
  become(*find_model(medium_models(), "homogeneous"));
  phase.become(*find_model(phase_models(), "isotropic"));
}

}  // namespace itn
