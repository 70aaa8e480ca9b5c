// Gradients by the texels of bitmaps (kernels/derivative/adjoint.h) against central differences of single texels with
// common random numbers, and against the gradient by a constant.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <numeric>

#include "../support/temporary_folder.h"
#include "itn/error.h"
#include "itn/exr.h"
#include "itn/file.h"
#include "itn/parameters.h"
#include "weighed.h"

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

const std::string lamp = R"(<emitter type="point"><point name="position" x="1" y="-1" z="2"/>
  <rgb name="intensity" value="6, 5, 4"/></emitter>)";
const std::string lamp_and_sky =
    R"(<emitter type="constant"><rgb name="radiance" value="0.3, 0.4, 0.5"/></emitter>)" + lamp;

// A floor whose texture is repeated, turned and moved, and a wall on which its light falls. inside: more of the scene.
// No path ends by chance.
Scene room_with(const TemporaryFolder& folder, const std::string& floor, const std::string& inside, int depth,
                const std::string& lights, const std::string& floor_shape = R"(<shape type="rectangle">)") {
  const std::string file = folder / "scene.xml";
  write_file(file, fmt::format(R"(<scene version="3.0.0">
  <integrator type="volpath"><integer name="max_depth" value="{}"/><integer name="rr_depth" value="100"/></integrator>)",
                               depth) +
                       R"(
  <sensor type="perspective">
    <float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0, -3, 2" target="0, 0, 0.2" up="0, 0, 1"/></transform>
    <film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="16"/>
      <rfilter type="box"/></film>
  </sensor>
)" + lights + floor_shape +
                       floor + R"(</shape>
  <shape type="rectangle">
    <transform name="to_world"><rotate x="1" angle="90"/><translate y="1" z="1"/></transform>
    <bsdf type="twosided"><bsdf type="diffuse" id="wall"><rgb name="reflectance" value="0.6, 0.5, 0.4"/></bsdf></bsdf>
  </shape>)" + inside + "</scene>");
  return load_scene(file);
}

// In light from a lamp and from all around.
Scene room(const TemporaryFolder& folder, const std::string& floor, const std::string& inside = "") {
  return room_with(folder, floor, inside, 4, lamp_and_sky);
}

RenderOptions by(const std::vector<std::string>& parameters) {
  RenderOptions options = one_lane();
  options.seed = 5;
  options.derivatives = parameters;
  return options;
}

// One texel moved: channel and texel as in the bitmap's data.
Scene moved(const Scene& scene, const std::string& name, std::size_t texel, double offset) {
  const Parameter p = find_parameter(list_parameters(scene), name);
  Bitmap texels = texels_of(scene, p);
  texels.data[texel] += static_cast<float>(offset);
  Scene result = scene;
  set_texels(result, p, texels);
  return result;
}

std::string rotated(const std::string& filter, const std::string& wrap) {
  return fmt::format(R"(<string name="filter_type" value="{}"/><string name="wrap_mode" value="{}"/>
    <transform name="to_uv"><scale x="1.7" y="1.4"/><rotate z="1" angle="20"/><translate x="-0.3" y="0.2"/></transform>)",
                     filter, wrap);
}

// Normals that lean by up to 20 degrees, as colours.
float leaning(std::size_t i) {
  return i % 3 == 2 ? 0.9F + 0.01F * static_cast<float>(i % 7) : 0.4F + 0.02F * static_cast<float>(i * 7 % 11);
}

// Texels against central differences of the same samples. h: how far a texel is moved.
void check_texels(const Scene& scene, const std::string& name, int spp, double h, double relative = 1e-3) {
  const RenderOptions options = by({name});
  const VoxelGrid texels = gradient(scene, options, spp).values[0];
  float largest = 0;
  for (const float v : texels.data) largest = std::max(largest, std::abs(v));
  REQUIRE(largest > 0);
  const std::size_t count = texels.data.size();
  for (std::size_t k = 0; k < 8; ++k) {
    const std::size_t texel = k * count / 8 + k % (count / 8);
    const double difference =
        (weighed(moved(scene, name, texel, h), options, spp) - weighed(moved(scene, name, texel, -h), options, spp)) /
        (2 * h);
    INFO("texel " << texel);
    CHECK(static_cast<double>(texels.data[texel]) ==
          Approx(difference).epsilon(relative).margin(0.1 * relative * static_cast<double>(largest)));
  }
}

