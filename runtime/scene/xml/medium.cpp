#include <fmt/core.h>

#include <algorithm>

#include "kernels/model/models.h"
#include "runtime/scene/xml/builder.h"
#include "runtime/scene/xml/message.h"
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

}  // namespace

void read_phase(Builder& builder, const Element& element, Medium& medium) {
  Properties properties = builder.properties(element);
  const Model* model = find_model(phase_models(), properties.type());
  if (!model) fail_type(element, types_of(phase_models()));
  medium.phase.become(*model);
  medium.phase.id = element.id;
  medium.phase.where = element.where;
  if (model->id == MODEL_tabulated)
    read_table(properties, medium.phase);
  else
    read_parameters(builder, properties, medium.phase);
  properties.finish();
}

int read_medium(Builder& builder, const Element& element) {
  Properties properties = builder.properties(element);
  const Model* model = find_model(medium_models(), properties.type());
  if (!model) fail_type(element, types_of(medium_models()));
  Medium medium;
  medium.become(*model);
  medium.id = element.id;
  medium.phase.id = element.id;
  medium.where = element.where;
  read_parameters(builder, properties, medium);
  // Hints on how Mitsuba samples: they change no expected value.
  properties.boolean("sample_emitters", true);
  properties.boolean("has_spectral_extinction", true);
  if (const Element* phase = properties.object("phase")) build_phase(builder, *phase, medium);
  properties.finish();
  builder.scene.media.push_back(medium);
  return static_cast<int>(builder.scene.media.size()) - 1;
}

}  // namespace itn
