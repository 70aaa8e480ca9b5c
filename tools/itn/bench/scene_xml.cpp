#include "tools/itn/bench/scene_xml.h"

#include <fmt/format.h>

namespace itn {

std::string bench_scene_xml(const char* integrator, int max_depth, int rr_depth, double fov, const char* lookat,
                            const std::string& body) {
  return fmt::format(R"(<scene version="3.0.0">
  <integrator type="{}">
    <integer name="max_depth" value="{}"/>
    <integer name="rr_depth" value="{}"/>
  </integrator>
  <sensor type="perspective">
    <float name="fov" value="{}"/>
    <transform name="to_world">
      <lookat {} up="0, 0, 1"/>
    </transform>
    <film type="hdrfilm">
      <integer name="width" value="128"/>
      <integer name="height" value="128"/>
      <rfilter type="box"/>
    </film>
    <sampler type="independent">
      <integer name="sample_count" value="64"/>
    </sampler>
  </sensor>
{}</scene>
)",
                     integrator, max_depth, rr_depth, fov, lookat, body);
}

std::string bench_sunsky_xml(double aperture) {
  return fmt::format(R"(  <emitter type="sunsky">
    <vector name="sun_direction" value="-0.4, -0.3, 0.866"/>
    <float name="sun_aperture" value="{}"/>
  </emitter>
)",
                     aperture);
}

std::string bench_constant_xml() {
  return R"(  <emitter type="constant">
    <rgb name="radiance" value="1, 1, 1"/>
  </emitter>
)";
}

std::string bench_rough_xml(const char* distribution, double alpha, double ior) {
  return fmt::format(R"(    <bsdf type="roughdielectric">
      <string name="distribution" value="{}"/>
      <float name="alpha" value="{}"/>
      <float name="int_ior" value="{}"/>
      <float name="ext_ior" value="1"/>
    </bsdf>
)",
                     distribution, alpha, ior);
}

}  // namespace itn
