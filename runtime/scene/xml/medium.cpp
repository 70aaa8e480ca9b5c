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
  if (element.attribute("type") != "homogeneous") fail_type(element, {"homogeneous"});
  Properties properties = builder.properties(element);
  Medium medium;
  medium.id = element.id;
  medium.phase.id = element.id;
  medium.where = element.where;

  const Color sigma_t = properties.color("sigma_t", {{1, 1, 1}}, Quantity::unbounded);
  medium.sigma_t = sigma_t.value;
  medium.sigma_t_is_rgb = sigma_t.is_rgb;
  for (double v : medium.sigma_t)
    if (v < 0)
      properties.fail_at("sigma_t", "sigma_t = " + to_text(v) + " is negative; need 0 or more, per scene unit");

  const Color albedo = properties.color("albedo", {{0.75, 0.75, 0.75}});
  medium.albedo = albedo.value;
  medium.albedo_is_rgb = albedo.is_rgb;
  for (double v : medium.albedo)
    if (!(v >= 0 && v <= 1))
      properties.fail_at("albedo", "albedo = " + to_text(v) + " is outside [0, 1]; it is sigma_s / sigma_t");

  medium.scale = properties.number("scale", 1);
  if (medium.scale < 0)
    properties.fail_at("scale", "scale = " + to_text(medium.scale) + " is negative; need 0 or more");
  // Hints on how Mitsuba samples: they change no expected value.
  properties.boolean("sample_emitters", true);
  properties.boolean("has_spectral_extinction", true);

  if (const Element* phase = properties.object("phase")) build_phase(builder, *phase, medium);
  properties.finish();
  builder.scene.media.push_back(medium);
  return static_cast<int>(builder.scene.media.size()) - 1;
}

}  // namespace itn
