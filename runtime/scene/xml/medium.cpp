#include <fmt/core.h>

#include <algorithm>

#include "kernels/model/phase/tabulated.h"
#include "runtime/scene/model/mixture.h"
#include "runtime/scene/model/sized_model.h"
#include "runtime/scene/xml/builder.h"
#include "runtime/scene/xml/message.h"
#include "runtime/scene/xml/plugins.h"
#include "runtime/scene/xml/values.h"

namespace itn {
namespace {

// Values of a tabphase, in one text.
void read_table(Properties& properties, PhaseFunction& phase) {
  const std::string text = properties.text("values");
  std::vector<double> values;
  std::size_t at = 0;
  while ((at = text.find_first_not_of(" ,\t\n\r", at)) != std::string::npos) {
    const std::size_t end = std::min(text.find_first_of(" ,\t\n\r", at), text.size());
    values.push_back(parse_number(text.substr(at, end - at), phase.where, "phase \"tabphase\": \"values\""));
    if (!(values.back() >= 0))
      properties.fail_at("values", fmt::format("values: {} is negative; need 0 or more", to_text(values.back())));
    at = end;
  }
  if (values.size() < 2 || values.size() > TABULATED_MOST)
    properties.fail_at("values", fmt::format("values: {} numbers; need 2 to {}, from backwards to straight on",
                                             values.size(), TABULATED_MOST));
  if (std::all_of(values.begin(), values.end(), [](double v) { return v == 0; }))
    properties.fail_at("values", "values: all are 0; need one above");
  phase.become(tabulated_model(values.size()));
  for (std::size_t i = 0; i < values.size(); ++i) phase.values[i].value.fill(values[i]);
}

// A blend of two or a dictionary of any number.
PhaseFunction read_mixture(Builder& builder, Properties& properties, Instance nest) {
  const bool blend = properties.type() == "blendphase";
  const std::vector<const Element*> found = properties.objects("phase");
  if (blend ? found.size() != 2 : found.empty())
    properties.fail_at("", fmt::format("{} nested <phase>; need {}", found.size(),
                                       blend ? "two, for weight 0 and weight 1" : "one for each weight"));
  if (blend) {
    nest.become(blend_phase_model());
    if (!properties.has("weight")) properties.number("weight");  // which says that it is missing
    nest.values[0] = read_number_volume(builder, properties, nest.model->parameters[0]);
  } else {
    read_weights(properties, "phase", found.size(), nest);
  }
  std::vector<PhaseFunction> inside;
  std::size_t parts = 0;
  for (const Element* element : found) {
    inside.push_back(build_phase(builder, *element));
    parts += parts_of(*inside.back().model);
  }
  if (parts > most_parts)
    properties.fail_at(
        "", fmt::format("{} phase functions are nested in it, each as often as it is met; the most is {}", parts,
                        most_parts));
  // A share of nested weights is their product, which no grid is.
  for (const PhaseFunction& phase : inside)
    if (phase.model->mixture && (nest.has_grid() || phase.values[0].is_grid()))
      properties.fail_at(
          "",
          "a weight that is a grid, and one mixture inside of another; need numbers for the weights of nested "
          "mixtures, or a blendphase of two phase functions that are none");
  return make_mixture(nest, inside);
}

}  // namespace

std::vector<std::string> phase_types() {
  std::vector<std::string> types = types_of(phase_models());
  types.insert(types.end(), {"tabphase", "blendphase", "dictionary"});
  return types;
}

namespace {}  // namespace

PhaseFunction read_phase(Builder& builder, const Element& element) {
  Properties properties = builder.properties(element);
  PhaseFunction phase;
  phase.id = element.id;
  phase.where = element.where;
  const std::string& type = properties.type();
  if (type == "tabphase") {
    read_table(properties, phase);
  } else if (type == "blendphase" || type == "dictionary") {
    phase = read_mixture(builder, properties, phase);
  } else {
    const Model* model = find_model(phase_models(), type);
    if (!model) fail_type(element, phase_types());
    phase.become(*model);
    read_parameters(builder, properties, phase);
  }
  properties.finish();
  return phase;
}

namespace {

// The pair of parameters that an element gives its medium by: extinction and albedo, unless it has another one.
const Model& given_by(Properties& properties, const Model& usual) {
  const Model* by = &usual;
  for (const Model& other : medium_inputs()) {
    if (other.type != usual.type || !properties.has(other.parameters[0].name)) continue;
    if (by != &usual)
      properties.fail_at(other.parameters[0].name, fmt::format("both {} and {} given; need one or the other",
                                                               by->parameters[0].name, other.parameters[0].name));
    by = &other;
  }
  const bool absorbs = properties.has("sigma_a");
  if (by == &usual) {
    if (absorbs)
      properties.fail_at("sigma_a", "sigma_a without sigma_s or sigma_s_prime; need both, or sigma_t and albedo");
    return usual;
  }
  const std::string& scattering = by->parameters[0].name;
  for (const char* other : {"sigma_t", "albedo"})
    if (properties.has(other))
      properties.fail_at(other, fmt::format("both {} and {} given; need sigma_t and albedo, or {} and sigma_a",
                                            scattering, other, scattering));
  if (!absorbs) properties.fail_at("", fmt::format("{} without sigma_a; need both", scattering));
  for (const std::string& coefficient : {scattering, std::string("sigma_a")})
    if (properties.is_object(coefficient) && !properties.is_spectrum(coefficient))
      properties.fail_at(
          coefficient, fmt::format("{} is the same everywhere; need a number or <rgb>: for a grid give the one it has "
                                   "in common with {} as \"density\", or grids of \"sigma_t\" and \"albedo\"",
                                   coefficient, coefficient == "sigma_a" ? scattering : "sigma_a"));
  return *by;
}

}  // namespace

int read_medium(Builder& builder, const Element& element) {
  Properties properties = builder.properties(element);
  const Model* model = find_model(medium_models(), properties.type());
  if (!model) fail_type(element, types_of(medium_models()));
  Medium medium;
  medium.become(given_by(properties, *model));
  medium.id = element.id;
  medium.phase.id = element.id;
  medium.where = element.where;
  read_parameters(builder, properties, medium);
  medium.sample_emitters = properties.boolean("sample_emitters", true);
  properties.boolean("has_spectral_extinction", true);  // how Mitsuba samples: changes no expected value
  if (const Element* phase = properties.object("phase")) medium.phase = build_phase(builder, *phase);
  if (medium.model->mean_cosine_slot() >= 0 && medium.phase.has_grid())
    properties.fail_at(
        "",
        "reduced scattering, and a phase function with a grid: its mean cosine differs from place to place; give "
        "sigma_s and sigma_a, or sigma_t and albedo");
  properties.finish();
  builder.scene.media.push_back(medium);
  return static_cast<int>(builder.scene.media.size()) - 1;
}

}  // namespace itn