// Checks the mean of differences over seeds against that of the gradients where samples move with texels, along a
// direction in which all texels move. They differ by no more than their noise, which is `precise` of the derivative.
void check_mean_along(const Scene& scene, const std::string& name, double h, double precise) {
  constexpr int seeds = 32, spp = 128;
  const Parameter p = find_parameter(list_parameters(scene), name);
  const bool normals = texels_of(scene, p).channels == 3;  // all lean to one side; heights: half of them rises
  const auto direction = [&](std::size_t i) {
    return normals ? std::array{0.5, -1.0, 0.0}[i % 3] : i % 4 < 2 ? 1 : -1;
  };
  const auto moved_along = [&](double step) {
    Bitmap texels = texels_of(scene, p);
    for (std::size_t i = 0; i < texels.data.size(); ++i) texels.data[i] += static_cast<float>(step * direction(i));
    Scene result = scene;
    set_texels(result, p, texels);
    return result;
  };
  const Scene more = moved_along(h), less = moved_along(-h);
  std::vector<double> lack;
  double derivative = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    RenderOptions options = by({name});
    options.seed = static_cast<std::uint64_t>(seed);
    const std::vector<float> texels = gradient(scene, options, spp).values[0].data;
    double along = 0;
    for (std::size_t i = 0; i < texels.size(); ++i) along += direction(i) * static_cast<double>(texels[i]);
    derivative += along / seeds;
    lack.push_back(along - (weighed(more, options, spp) - weighed(less, options, spp)) / (2 * h));
  }
  const double mean = std::accumulate(lack.begin(), lack.end(), 0.0) / seeds;
  double square = 0;
  for (const double v : lack) square += (v - mean) * (v - mean);
  const double error = std::sqrt(square / (seeds * (seeds - 1)));
  INFO(name << ": " << derivative << " lacks " << mean << " +- " << error);
  CHECK(std::abs(mean) < 3.5 * error);
  CHECK(error < precise * std::abs(derivative));
}

// The BSDFs under a bent normal: one that reflects alike in all directions, and one that does not. GGX: samples of
// Beckmann's facets are weighed by a fit that is up to 0.35 % off by the angle to the normal (kernels/model/README.md),
// whose slope a central difference would see.
const std::string matt = R"(<bsdf type="diffuse"><rgb name="reflectance" value="0.7, 0.5, 0.3"/></bsdf>)";
const std::string glossy = R"(<bsdf type="roughconductor"><string name="material" value="Cu"/>
  <string name="distribution" value="ggx"/><float name="alpha" value="0.4"/></bsdf>)";

std::string normal_map(const TemporaryFolder& folder, const std::string& inside) {
  const std::string file = picture(folder, 3, leaning);
  return R"(<bsdf type="normalmap" id="relief">)" + texture("normalmap", file, rotated("bilinear", "repeat")) + inside +
         "</bsdf>";
}

std::string bump_map(const TemporaryFolder& folder, const std::string& inside) {
  const std::string file = picture(folder, 1, uneven);
  return R"(<bsdf type="bumpmap" id="dents"><float name="scale" value="0.4"/>)" +
         texture("heights", file, rotated("bilinear", "repeat")) + inside + "</bsdf>";
}

// A floor of a mesh: 3 x 3 places with colours.
std::string painted_floor(const TemporaryFolder& folder) {
  std::string ply = R"(ply
format ascii 1.0
element vertex 9
property float x
property float y
property float z
property float r
property float g
property float b
element face 8
property list uchar int vertex_index
end_header
)";
  for (int i = 0; i < 9; ++i)
    ply +=
        fmt::format("{} {} 0 {} {} {}\n", i % 3 - 1, i / 3 - 1, 0.2 + 0.05 * i, 0.9 - 0.08 * i, 0.3 + 0.04 * (i % 4));
  for (int y = 0; y < 2; ++y)
    for (int x = 0; x < 2; ++x) {
      const int a = 3 * y + x;
      ply += fmt::format("3 {} {} {}\n3 {} {} {}\n", a, a + 1, a + 4, a, a + 4, a + 3);
    }
  write_file(folder / "floor.ply", ply);
  return R"(<shape type="ply"><string name="filename" value=")" + (folder / "floor.ply") + R"("/>)";
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

namespace {

std::string metal(const TemporaryFolder& folder, const std::string& index, const std::string& more) {
  return R"(<bsdf type="roughconductor" id="metal">)" + more +
         texture(index, picture(folder, 3, uneven), rotated("bilinear", "repeat")) + "</bsdf>";
}

}  // namespace

TEST_CASE("the gradient by a texel of a metal's index is its central difference", "[derivative]") {
  const TemporaryFolder folder;
  const std::string k = R"(<rgb name="k" value="2, 1.5, 1"/><float name="alpha" value="0.4"/>)";
  check_texels(room_with(folder, metal(folder, "eta", k), "", 3, lamp), "metal.eta", 16, 0.02);
}

TEST_CASE("the gradient by a texel of a metal's index is its central difference on brushed metal, too", "[.texels]") {
  const TemporaryFolder folder;
  const std::string brushed = R"(<float name="alpha_u" value="0.3"/><float name="alpha_v" value="0.6"/>
    <rgb name="eta" value="0.5, 1, 1.4"/>)";
  check_texels(room_with(folder, metal(folder, "k", brushed), "", 3, lamp), "metal.k", 16, 0.02);
}

