#include "runtime/scene/xml/plugins.h"

#include "itn/model.h"
#include "runtime/scene/xml/builder.h"

namespace itn {

std::vector<PluginFamily> plugin_families() {
  std::vector<std::string> emitters = types_of(environment_models());
  for (const std::string& type : types_of(light_models())) emitters.push_back(type);
  return {{"integrator", integrator_types()},
          {"sensor", sensor_types()},
          {"film", film_types()},
          {"rfilter", filter_types()},
          {"sampler", sampler_types()},
          {"shape", shape_types()},
          {"emitter", emitters},
          {"medium", types_of(medium_models())},
          {"phase", phase_types()},
          {"volume", volume_types()},
          {"texture", texture_types()},
          {"spectrum", spectrum_types()},
          {"bsdf", bsdf_types()}};
}

}  // namespace itn
