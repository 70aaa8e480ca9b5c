#include <fmt/format.h>

#include <algorithm>

#include "kernels/shared/declaration.h"
#include "runtime/scene/xml/builder.h"
#include "runtime/scene/xml/message.h"

namespace itn {
namespace {

std::vector<std::string> bsdf_types() {
  std::vector<std::string> types = types_of(bsdf_models());
  types.insert(types.begin(), "null");
  types.emplace_back("twosided");
  return types;
}

// What light does not pass.
std::vector<std::string> opaque_types() {
  std::vector<std::string> types;
  for (const Model& model : bsdf_models())
    if (!(model.traits & BSDF_TRANSMITS) && &model == find_model(bsdf_models(), model.type))
      types.push_back(quote(model.type));
  return types;
}

// The BSDF inside, for both sides of its surface.
Bsdf build_twosided(Builder& builder, Properties& properties, const Element& element) {
  const Element* inner = properties.object("bsdf");
  properties.finish();
  if (!inner) fail(element.where, "bsdf \"twosided\" is empty; need a nested <bsdf type=\"diffuse\">");
  const Model* model = find_model(bsdf_models(), inner->attribute("type"));
  if (!model || (model->traits & BSDF_TRANSMITS))
    fail(inner->where, fmt::format("bsdf \"twosided\" around {}; need {}", quote(inner->attribute("type")),
                                   fmt::join(opaque_types(), " or ")));
  Bsdf bsdf = builder.scene.bsdfs[static_cast<std::size_t>(build_bsdf(builder, *inner))];
  if (bsdf.model && (bsdf.model->traits & BSDF_TRANSMITS))
    fail(inner->where, fmt::format("bsdf \"twosided\" around {} with spec_trans, which light passes; need spec_trans 0",
                                   quote(bsdf.type())));
  bsdf.twosided = true;
  return bsdf;
}

// Are there two alphas, and are they not one and the same number? What else may be wrong with them is found by reading.
bool is_anisotropic(Properties& properties) {
  if (!properties.has("alpha_u") || !properties.has("alpha_v") || properties.has("alpha")) return false;
  const auto is_number = [&](const char* name) { return !properties.is_object(name) || properties.is_spectrum(name); };
  return !is_number("alpha_u") || !is_number("alpha_v") || properties.number("alpha_u") != properties.number("alpha_v");
}

// Mitsuba's principled surfaces are boundaries where spec_trans is given and is no 0.
bool passes_light(Properties& properties) {
  if (!properties.has("spec_trans")) return false;
  return (properties.is_object("spec_trans") && !properties.is_spectrum("spec_trans")) ||
         properties.number("spec_trans") != 0;
}

// Of the models that share a type, the one that the parameters mean. of: the first
const Model& meant_model(Properties& properties, const Model& of) {
  const Model* other = find_of_type(of, BSDF_ANISOTROPIC);
  if (other && is_anisotropic(properties)) return *other;
  other = of.traits & BSDF_TRANSMITS ? nullptr : find_of_type(of, BSDF_TRANSMITS);
  return other && passes_light(properties) ? *other : of;
}

// of: the first of its type
Bsdf build_model(Builder& builder, Properties& properties, const Model& of) {
  const Model& model = meant_model(properties, of);
  Bsdf bsdf;
  bsdf.become(model);
  read_parameters(builder, properties, bsdf);
  const std::vector<double> slots = bsdf.slots();
  if (const Refusal r = model.refusal(slots.data()); *r.parameter)
    properties.fail_at(r.parameter, fmt::format("{} {} {}; {}", r.parameter, r.what, to_text(r.value), r.need));
  if (model.variants.size() > 1) {
    const std::string distribution = properties.choice("distribution", model.variants);
    const auto found = std::find(model.variants.begin(), model.variants.end(), distribution);
    bsdf.variant = static_cast<int>(found - model.variants.begin());
    properties.boolean("sample_visible", true);  // how Mitsuba samples: changes no expected value
  }
  properties.finish();
  return bsdf;
}

}  // namespace

int read_bsdf(Builder& builder, const Element& element) {
  Properties properties = builder.properties(element);
  Bsdf bsdf;
  if (properties.type() == "twosided") {
    bsdf = build_twosided(builder, properties, element);  // keeps the id of the one inside
  } else {
    const Model* model = find_model(bsdf_models(), properties.type());
    if (!model && properties.type() != "null") fail_type(element, bsdf_types());
    if (model)
      bsdf = build_model(builder, properties, *model);
    else
      properties.finish();
    bsdf.id = element.id;
    bsdf.where = element.where;
  }
  builder.scene.bsdfs.push_back(bsdf);
  return static_cast<int>(builder.scene.bsdfs.size()) - 1;
}

}  // namespace itn
