// Opaque and transparent surfaces without media, which Mitsuba renders with `path`: the knot in one material after the
// other on a textured floor, and a room of textures that are differentiated by.
#include <fmt/format.h>

#include "itn/file.h"
#include "tools/itn/bench/objects.h"
#include "tools/itn/bench/scene_xml.h"
#include "tools/itn/bench/scenes.h"

namespace itn {
namespace {

constexpr const char* envmap_xml = R"(  <emitter type="envmap">
    <string name="filename" value="window_sky.exr"/>
    <transform name="to_world">
      <rotate x="1" angle="90"/>
    </transform>
  </emitter>
)";

// A bitmap's 512 x 512 texels are numbers of its own beside the scene's.
std::string floor_of(const char* bsdf) {
  return fmt::format(R"(  <shape type="rectangle">
    <transform name="to_world">
      <scale x="4" y="4"/>
      <translate z="-0.72"/>
    </transform>
{}  </shape>
)",
                     bsdf);
}

constexpr const char* wood_xml = R"(    <bsdf type="diffuse" id="wood">
      <texture type="bitmap" name="reflectance">
        <string name="filename" value="tiles.exr"/>
        <boolean name="raw" value="true"/>
      </texture>
    </bsdf>
)";

// The reflectance under a coat: a factor of one lobe, not of the whole.
constexpr const char* varnish_xml = R"(    <bsdf type="roughplastic" id="wood">
      <float name="alpha" value="0.15"/>
      <texture type="bitmap" name="diffuse_reflectance">
        <string name="filename" value="tiles.exr"/>
        <boolean name="raw" value="true"/>
      </texture>
    </bsdf>
)";

constexpr const char* copper_xml = R"(    <bsdf type="roughconductor">
      <string name="material" value="Cu"/>
      <string name="distribution" value="ggx"/>
      <float name="alpha" value="0.2"/>
    </bsdf>
)";

constexpr const char* plastic_xml = R"(    <bsdf type="roughplastic">
      <rgb name="diffuse_reflectance" value="0.1, 0.27, 0.36"/>
      <string name="distribution" value="ggx"/>
      <float name="alpha" value="0.1"/>
    </bsdf>
)";

constexpr const char* principled_xml = R"(    <bsdf type="principled">
      <rgb name="base_color" value="0.8, 0.5, 0.2"/>
      <float name="metallic" value="0.4"/>
      <float name="roughness" value="0.3"/>
      <float name="specular" value="0.5"/>
      <float name="clearcoat" value="0.6"/>
    </bsdf>
)";

constexpr const char* blend_xml = R"(    <bsdf type="blendbsdf">
      <float name="weight" value="0.4"/>
      <bsdf type="diffuse">
        <rgb name="reflectance" value="0.6, 0.1, 0.1"/>
      </bsdf>
      <bsdf type="roughconductor">
        <string name="material" value="Al"/>
        <float name="alpha" value="0.25"/>
      </bsdf>
    </bsdf>
)";

std::string knot_xml(const std::string& bsdf) {
  return R"(  <shape type="ply">
    <string name="filename" value="knot.ply"/>
)" + bsdf +
         "  </shape>\n";
}

}  // namespace

std::vector<BenchScene> write_surface_scenes(const std::string& folder) {
  write_knot(folder + "/knot.ply");
  write_tiles(folder + "/tiles.exr", 512);
  write_window_sky(folder + "/window_sky.exr");

  struct Material {
    const char* name;
    std::string bsdf;
  };
  const Material materials[] = {{"roughconductor", copper_xml},
                                {"roughplastic", plastic_xml},
                                {"principled", principled_xml},
                                {"blendbsdf", blend_xml},
                                {"roughdielectric", bench_rough_xml("ggx", 0.1, 1.5)}};
  constexpr const char* view = R"(origin="0, -4.2, 2.4" target="0, 0, 0")";
  std::vector<BenchScene> scenes;
  const auto add = [&](const std::string& group, const std::string& name, const std::string& texture, int depth,
                       const std::string& body) {
    const std::string file = fmt::format("{}/{:02}.xml", folder, scenes.size());
    write_file(file, bench_scene_xml("path", depth, 5, 36, view, body));
    scenes.push_back({name, group, file, texture});
  };
  for (const auto& [light, light_xml] :
       {std::pair<const char*, std::string>{"sunsky", bench_sunsky_xml(0.5358)}, {"envmap", envmap_xml}}) {
    for (const Material& material : materials)
      add(fmt::format("surfaces, {}", light), fmt::format("{} {}", material.name, light), "", 16,
          light_xml + floor_of(wood_xml) + knot_xml(material.bsdf));
    add(fmt::format("textures, {}", light), fmt::format("diffuse floor {}", light), "wood.reflectance", 6,
        light_xml + floor_of(wood_xml) + knot_xml(plastic_xml));
    add(fmt::format("textures, {}", light), fmt::format("varnished floor {}", light), "wood.diffuse_reflectance", 6,
        light_xml + floor_of(varnish_xml) + knot_xml(copper_xml));
  }
  return scenes;
}

}  // namespace itn
