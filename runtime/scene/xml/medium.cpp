#include "runtime/scene/xml/builder.h"
#include "runtime/scene/xml/message.h"

namespace itn {

void read_phase(Builder& builder, const Element& element, Medium& medium) {
  Properties properties = builder.properties(element);
  const Model* model = find_model(phase_models(), properties.type());
  if (!model) fail_type(element, types_of(phase_models()));
  medium.phase.become(*model);
  medium.phase.id = element.id;
  medium.phase.where = element.where;
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
