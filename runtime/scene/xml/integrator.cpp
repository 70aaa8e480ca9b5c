#include <algorithm>

#include "runtime/scene/xml/builder.h"

namespace itn {

void build_integrator(Builder& builder, const Element& element) {
  Properties properties = builder.properties(element);
  const std::vector<std::string> types = {"volpath", "volpathmis", "path", "prbvolpath"};
  if (std::find(types.begin(), types.end(), properties.type()) == types.end()) fail_type(element, types);
  Integrator& integrator = builder.scene.integrator;
  const long max_depth = properties.integer("max_depth", -1), rr_depth = properties.integer("rr_depth", 5);
  if (max_depth < -1 || max_depth > 1'000'000)
    properties.fail_at("max_depth",
                       "\"max_depth\" = " + std::to_string(max_depth) + "; need -1 (no limit) or 0 to 1000000");
  if (rr_depth < 1 || rr_depth > 1'000'000)
    properties.fail_at("rr_depth", "\"rr_depth\" = " + std::to_string(rr_depth) + "; need 1 to 1000000");
  integrator.max_depth = static_cast<int>(max_depth);
  integrator.rr_depth = static_cast<int>(rr_depth);
  integrator.hide_emitters = properties.boolean("hide_emitters", false);
  // How Mitsuba samples: changes no expected value.
  if (properties.type() == "volpathmis") properties.boolean("use_spectral_mis", true);
  properties.finish();
}

}  // namespace itn
