// Media by scattering and absorption coefficients (kernels/model/medium/by_scattering.h) beside the same media by
// sigma_t, albedo and g: from the same samples, derivatives are related by the chain rule, and by nothing else.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "../support/temporary_folder.h"
#include "itn/file.h"
#include "itn/gradient_renderer.h"
#include "transport.h"

using namespace itn;
using namespace itn::test;

namespace {

Scene cube(const TemporaryFolder& folder, const std::string& medium) {
  const std::string file = folder / "scene.xml";
  write_file(file, fmt::format(R"(<scene version="3.0.0">
  <sensor type="perspective">
    <float name="fov" value="45"/>
    <transform name="to_world"><lookat origin="0.5, -3.5, 1" target="0, 0, 0" up="0, 0, 1"/></transform>
    <film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="8"/>
      <rfilter type="box"/></film>
  </sensor>
  <emitter type="point"><point name="position" x="1" y="-3" z="2"/><float name="intensity" value="9"/></emitter>
  <shape type="cube"><bsdf type="null"/>
    <medium name="interior" id="m" {}<phase type="hg" id="h"><float name="g" value="0.6"/></phase></medium>
  </shape>
</scene>)",
                               medium));
  return load_scene(file);
}

// The means of the derivative images, then the gradients of weighed images by replay.
std::vector<double> derivatives(const Scene& scene, const std::vector<std::string>& names, bool replayed) {
  RenderOptions options = one_lane();
  options.spp = 64;
  options.seed = 7;
  options.derivatives = names;
  std::vector<double> result;
  if (replayed)
    return GradientRenderer(device(), scene, options)
        .render(0, {64},
                [](const std::vector<Rendering>& groups) {
                  return std::vector<std::vector<double>>{std::vector<double>(groups[0].mean.size(), 1)};
                })
        .value;
  for (const Image& image : render(device(), scene, options).derivatives) result.push_back(image.mean_of_image[0]);
  return result;
}

}  // namespace

TEST_CASE("derivatives by coefficients are those by sigma_t, albedo and g through the chain rule", "[derivative]") {
  const TemporaryFolder folder;
  // sigma_s 1.5, sigma_a 0.5 times scale 1.25; sigma_s_prime = 1.5 * (1 - 0.6)
  const auto media = [&](const std::string& type, const std::string& volume) {
    const std::string head = "type=\"" + type + "\"><float name=\"scale\" value=\"1.25\"/>";
    const auto number = [](const std::string& name, double value) {
      return fmt::format("<float name=\"{}\" value=\"{}\"/>", name, value);
    };
    const std::string density = type == "homogeneous" ? "" : volume;
    std::string extinction = type == "homogeneous" ? number("sigma_t", 2) : volume;
    if (const auto at = extinction.find("density"); at != std::string::npos)
      extinction.replace(at, 7, "sigma_t").replace(extinction.find("value=\"1\""), 9, "value=\"2\"");
    return std::vector<Scene>{cube(folder, head + extinction + number("albedo", 0.75)),
                              cube(folder, head + number("sigma_s", 1.5) + number("sigma_a", 0.5) + density),
                              cube(folder, head + number("sigma_s_prime", 0.6) + number("sigma_a", 0.5) + density)};
  };
  const std::string volume =
      R"(<volume type="constvolume" name="density"><float name="value" value="1"/>
         <transform name="to_world"><translate x="-0.5" y="-0.5" z="-0.5"/><scale value="2"/></transform></volume>)";
  for (const char* type : {"homogeneous", "heterogeneous"})
    for (const bool replayed : {false, true}) {
      INFO(type << (replayed ? ", by replay" : ""));
      const std::vector<Scene> scenes = media(type, volume);
      const auto of = [&](std::size_t scene, const std::vector<std::string>& names) {
        return derivatives(scenes[scene], names, replayed);
      };
      const std::vector<double> d = of(0, {"m.sigma_t", "m.albedo", "h.g", "m.scale"});
      // d albedo / d sigma_s = sigma_a / sigma_t^2, d albedo / d sigma_a = -sigma_s / sigma_t^2
      const double by_s = d[0] + d[1] * 0.5 / 4, by_a = d[0] - d[1] * 1.5 / 4;
      const std::vector<double> pair = of(1, {"m.sigma_s", "m.sigma_a", "h.g", "m.scale"});
      CHECK(pair[0] == Approx(by_s).epsilon(1e-3));
      CHECK(pair[1] == Approx(by_a).epsilon(1e-3));
      CHECK(pair[2] == Approx(d[2]).epsilon(1e-3));
      CHECK(pair[3] == Approx(d[3]).epsilon(1e-3));
      const std::vector<double> reduced = of(2, {"m.sigma_s_prime", "m.sigma_a", "h.g", "m.scale"});
      CHECK(reduced[0] == Approx(by_s / 0.4).epsilon(1e-3));
      CHECK(reduced[1] == Approx(by_a).epsilon(1e-3));
      CHECK(reduced[2] == Approx(d[2] + by_s * 1.5 / 0.4).epsilon(1e-3));  // sigma_s = 0.6 / (1 - g)
      CHECK(reduced[3] == Approx(d[3]).epsilon(1e-3));
    }
}
