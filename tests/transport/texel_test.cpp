// Gradients by the texels of bitmaps (kernels/lib/adjoint.h) against central differences of single texels with common
// random numbers, and against the gradient by a constant.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <numeric>

#include "../support/temporary_folder.h"
#include "runtime/base/error.h"
#include "runtime/base/file.h"
#include "runtime/gradient_renderer.h"
#include "runtime/image/exr.h"
#include "runtime/scene/parameters.h"
#include "transport.h"

using namespace itn;
using namespace itn::test;

namespace {

constexpr int width = 4, height = 4;

// A bitmap of 4 x 4 texels, written for scenes to read.
std::string picture(const TemporaryFolder& folder, int channels, const std::function<float(std::size_t)>& value) {
  std::vector<float> data(static_cast<std::size_t>(width * height * channels));
  for (std::size_t i = 0; i < data.size(); ++i) data[i] = value(i);
  const std::vector<std::string> names =
      channels == 1 ? std::vector<std::string>{"Y"} : std::vector<std::string>{"R", "G", "B"};
  write_exr(folder / "picture.exr", {width, height, names, data, {}});
  return folder / "picture.exr";
}

float uneven(std::size_t i) { return 0.25F + 0.05F * static_cast<float>(i * 7 % 11); }

std::string texture(const std::string& name, const std::string& file, const std::string& more) {
  return fmt::format(R"(<texture type="bitmap" name="{}"><string name="filename" value="{}"/>
    <boolean name="raw" value="true"/>{}</texture>)",
                     name, file, more);
}

// A floor whose texture is repeated, turned and moved, and a wall on which its light falls, in light from a lamp and
// from all around. inside: more of the scene. No path ends by chance.
Scene room(const TemporaryFolder& folder, const std::string& floor, const std::string& inside = "") {
  const std::string file = folder / "scene.xml";
  write_file(file, R"(<scene version="3.0.0">
  <integrator type="volpath"><integer name="max_depth" value="4"/><integer name="rr_depth" value="100"/></integrator>
  <sensor type="perspective">
    <float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0, -3, 2" target="0, 0, 0.2" up="0, 0, 1"/></transform>
    <film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="16"/>
      <rfilter type="box"/></film>
  </sensor>
  <emitter type="constant"><rgb name="radiance" value="0.3, 0.4, 0.5"/></emitter>
  <emitter type="point"><point name="position" x="1" y="-1" z="2"/><rgb name="intensity" value="6, 5, 4"/></emitter>
  <shape type="rectangle">)" +
                       floor + R"(</shape>
  <shape type="rectangle">
    <transform name="to_world"><rotate x="1" angle="90"/><translate y="1" z="1"/></transform>
    <bsdf type="twosided"><bsdf type="diffuse" id="wall"><rgb name="reflectance" value="0.6, 0.5, 0.4"/></bsdf></bsdf>
  </shape>)" + inside + "</scene>");
  return load_scene(file);
}

// A weight of each value of an image.
std::vector<double> weights_of(const Rendering& image) {
  std::vector<double> weights(image.mean.size());
  for (std::size_t i = 0; i < weights.size(); ++i) weights[i] = 0.5 + 0.1 * static_cast<double>(i * 5 % 13);
  return weights;
}

double weighed(const Scene& scene, RenderOptions options, int spp) {
  options.derivatives.clear();
  const Rendering image = Renderer(device(), scene, options).render(0, spp);
  const std::vector<double> weights = weights_of(image);
  return std::inner_product(weights.begin(), weights.end(), image.mean.begin(), 0.0, std::plus<>(),
                            [](double w, float v) { return w * static_cast<double>(v); });
}

WeighedDerivatives gradient(const Scene& scene, const RenderOptions& options, int spp, const Device& on = device()) {
  return GradientRenderer(on, scene, options).render(0, {spp}, [](const std::vector<Rendering>& groups) {
    return std::vector<std::vector<double>>{weights_of(groups[0])};
  });
}

RenderOptions by(const std::vector<std::string>& parameters) {
  RenderOptions options;
  options.seed = 5;
  options.derivatives = parameters;
  return options;
}

// One texel moved: channel and texel as in the bitmap's data.
Scene moved(const Scene& scene, const std::string& name, std::size_t texel, double offset) {
  const Parameter p = find_parameter(list_parameters(scene), name);
  auto bitmap = std::make_shared<Bitmap>(*bitmap_of(scene, p));
  bitmap->data[texel] += static_cast<float>(offset);
  Scene result = scene;
  set_bitmap(result, p, bitmap);
  return result;
}

