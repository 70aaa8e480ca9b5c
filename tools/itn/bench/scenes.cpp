#include "tools/itn/bench/scenes.h"

#include <fmt/format.h>

#include "itn/file.h"
#include "tools/itn/bench/objects.h"
#include "tools/itn/bench/scene_xml.h"

namespace itn {
namespace {

std::string medium_xml(double sigma_t, const std::string& albedo, double g) {
  return fmt::format(R"(    <medium type="homogeneous" name="interior" id="material">
      <float name="sigma_t" value="{}"/>
      {}
      <phase type="hg">
        <float name="g" value="{}"/>
      </phase>
    </medium>
)",
                     sigma_t, albedo, g);
}

std::string object_xml(const char* mesh, const std::string& bsdf, const std::string& medium) {
  return fmt::format(R"(  <shape type="ply">
    <string name="filename" value="{}"/>
{}{}  </shape>
)",
                     mesh, bsdf, medium);
}

std::string scalar_albedo(double albedo) { return fmt::format(R"(<float name="albedo" value="{}"/>)", albedo); }

constexpr const char* floor_xml = R"(  <shape type="rectangle">
    <transform name="to_world">
      <scale x="8" y="8"/>
    </transform>
    <bsdf type="diffuse">
      <texture type="bitmap" name="reflectance">
        <string name="filename" value="tiles.exr"/>
        <transform name="to_uv">
          <scale value="3"/>
        </transform>
      </texture>
    </bsdf>
  </shape>
)";

}  // namespace

std::vector<BenchScene> write_media_scenes(const std::string& folder) {
  write_knot(folder + "/knot.ply");
  write_star(folder + "/star.ply");
  write_tiles(folder + "/tiles.exr", 128);

  std::vector<BenchScene> scenes;
  const auto add = [&](const std::string& group, const std::string& name, const std::string& xml) {
    const std::string file = fmt::format("{}/{:02}.xml", folder, scenes.size());
    write_file(file, xml);
    scenes.push_back({name, group, file, ""});
  };

  constexpr const char* knot_view = R"(origin="0, -4.2, 2.4" target="0, 0, 0")";
  struct Material {
    double sigma_t, albedo, g;
  };
  for (const bool sunny : {false, true})
    for (const auto& [sigma_t, albedo, g] : {Material{25, .6, .5}, {25, .95, .5}, {100, .9, .5}, {300, .95, .8}})
      add(sunny ? "knot, sunsky" : "knot, constant",
          fmt::format("knot {} {} {} {}", sunny ? "sunsky" : "constant", sigma_t, albedo, g),
          bench_scene_xml("volpath", 256, 5, 36, knot_view,
                          (sunny ? bench_sunsky_xml(0.5358) : bench_constant_xml()) +
                              object_xml("knot.ply", bench_rough_xml("ggx", 0.2, 1.5),
                                         medium_xml(sigma_t, scalar_albedo(albedo), g))));

  // Narrow view from 45 degrees above, as in the paper's data.
  constexpr const char* floor_view = R"(origin="0, -24, 24.35" target="0, 0, 0.35")";
  for (const auto& [sigma_t, albedo, g] : {Material{30, .39, .2}, {100, .87, .4}, {276, .95, .8}})
    add("star on a floor, index-matched", fmt::format("star matched {} {} {}", sigma_t, albedo, g),
        bench_scene_xml(
            "volpath", 256, 20, 2.5, floor_view,
            bench_sunsky_xml(30) + floor_xml +
                object_xml("star.ply", "    <bsdf type=\"null\"/>\n", medium_xml(sigma_t, scalar_albedo(albedo), g))));
  add("star on a floor, rough", "star rough 100 RGB .5",
      bench_scene_xml("volpath", 256, 20, 2.5, floor_view,
                      bench_sunsky_xml(8) + floor_xml +
                          object_xml("star.ply", bench_rough_xml("beckmann", 0.25, 1.33),
                                     medium_xml(100, R"(<rgb name="albedo" value="0.97, 0.9, 0.7"/>)", 0.5))));
  return scenes;
}

}  // namespace itn