namespace {

void check_alike(bool more) {
  const TemporaryFolder folder;
  // Nearest texels: the number is the same to the bit.
  const std::string nearest = R"(<string name="filter_type" value="nearest"/>)";
  struct Case {
    std::string before, name, after, parameter, inside;
    float value;
    bool in_suite;
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
       "metal.alpha", "", 0.3F, true},
      {R"(<bsdf type="twosided"><bsdf type="plastic" id="glaze"><boolean name="nonlinear" value="true"/>)",
       "diffuse_reflectance", "</bsdf></bsdf>", "glaze.diffuse_reflectance", "", 0.4F, true},
      {R"(<bsdf type="principled" id="lacquer">)", "roughness", "</bsdf>", "lacquer.roughness", "", 0.5F, false},
      {R"(<bsdf type="blendbsdf" id="mix">)", "weight", R"(<bsdf type="diffuse" id="one"/>
        <bsdf type="roughconductor"><float name="alpha" value="0.3"/></bsdf></bsdf>)",
       "mix.weight", "", 0.3F, false},
      {R"(<bsdf type="mask" id="veil">)", "opacity", R"(<bsdf type="twosided"><bsdf type="diffuse"/></bsdf></bsdf>)",
       "veil.opacity", medium, 0.6F, true},
      {R"(<bsdf type="roughdielectric" id="frost">)", "alpha", "</bsdf>", "frost.alpha", medium, 0.4F, false},
  };
  for (const Case& c : cases) {
    if (c.in_suite == more) continue;
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

}  // namespace

TEST_CASE("texels that are all alike have the gradient by a constant together", "[derivative]") { check_alike(false); }

TEST_CASE("texels that are all alike have the gradient by a constant together, in more models", "[.texels]") {
  check_alike(true);
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

TEST_CASE("launches and schedules change no bit of a gradient by texels", "[derivative]") {
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

TEST_CASE("the gradient by a normal or a height is its central difference where light comes from one direction",
          "[derivative]") {
  const TemporaryFolder folder;
  check_texels(room_with(folder, normal_map(folder, glossy), "", 2, lamp), "relief.normalmap", 16, 2e-3);
  check_texels(room_with(folder, bump_map(folder, matt), "", 2, lamp), "dents.texture", 16, 2e-3);
  // behind twosided, on a sphere, whose texture coordinates are round; of facets of which few are seen at grazing
  // angles, where bent normals turn away from the viewer
  const std::string satin = R"(<bsdf type="roughconductor"><string name="material" value="Cu"/>
    <float name="alpha" value="0.4"/></bsdf>)";
  const std::string ball = R"(<shape type="sphere"><point name="center" x="0" y="0" z="0.6"/>
    <float name="radius" value="0.5"/><bsdf type="twosided">)";
  const std::string ground = R"(<bsdf type="diffuse"/>)";
  check_texels(room_with(folder, ground, ball + bump_map(folder, satin) + "</bsdf></shape>", 2, lamp), "dents.texture",
               16, 2e-3);
}

TEST_CASE("the gradient by a normal or a height has the mean of central differences in light from everywhere",
          "[.texels]") {
  const TemporaryFolder folder;
  for (const std::string& inside : {matt, glossy}) {
    check_mean_along(room(folder, normal_map(folder, inside)), "relief.normalmap", 0.02, 0.02);
    check_mean_along(room(folder, bump_map(folder, inside)), "dents.texture", 0.02, 0.1);
  }
}

TEST_CASE("heights that are all moved alike change nothing", "[derivative]") {
  const TemporaryFolder folder;
  const WeighedDerivatives result = gradient(room(folder, bump_map(folder, matt)), by({"dents.texture"}), 16);
  CHECK(result.value[0] == 0);
  float size = 0;
  for (const float v : result.values[0].data) size += std::abs(v);
  CHECK(std::abs(sum_of(result.values[0])) < 1e-5 * static_cast<double>(size));
}