double sum_of(const VoxelGrid& values) { return std::accumulate(values.data.begin(), values.data.end(), 0.0); }

std::string rotated(const std::string& filter, const std::string& wrap) {
  return fmt::format(R"(<string name="filter_type" value="{}"/><string name="wrap_mode" value="{}"/>
    <transform name="to_uv"><scale x="1.7" y="1.4"/><rotate z="1" angle="20"/><translate x="-0.3" y="0.2"/></transform>)",
                     filter, wrap);
}

}  // namespace

TEST_CASE("the gradient by a texel is the central difference of that texel", "[derivative]") {
  const TemporaryFolder folder;
  const int channels = GENERATE(3, 1);
  const std::string file = picture(folder, channels, uneven);
  // Directions do not depend on reflectances, and no path ends by chance: only rounding keeps the two apart.
  for (const auto& [filter, wrap] : std::vector<std::pair<std::string, std::string>>{
           {"bilinear", "repeat"}, {"bilinear", "mirror"}, {"bilinear", "clamp"}, {"nearest", "repeat"}}) {
    INFO(filter << ", " << wrap << ", channels " << channels);
    const Scene scene = room(
        folder, R"(<bsdf type="diffuse" id="wood">)" + texture("reflectance", file, rotated(filter, wrap)) + "</bsdf>");
    const RenderOptions options = by({"wood.reflectance"});
    const WeighedDerivatives result = gradient(scene, options, 16);
    const VoxelGrid& texels = result.values[0];
    REQUIRE(texels.width == width);
    REQUIRE(texels.channels == channels);
    REQUIRE(texels.data.size() == static_cast<std::size_t>(width * height * channels));
    CHECK(sum_of(texels) == Approx(result.value[0]).epsilon(1e-5));
    float largest = 0;
    for (const float v : texels.data) largest = std::max(largest, std::abs(v));
    for (const std::size_t i : {0, 2, 5, 6, 9, 12, 15}) {
      const std::size_t texel = channels * i + i % static_cast<std::size_t>(channels);
      const double h = 0.02;
      const double difference = (weighed(moved(scene, "wood.reflectance", texel, h), options, 16) -
                                 weighed(moved(scene, "wood.reflectance", texel, -h), options, 16)) /
                                (2 * h);
      INFO("texel " << texel);
      CHECK(static_cast<double>(texels.data[texel]) ==
            Approx(difference).epsilon(1e-3).margin(1e-4 * static_cast<double>(largest)));
    }
  }
}

TEST_CASE("texels that are all alike have the gradient by a constant together", "[derivative]") {
  const TemporaryFolder folder;
  // Nearest texels: the number is the same to the bit.
  const std::string nearest = R"(<string name="filter_type" value="nearest"/>)";
  struct Case {
    std::string before, name, after, parameter, inside;
    float value;
  };
  const std::string medium = R"(<medium type="homogeneous" name="interior"><float name="sigma_t" value="3"/>
    <float name="albedo" value="0.9"/></medium>)";
  const std::string glass_floor = R"(<bsdf type="diffuse" id="ground"/>)";
  const auto ball = [](const std::string& inside) {
    return R"(<shape type="sphere"><point name="center" x="0" y="0" z="0.6"/><float name="radius" value="0.5"/>)" +
           inside + "</shape>";
  };
  const std::vector<Case> cases{
      {R"(<bsdf type="roughconductor" id="metal"><string name="material" value="Cu"/>)", "alpha", "</bsdf>",
       "metal.alpha", "", 0.3F},
      {R"(<bsdf type="twosided"><bsdf type="plastic" id="glaze"><boolean name="nonlinear" value="true"/>)",
       "diffuse_reflectance", "</bsdf></bsdf>", "glaze.diffuse_reflectance", "", 0.4F},
      {R"(<bsdf type="principled" id="lacquer">)", "roughness", "</bsdf>", "lacquer.roughness", "", 0.5F},
      {R"(<bsdf type="blendbsdf" id="mix">)", "weight", R"(<bsdf type="diffuse" id="one"/>
        <bsdf type="roughconductor"><float name="alpha" value="0.3"/></bsdf></bsdf>)",
       "mix.weight", "", 0.3F},
      {R"(<bsdf type="mask" id="veil">)", "opacity", R"(<bsdf type="twosided"><bsdf type="diffuse"/></bsdf></bsdf>)",
       "veil.opacity", medium, 0.6F},
      {R"(<bsdf type="roughdielectric" id="frost">)", "alpha", "</bsdf>", "frost.alpha", medium, 0.4F},
  };
  for (const Case& c : cases) {
    INFO(c.parameter);
    const auto scene = [&](const std::string& value) {
      const std::string bsdf = c.before + value + c.after;
      return c.inside.empty() ? room(folder, bsdf) : room(folder, glass_floor, ball(bsdf + c.inside));
    };
    const std::string file = picture(folder, 1, [&](std::size_t) { return c.value; });
    const Scene textured = scene(texture(c.name, file, nearest));
    const Scene constant = scene(fmt::format(R"(<float name="{}" value="{}"/>)", c.name, c.value));
    const WeighedDerivatives by_texels = gradient(textured, by({c.parameter}), 32);
    const WeighedDerivatives by_number = gradient(constant, by({c.parameter}), 32);
    REQUIRE(by_number.value[0] != 0);
    CHECK(by_texels.value[0] == Approx(by_number.value[0]).epsilon(2e-4));
    CHECK(by_texels.stderr_[0] == Approx(by_number.stderr_[0]).epsilon(1e-3));
    CHECK(sum_of(by_texels.values[0]) == Approx(by_number.value[0]).epsilon(2e-4));
  }
}

