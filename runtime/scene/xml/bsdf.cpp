#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "kernels/model/obstacle.h"
#include "kernels/shared/declaration.h"
#include "runtime/scene/model/structure.h"
#include "runtime/scene/xml/builder.h"
#include "runtime/scene/xml/message.h"
#include "runtime/scene/xml/values.h"

namespace itn {
namespace {

std::vector<std::string> bsdf_types() {
  std::vector<std::string> types = types_of(bsdf_models());
  types.insert(types.begin(), "null");
  for (const Model& nest : nest_models()) types.push_back(nest.type);
  return types;
}

// Types of BSDFs that light does not pass.
std::vector<std::string> opaque_types() {
  std::vector<std::string> types;
  for (const Model& model : bsdf_models())
    if (!(model.traits & BSDF_TRANSMITS) && &model == find_model(bsdf_models(), model.type))
      types.push_back(quote(model.type));
  return types;
}

// Number of BSDFs that a nest contains.
struct Inside {
  std::size_t least, most;
  const char* words;
};
Inside inside_of(const Model& nest) {
  if (nest.type == "blendbsdf") return {2, 2, "two nested <bsdf>, for weight 0 and weight 1"};
  if (nest.type == "dictionary") return {1, most_leaves, "a nested <bsdf> for each weight, at most 64"};
  if (nest.type == "twosided") return {1, 2, "a nested <bsdf type=\"diffuse\"> for both sides, or one for each"};
  return {1, 1, "one nested <bsdf>"};
}

std::vector<const Element*> elements_inside(Properties& properties, const Model& nest) {
  std::vector<const Element*> found = properties.objects("bsdf");
  const Inside need = inside_of(nest);
  if (found.empty()) properties.fail_at("", fmt::format("it is empty; need {}", need.words));
  if (found.size() < need.least || found.size() > need.most)
    properties.fail_at("", fmt::format("{} nested <bsdf>; need {}", found.size(), need.words));
  return found;
}

// The BSDF of a <bsdf> element, or a stand-in for one that could not be read.
struct Inner {
  const Element* element = nullptr;
  int index = 0;
  Bsdf bsdf;
  bool failed() const { return !bsdf.model && element->attribute("type") != "null"; }
};

// Is it of a type that is opaque unless it is told to let light pass?
bool passes_when_asked(const Inner& inner) {
  const Model* first = find_model(bsdf_models(), inner.element->attribute("type"));
  return first && !(first->traits & BSDF_TRANSMITS);
}

// Two sides of one surface, or one each.
void check_opaque(const std::vector<Inner>& inside) {
  for (const Inner& inner : inside)
    if (!inner.failed() && (!inner.bsdf.model || (inner.bsdf.model->traits & (BSDF_TRANSMITS | BSDF_PASSES))))
      fail(inner.element->where,
           fmt::format("bsdf \"twosided\" around {}{}; need {}, or a nest of them: masks belong around twosided",
                       quote(inner.element->attribute("type")), passes_when_asked(inner) ? " with spec_trans" : "",
                       fmt::join(opaque_types(), " or ")));
}

Bsdf build_nest(Builder& builder, Properties& properties, const Element& element, const Model& model) {
  const bool twosided = model.type == "twosided";
  std::vector<Inner> inside;
  bool failed = false;
  for (const Element* inner : elements_inside(properties, model)) {
    const int index = build_bsdf(builder, *inner);
    inside.push_back({inner, index, builder.scene.bsdfs[static_cast<std::size_t>(index)]});
    failed |= inside.back().failed();
  }
  Instance nest;
  nest.id = element.id;
  nest.where = element.where;
  if (model.type == "dictionary") {
    read_weights(properties, "bsdf", inside.size(), nest);
  } else {
    nest.become(model);
    read_parameters(builder, properties, nest);
  }
  if (twosided && properties.boolean("allow_transmission", false))
    properties.fail_at("allow_transmission", "what lets light pass has two sides by itself; need false");
  properties.finish();
  if (twosided) check_opaque(inside);
  if (failed) return {};
  const Bsdf& first = inside[0].bsdf;
  if (twosided && inside.size() == 1 && !first.twosided && !first.model->structure) {
    builder.twosided_of[inside[0].index] = &element;
    Bsdf bsdf = first;  // keeps the id of the one inside
    bsdf.twosided = true;
    return bsdf;
  }
  std::vector<Bsdf> bsdfs;
  for (const Inner& inner : inside) {
    builder.nested.insert(inner.index);
    bsdfs.push_back(inner.bsdf);
  }
  if (const std::string why = refusal_of_nest(model, bsdfs); !why.empty()) properties.fail_at("", why);
  return make_nest(nest, bsdfs);
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

// Among the models that share a type, the one that the parameters mean. of: the first
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
  if (const Model* nest = find_model(nest_models(), properties.type())) {
    bsdf = build_nest(builder, properties, element, *nest);
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