TEST_CASE("the gradient by the value at a vertex is its central difference", "[derivative]") {
  const TemporaryFolder folder;
  const std::string floor = R"(<bsdf type="diffuse" id="wood"><texture type="mesh_attribute" name="reflectance">
    <string name="name" value="vertex_color"/><float name="scale" value="0.8"/></texture></bsdf>)";
  const Scene scene = room_with(folder, floor, "", 4, lamp_and_sky, painted_floor(folder));
  check_texels(scene, "wood.reflectance", 16, 0.02);
  const WeighedDerivatives result = gradient(scene, by({"wood.reflectance"}), 16);
  CHECK(result.values[0].width == 9);
  CHECK(sum_of(result.values[0]) == Approx(result.value[0]).epsilon(1e-5));
}

TEST_CASE("the gradient by the texel of a light is its central difference", "[derivative]") {
  const TemporaryFolder folder;
  const std::string file = picture(folder, 3, [](std::size_t i) { return i == 4 ? 0.0F : uneven(i); });
  const std::string panel = R"(<shape type="rectangle"><transform name="to_world"><scale value="0.6"/>
    <rotate x="1" angle="180"/><translate z="1.5" x="0.3"/></transform><emitter type="area" id="panel">)" +
                            texture("radiance", file, rotated("bilinear", "mirror")) + "</emitter></shape>";
  const std::string ground = R"(<bsdf type="diffuse"/>)";
  check_texels(room_with(folder, ground, panel, 4, lamp_and_sky), "panel.radiance", 64, 0.02);
  const std::string slide = R"(<emitter type="projector" id="slide"><float name="fov" value="60"/>
    <transform name="to_world"><lookat origin="0.5, -0.5, 2.5" target="0, 0, 0" up="0, 1, 0"/></transform>)" +
                            texture("irradiance", file, R"(<string name="filter_type" value="bilinear"/>)") +
                            "</emitter>";
  const std::string spot = R"(<emitter type="spot" id="spot"><rgb name="intensity" value="6, 5, 4"/>
    <float name="cutoff_angle" value="35"/>
    <transform name="to_world"><lookat origin="1, -1, 2" target="0, 0.4, 0" up="0, 1, 0"/></transform>)" +
                           texture("texture", file, rotated("bilinear", "clamp")) + "</emitter>";
  const Scene scene = room_with(folder, ground, slide, 4, spot);
  check_texels(scene, "slide.irradiance", 64, 0.02);
  check_texels(scene, "spot.texture", 64, 0.02);
  const WeighedDerivatives result = gradient(scene, by({"slide.irradiance"}), 16);
  CHECK(sum_of(result.values[0]) == Approx(result.value[0]).epsilon(1e-5));
}

TEST_CASE("launches and schedules change no bit of a gradient by heights, normals, vertices and lights",
          "[derivative]") {
  const TemporaryFolder folder;
  const std::string file = picture(folder, 3, uneven);
  const std::string panel = R"(<shape type="rectangle"><transform name="to_world"><scale value="0.6"/>
    <rotate x="1" angle="180"/><translate z="1.5" x="0.3"/></transform><emitter type="area" id="panel">)" +
                            texture("radiance", file, "") + "</emitter></shape>";
  const TemporaryFolder other;
  const std::string ball = R"(<shape type="sphere"><point name="center" x="0" y="0" z="0.6"/>
    <float name="radius" value="0.3"/>)" +
                           normal_map(other, glossy) + "</shape>";
  const TemporaryFolder third;
  const Scene scene = room_with(folder, bump_map(third, matt), panel + ball, 4, lamp_and_sky);
  const RenderOptions options = by({"dents.texture", "relief.normalmap", "panel.radiance"});
  const WeighedDerivatives whole = gradient(scene, options, 16);
  RenderOptions small = options, staged = options;
  small.paths_a_launch = 777;
  staged.schedule = Schedule::staged;
  for (const RenderOptions& way : {options, small, staged}) {
    const WeighedDerivatives same = gradient(scene, way, 16);
    for (std::size_t p = 0; p < 3; ++p) CHECK(same.values[p].data == whole.values[p].data);
  }
}

TEST_CASE("normals under which a mirror would turn are refused with the remedy", "[derivative]") {
  const TemporaryFolder folder;
  const Scene scene = room(folder, normal_map(folder, R"(<bsdf type="conductor"/>)"));
  CHECK_THROWS_WITH(GradientRenderer(device(), scene, by({"relief.normalmap"})), Catch::Contains("need a rough one"));
}
