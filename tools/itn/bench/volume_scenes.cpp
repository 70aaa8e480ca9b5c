// Grids of voxels, which Mitsuba renders with `volpath`: a cloud and a plume of smoke, behind index-matched and rough
// boundaries.
#include <fmt/format.h>

#include "itn/file.h"
#include "tools/itn/bench/objects.h"
#include "tools/itn/bench/scene_xml.h"
#include "tools/itn/bench/scenes.h"

namespace itn {
namespace {

// A cube from -1 to 1 that the grid fills.
std::string volume_xml(const std::string& grid, double scale, double albedo, const std::string& bsdf) {
  return fmt::format(R"(  <shape type="cube">
{}    <medium type="heterogeneous" name="interior" id="material">
      <volume type="gridvolume" name="sigma_t">
        <string name="filename" value="{}.vol"/>
        <transform name="to_world">
          <translate x="-0.5" y="-0.5" z="-0.5"/>
          <scale value="2"/>
        </transform>
      </volume>
      <float name="albedo" value="{}"/>
      <float name="scale" value="{}"/>
      <phase type="hg">
        <float name="g" value="0.5"/>
      </phase>
    </medium>
  </shape>
)",
                     bsdf, grid, albedo, scale);
}

}  // namespace

std::vector<BenchScene> write_volume_scenes(const std::string& folder) {
  write_cloud(folder + "/cloud.vol");
  write_plume(folder + "/plume.vol");

  constexpr const char* view = R"(origin="0, -5.2, 1.2" target="0, 0, 0")";
  const std::string matched = "    <bsdf type=\"null\"/>\n", rough = bench_rough_xml("ggx", 0.2, 1.33);
  struct Case {
    const char* grid;
    double scale, albedo;
    bool rough;
  };
  std::vector<BenchScene> scenes;
  for (const bool sunny : {false, true})
    for (const Case& c : {Case{"cloud", 4, .6, false},
                          {"cloud", 40, 1, false},
                          {"plume", 4, .9, false},
                          {"plume", 60, .95, false},
                          {"cloud", 10, .9, true},
                          {"plume", 30, .8, true}}) {
      const char* light = sunny ? "sunsky" : "constant";
      const std::string file = fmt::format("{}/{:02}.xml", folder, scenes.size());
      write_file(file, bench_scene_xml("volpath", 256, 5, 36, view,
                                       (sunny ? bench_sunsky_xml(0.5358) : bench_constant_xml()) +
                                           volume_xml(c.grid, c.scale, c.albedo, c.rough ? rough : matched)));
      scenes.push_back({fmt::format("{} {} {} {} {}", c.grid, light, c.rough ? "rough" : "matched", c.scale, c.albedo),
                        fmt::format("{}, {}", c.rough ? "rough boundary" : "index-matched", light), file,
                        "material.sigma_t"});
    }
  return scenes;
}

}  // namespace itn