TEST_CASE("the texels of each channel have its share of the gradient by a colour", "[derivative]") {
  const TemporaryFolder folder;
  const std::array<float, 3> colour{0.3F, 0.5F, 0.7F};
  const std::string file = picture(folder, 3, [&](std::size_t i) { return colour[i % 3]; });
  const auto floor = [](const std::string& value) { return R"(<bsdf type="diffuse" id="wood">)" + value + "</bsdf>"; };
  const Scene textured =
      room(folder, floor(texture("reflectance", file, R"(<string name="filter_type" value="nearest"/>)")));
  const Scene constant = room(folder, floor(R"(<rgb name="reflectance" value="0.3, 0.5, 0.7"/>)"));
  // beside numbers of another surface of the same model, whose sums are by themselves then, too
  const WeighedDerivatives by_texels = gradient(textured, by({"wall.reflectance.R", "wood.reflectance"}), 32);
  const WeighedDerivatives by_number = gradient(
      constant, by({"wall.reflectance.R", "wood.reflectance.R", "wood.reflectance.G", "wood.reflectance.B"}), 32);
  CHECK(by_texels.value[0] == Approx(by_number.value[0]).epsilon(1e-4));
  CHECK(by_texels.values[0].data.empty());
  std::array<double, 3> sum{};
  const std::vector<float>& texels = by_texels.values[1].data;
  for (std::size_t i = 0; i < texels.size(); ++i) sum[i % 3] += static_cast<double>(texels[i]);
  for (std::size_t c = 0; c < 3; ++c) CHECK(sum[c] == Approx(by_number.value[1 + c]).epsilon(1e-4));
}

TEST_CASE("launches, schedules and widths change no bit of a gradient by texels", "[derivative]") {
  const TemporaryFolder folder;
  const std::string file = picture(folder, 3, uneven);
  const Scene scene = room(folder, R"(<bsdf type="diffuse" id="wood">)" +
                                       texture("reflectance", file, rotated("bilinear", "repeat")) + "</bsdf>");
  const RenderOptions options = by({"wood.reflectance"});
  const WeighedDerivatives whole = gradient(scene, options, 16);
  CHECK(gradient(scene, options, 16).values[0].data == whole.values[0].data);
  RenderOptions small = options, staged = options;
  small.paths_a_launch = 777;
  staged.schedule = Schedule::staged;
  CHECK(gradient(scene, small, 16).values[0].data == whole.values[0].data);
  CHECK(gradient(scene, staged, 16).values[0].data == whole.values[0].data);
  // one gradient after the other
  GradientRenderer renderer(device(), scene, options);
  const auto weights = [](const std::vector<Rendering>& groups) {
    return std::vector<std::vector<double>>{weights_of(groups[0])};
  };
  renderer.render(0, {16}, weights);
  CHECK(renderer.render(0, {16}, weights).values[0].data == whole.values[0].data);
}

TEST_CASE("textures are not differentiated by in images", "[derivative]") {
  const TemporaryFolder folder;
  const std::string file = picture(folder, 1, uneven);
  const Scene scene = room(folder, R"(<bsdf type="diffuse" id="wood">)" + texture("reflectance", file, "") + "</bsdf>");
  CHECK_THROWS_WITH(Renderer(device(), scene, by({"wood.reflectance"})), Catch::Contains("texel by texel"));
}
