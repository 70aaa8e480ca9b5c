#include <algorithm>
#include <map>

#include "runtime/scene/xml/builder.h"
#include "runtime/scene/xml/message.h"

namespace itn {
namespace {

// Mitsuba's integrators of radiance: all select this renderer, and differ here in what they say about depth.
enum class Depth { unlimited, six, direct };  // without max_depth; `direct` has none

const std::map<std::string, Depth> of_radiance = {
    {"path", Depth::unlimited},       {"volpath", Depth::unlimited},
    {"volpathmis", Depth::unlimited}, {"ptracer", Depth::unlimited},
    {"direct", Depth::direct},        {"prb", Depth::six},
    {"prb_basic", Depth::six},        {"prb_projective", Depth::six},
    {"prbvolpath", Depth::six},       {"direct_projective", Depth::direct},
};

// These compute something else, of which this renderer knows nothing, and may contain integrators of radiance.
const std::vector<std::string> of_something_else = {"aov", "depth", "moment", "stokes"};

// The number of sampled directions changes no expected value, unless it is 0.
void parse_samples(Builder& builder, Properties& properties) {
  const long usual = properties.integer("shading_samples", 1);
  const long of_emitters = properties.integer("emitter_samples", usual);
  const long of_bsdfs = properties.integer("bsdf_samples", usual);
  if (std::min(of_emitters, of_bsdfs) < 0 || of_emitters + of_bsdfs == 0)
    properties.fail_at(properties.has("emitter_samples") ? "emitter_samples" : "shading_samples",
                       "\"emitter_samples\" = " + std::to_string(of_emitters) + " and \"bsdf_samples\" = " +
                           std::to_string(of_bsdfs) + "; need 0 or more, and more than 0 of one");
  builder.samples_emitters = of_emitters > 0;
  if (of_bsdfs == 0)
    builder.warn(
        properties.element().where,
        properties.title() + ": bsdf_samples 0 is taken as 1: in Mitsuba smooth surfaces would reflect nothing");
}

void parse_depth(Builder& builder, Properties& properties, Depth depth, Integrator& integrator) {
  if (depth == Depth::direct) {
    integrator.max_depth = 2;
    return parse_samples(builder, properties);
  }
  const long max_depth = properties.integer("max_depth", depth == Depth::six ? 6 : -1);
  const long rr_depth = properties.integer("rr_depth", 5);
  if (max_depth < -1)
    properties.fail_at("max_depth", "\"max_depth\" = " + std::to_string(max_depth) + "; need -1 (no limit), 0 or more");
  if (rr_depth < 1) properties.fail_at("rr_depth", "\"rr_depth\" = " + std::to_string(rr_depth) + "; need 1 or more");
  constexpr long deepest = 1'000'000;  // no path gets there: as good as no limit
  // Mitsuba's prb, prb_basic and prb_projective render emitters with max_depth 0, too; its other integrators render
  // black.
  const bool shows_emitters = properties.type().rfind("prb", 0) == 0 && properties.type() != "prbvolpath";
  integrator.max_depth = max_depth > deepest ? -1 : max_depth == 0 && shows_emitters ? 1 : static_cast<int>(max_depth);
  integrator.rr_depth = static_cast<int>(std::min(rr_depth, deepest));
}

// Reads and ignores settings that divide Mitsuba's work or change its sampling: they change no expected value.
void skip_hints(Properties& properties) {
  properties.number("timeout", -1);
  properties.integer("block_size", 0);
  properties.integer("samples_per_pass", -1);
  if (properties.type() == "volpathmis") properties.boolean("use_spectral_mis", true);
  if (properties.type().find("_projective") == std::string::npos) return;
  for (const char* name : {"sppc", "sppp", "sppi", "guiding_rounds"}) properties.integer(name, 1);
  properties.boolean("guiding_proj", true);
  for (const char* name : {"guiding", "project_seed"}) properties.text(name, "");
}

void make_something_else(Builder& builder, Properties& properties) {
  if (properties.type() == "aov") properties.text("aovs");
  const std::vector<const Element*> nested = properties.objects("integrator");
  builder.warn(properties.element().where,
               properties.title() + " computes something else than radiance: " +
                   (nested.empty() ? "radiance is rendered instead"
                                   : "only its nested " + quote(nested[0]->attribute("type")) + " is rendered"));
  for (const Element* element : nested) {
    const Integrator first = builder.scene.integrator;
    build_integrator(builder, *element);
    if (element != nested[0]) builder.scene.integrator = first;
  }
}

}  // namespace

void read_integrator(Builder& builder, const Element& element) {
  Properties properties = builder.properties(element);
  Integrator& integrator = builder.scene.integrator;
  integrator.hide_emitters = properties.boolean("hide_emitters", false);
  skip_hints(properties);
  const auto depth = of_radiance.find(properties.type());
  const bool is_else =
      std::find(of_something_else.begin(), of_something_else.end(), properties.type()) != of_something_else.end();
  if (depth != of_radiance.end()) {
    parse_depth(builder, properties, depth->second, integrator);
  } else if (is_else) {
    make_something_else(builder, properties);
  } else {
    std::vector<std::string> types = of_something_else;
    for (const auto& [type, unused] : of_radiance) types.push_back(type);
    fail_type(element, types);
  }
  properties.finish();
}

}  // namespace itn
