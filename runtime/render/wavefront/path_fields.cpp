#include "runtime/render/wavefront/path_fields.h"

#include "kernels/shared/path_state.h"

namespace itn {

PathFields path_fields(const std::map<std::string, std::string>& definitions) {
  const auto number = [&](const char* name) { return static_cast<std::size_t>(std::stoi(definitions.at(name))); };
  const std::size_t THROUGHPUT_CHANNELS = number("THROUGHPUT_CHANNELS"),
                    RADIANCE_CHANNELS = number("RADIANCE_CHANNELS"), DERIVATIVES = number("DERIVATIVES"),
                    ALBEDOS = number("ALBEDOS"), SCORES = number("SCORES"), BASELINES = number("BASELINES"),
                    ADJOINT = number("ADJOINT"), VOXEL_SUMS = number("VOXEL_SUMS"), SPECTRAL = number("SPECTRAL"),
                    LIGHT_SAMPLING = number("LIGHT_SAMPLING"), MEDIUM_LIGHT_SAMPLING = number("MEDIUM_LIGHT_SAMPLING"),
                    ROUGH_LIGHT_SAMPLING = number("ROUGH_LIGHT_SAMPLING"), HAS_AREA_LIGHTS = number("HAS_AREA_LIGHTS"),
                    HAS_AIMED_SHAPES = number("HAS_AIMED_SHAPES");
  PathFields fields;
#define ITN_FIELD(name, count)       \
  fields.first[#name] = fields.size; \
  fields.size += (count);
  PATH_STATE(ITN_FIELD)
  return fields;
}

}  // namespace itn
