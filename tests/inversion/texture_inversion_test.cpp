// Textures from images: what they should be, within the noise of the target, and the same after a stop.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "itn/file.h"
#include "itn/load_scene.h"
#include "runtime/inverse/textures/stored_texture_inversion.h"
#include "runtime/scene/volume/volume_file.h"
#include "tests/stage/stage_test.h"
#include "tests/support/temporary_folder.h"

using namespace itn;
using namespace itn::test;

namespace {

constexpr int size = 8;

// A floor of 8 x 8 texels, seen from above in light from all around and a lamp. more: of the scene
Scene floor_of(const std::shared_ptr<const Bitmap>& bitmap, const std::string& more = "") {
  const TemporaryFolder folder;
  write_file(folder / "scene.xml", R"(<scene version="3.0.0">
  <integrator type="volpath"><integer name="max_depth" value="3"/></integrator>
  <sensor type="perspective">
    <float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0, 0, 3" target="0, 0, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="32"/></film>
  </sensor>
  <emitter type="constant"><rgb name="radiance" value="0.3, 0.4, 0.5"/></emitter>
  <emitter type="point"><point name="position" x="1" y="-1" z="2"/><rgb name="intensity" value="6, 5, 4"/></emitter>
  <shape type="rectangle"><bsdf type="diffuse" id="wood"/></shape>)" +
                                       more + "</scene>");
  Scene scene = load_scene(folder / "scene.xml");
  Texture& reflectance = scene.bsdfs[0].value("reflectance");
  reflectance = make_bitmap(bitmap);
  reflectance.wrap = Texture::Wrap::clamp;
  return scene;
}

std::shared_ptr<Bitmap> picture(double (*value)(int, int, int)) {
  auto bitmap = std::make_shared<Bitmap>(Bitmap{size, size, 3, {}});
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x)
      for (int c = 0; c < 3; ++c) bitmap->data.push_back(static_cast<float>(value(x, y, c)));
  return bitmap;
}

double painted(int x, int y, int c) { return 0.15 + 0.7 * ((x * 3 + y * 5 + c * 7) % 11) / 10; }
double grey(int, int, int) { return 0.5; }

TargetImage target_from(const Scene& scene, int spp = 256) {
  RenderOptions options;
  options.spp = spp;
  options.seed = 77;
  const Rendering image = render(device(), scene, options);
  return {image.width, image.height, 3, image.mean, std::vector<float>(image.mean.size() / 3, 1.0F), image.stderr_};
}

double rms(const std::vector<float>& a, const std::vector<float>& b) {
  double square = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    square += std::pow(static_cast<double>(a[i]) - static_cast<double>(b[i]), 2);
  return std::sqrt(square / static_cast<double>(a.size()));
}

}  // namespace

TEST_CASE("a texture is found from one image of the surface that has it") {
  const auto truth = picture(painted);
  const std::vector<TargetImage> targets{target_from(floor_of(truth))};
  TextureInversionOptions options;
  options.iterations = 100;
  options.spp = 8;
  TextureInversion inversion(device(), floor_of(picture(grey)), {"wood.reflectance"}, {0}, targets, {}, options);
  TextureInversionState state = inversion.start();
  const double before = rms(inversion.values(state, 0).data, truth->data);
  CHECK(before > 0.2);
  while (state.iteration < options.iterations) inversion.advance(state);
  CHECK(rms(inversion.values(state, 0).data, truth->data) < 0.02);
  const TextureImages seen = inversion.render(state);
  CHECK(seen.images.size() == 1);
  CHECK(seen.loss.loss < 1e-3);
  CHECK(seen.fit());
  // A camera that looked beside is not made up for.
  std::vector<TargetImage> beside = targets;
  std::rotate(beside[0].value.begin(), beside[0].value.begin() + 6, beside[0].value.end());
  TextureInversion of_beside(device(), floor_of(picture(grey)), {"wood.reflectance"}, {0}, beside, {}, options);
  CHECK_FALSE(of_beside.render(state).fit());
}

TEST_CASE("a texture's standard errors cover the truth as often as they say, and unseen texels have none") {
  const auto truth = picture(painted);
  Scene scene = floor_of(picture(grey)), true_scene = floor_of(truth);
  for (Scene* of : {&scene, &true_scene})  // half of the picture is beyond the floor's edge
    of->bsdfs[0].value("reflectance").to_uv = {0.5, 0, 0, 0, 1, 0};
  const std::vector<TargetImage> targets{target_from(true_scene, 32)};
  TextureInversionOptions options;
  options.iterations = 80;
  options.spp = 8;
  options.repeats = 6;
  TextureInversion inversion(device(), scene, {"wood.reflectance"}, {0}, targets, {}, options);
  TextureInversionState state = inversion.start();
  while (!state.finished) inversion.advance(state);
  const VoxelGrid found = inversion.values(state, 0), errors = inversion.uncertainty(state, 0);
  int unseen = 0, within_one = 0, within_two = 0;
  for (std::size_t i = 0; i < errors.data.size(); ++i) {
    if (std::isinf(errors.data[i])) {
      CHECK(found.data[i] == 0.5F);
      ++unseen;
      continue;
    }
    const float off = std::abs(found.data[i] - truth->data[i]);
    within_one += off < errors.data[i];
    within_two += off < 2 * errors.data[i];
  }
  CHECK(unseen == size * 3 * 3);  // columns 5 to 7: the fifth is still between the edge's texels
  const double seen = size * size * 3 - unseen;
  INFO(within_one / seen << " within one standard error, " << within_two / seen << " within two");
  CHECK(within_one / seen > 0.5);
  CHECK(within_one / seen < 0.85);
  CHECK(within_two / seen > 0.8);
}

TEST_CASE("numbers are found beside a texture") {
  const auto truth = picture(painted);
  // a known surface tells light and floor apart
  const std::string patch = R"(<shape type="rectangle"><transform name="to_world"><scale value="0.4"/>
    <translate z="0.05"/></transform><bsdf type="diffuse"/></shape>)";
  Scene true_scene = floor_of(truth, patch), scene = floor_of(picture(grey), patch);
  const std::vector<std::string> names = [&] {
    std::vector<std::string> result{"wood.reflectance"};
    for (const Parameter& p : list_parameters(scene))
      if (p.owner == Owner::light) result.push_back(p.name);
    return result;
  }();
  REQUIRE(names.size() == 4);
  for (std::size_t k = 1; k < 4; ++k)
    set_parameter(scene, find_parameter(list_parameters(scene), names[k]), 4 + 0.1 * static_cast<double>(k));
  const std::vector<TargetImage> targets{target_from(true_scene)};
  TextureInversionOptions options;
  options.iterations = 150;
  options.spp = 8;
  options.repeats = 4;
  TextureInversion inversion(device(), scene, names, {0}, targets, {}, options);
  TextureInversionState state = inversion.start();
  while (!state.finished) inversion.advance(state);
  for (std::size_t k = 1; k < 4; ++k) {
    const double wanted = find_parameter(list_parameters(true_scene), names[k]).value;
    INFO(names[k] << " " << inversion.number(state, k) << ", " << inversion.number(state, k, -1) << " to "
                  << inversion.number(state, k, 1));
    CHECK(inversion.number(state, k) == Approx(wanted).epsilon(0.05));
    CHECK(inversion.number(state, k, -4) < wanted);
    CHECK(inversion.number(state, k, 4) > wanted);
  }
}

TEST_CASE("a texture's inversion that was stopped ends with the same numbers, of unseen texels too") {
  Scene scene = floor_of(picture(grey)), true_scene = floor_of(picture(painted));
  for (Scene* of : {&scene, &true_scene})  // half of the picture is beyond the floor's edge
    of->bsdfs[0].value("reflectance").to_uv = {0.5, 0, 0, 0, 1, 0};
  const std::vector<TargetImage> targets{target_from(true_scene)};
  TextureInversionOptions options;
  options.iterations = 6;
  options.spp = 2;
  options.smoothness = GENERATE(0.0, 0.1);  // tells of unseen texels, too
  options.repeats = 2;                      // of one iteration each
  options.relative_noise = 0.01;
  TextureInversion inversion(device(), scene, {"wood.reflectance"}, {0}, targets, {}, options);
  REQUIRE(inversion.steps() == 8);
  const TemporaryFolder whole;
  StoredTextureInversion at_once(whole.path().string(), {{"a", 1}}, inversion);
  while (!at_once.state().finished) at_once.advance();
  CHECK(at_once.steps().size() == 8);
  CHECK(std::isinf(at_once.state().squares[3 * (size - 1)]) == (options.smoothness == 0));
  for (const int before : {3, 7}) {
    const TemporaryFolder stopped;
    {
      StoredTextureInversion first(stopped.path().string(), {{"a", 1}}, inversion);
      for (int i = 0; i < before; ++i) first.advance();
    }
    // a step that was written down and not stored
    write_file(stopped / "iterations.jsonl", read_file(stopped / "iterations.jsonl") + "{\"half");
    StoredTextureInversion second(stopped.path().string(), {{"a", 1}}, inversion);
    REQUIRE(second.steps().size() == static_cast<std::size_t>(before));
    while (!second.state().finished) second.advance();
    CHECK(second.state().x == at_once.state().x);
    CHECK(second.state().squares == at_once.state().squares);
    CHECK(read_file(stopped / "iterations.jsonl") == read_file(whole / "iterations.jsonl"));
  }
  const TemporaryFolder damaged;
  const auto open = [&] { return StoredTextureInversion(damaged.path().string(), {{"a", 1}}, inversion); };
  open().advance();
  for (const char* name : {"state.json", "state-1.bin", "iterations.jsonl"}) {
    CAPTURE(name);
    const std::string file = damaged / name, bytes = read_file(file);
    std::string changed = bytes;
    const std::size_t digit = changed.find_last_of("0123456789", changed.size() / 2);
    changed[digit == std::string::npos ? changed.size() / 2 : digit] ^= 1;
    write_file(file, changed);
    CHECK_THROWS_WITH(open(), Catch::Contains("since it was written"));
    write_file(file, bytes);
  }
}

namespace {

// A cube of smoke, lit by a lamp, seen from places.
Scene smoke_in(const TemporaryFolder& folder, const VoxelGrid& grid, const std::string& medium,
               const std::vector<const char*>& places) {
  write_volume_file(folder / "grid.vol", grid);
  std::string sensors;
  for (const char* from : places)
    sensors += R"(<sensor type="perspective"><float name="fov" value="40"/>
      <transform name="to_world"><lookat origin=")" +
               std::string(from) + R"(" target="0, 0, 0" up="0, 0.1, 1"/></transform>
      <film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="16"/></film></sensor>)";
  write_file(folder / "scene.xml", R"(<scene version="3.0.0">
  <integrator type="volpath"><integer name="max_depth" value="16"/></integrator>)" +
                                       sensors + R"(
  <emitter type="constant"><rgb name="radiance" value="0.5, 0.6, 0.7"/></emitter>
  <emitter type="point"><point name="position" x="2" y="-2" z="2"/><rgb name="intensity" value="9, 8, 7"/></emitter>
  <shape type="cube"><bsdf type="null"/><medium name="interior" type="heterogeneous" id="smoke">)" +
                                       medium + "</medium></shape></scene>");
  return load_scene(folder / "scene.xml");
}

std::string grid_called(const std::string& parameter) {
  return "<volume type=\"gridvolume\" name=\"" + parameter + R"("><string name="filename" value="grid.vol"/>
      <transform name="to_world"><scale value="2"/><translate x="-1" y="-1" z="-1"/></transform></volume>)";
}

// Inverts the voxels of a parameter, which all start from `start`: the error that is left, over that at the start.
double error_left(Scene scene, const VoxelGrid& truth, const std::string& parameter, float start,
                  const TextureInversionOptions& options) {
  std::vector<TargetImage> targets;
  std::vector<int> sensors;
  for (int k = 0; k < static_cast<int>(scene.sensors.size()); ++k) {
    RenderOptions of_target;
    of_target.spp = 1024;
    of_target.seed = 77;
    of_target.sensor = k;
    const Rendering image = render(device(), scene, of_target);
    targets.push_back({image.width, image.height, 3, image.mean, std::vector<float>(image.mean.size() / 3, 1.0F), {}});
    sensors.push_back(k);
  }
  VoxelGrid first = truth;
  std::fill(first.data.begin(), first.data.end(), start);
  set_values(scene, find_parameter(list_parameters(scene), parameter), first);
  TextureInversion inversion(device(), scene, {parameter}, sensors, targets, {}, options);
  TextureInversionState state = inversion.start();
  while (state.iteration < options.iterations) inversion.advance(state);
  return rms(inversion.values(state, 0).data, truth.data) / rms(first.data, truth.data);
}

}  // namespace

TEST_CASE("a grid is found from images of what it fills, its empty voxels too") {
  const TemporaryFolder folder;
  VoxelGrid truth;
  truth.width = truth.height = truth.depth = 3;
  for (int i = 0; i < 27; ++i) truth.data.push_back(i % 4 == 0 ? 0.0F : 0.2F * static_cast<float>(i * 5 % 7));
  const Scene scene = smoke_in(folder, truth, grid_called("sigma_t") + "<float name=\"albedo\" value=\"0.6\"/>",
                               {"4, 0, 1", "-2, 3.5, 1", "-2, -3.5, -1", "0.5, 0.5, 4.3"});
  TextureInversionOptions options;
  options.iterations = 120;
  options.spp = 32;
  options.learning_rate = 0.1;
  CHECK(error_left(scene, truth, "smoke.sigma_t", 0, options) < 0.25);
}

// Seen from beside the lamp and against it: from the side light that turns by 90 degrees does not tell g from -g.
TEST_CASE("a grid of a phase function's g is found from what is scattered forwards and back") {
  const TemporaryFolder folder;
  VoxelGrid truth;
  truth.width = truth.height = 2;
  truth.depth = 1;
  truth.data = {-0.4F, 0.3F, 0.7F, 0};
  const Scene scene = smoke_in(folder, truth,
                               "<float name=\"sigma_t\" value=\"1\"/><float name=\"albedo\" value=\"0.9\"/>"
                               "<phase type=\"hg\" id=\"turn\">" +
                                   grid_called("g") + "</phase>",
                               {"2.8, -1.8, 2", "-2, 2.9, -2"});
  TextureInversionOptions options;
  options.iterations = 100;
  options.spp = 32;
  options.learning_rate = 0.1;
  CHECK(error_left(scene, truth, "turn.g", 0.1F, options) < 0.3);
}

TEST_CASE("the gradient of a texture's roughness is its difference") {
  VoxelGrid values;
  values.width = 3;
  values.height = GENERATE(2, 1);
  values.depth = 2 / values.height;
  values.channels = 2;
  values.data = {0.1F, 0.7F, 0.3F, 0.2F, 0.9F, 0.4F, 0.5F, 0.6F, 0.8F, 0.1F, 0.2F, 0.5F};
  std::vector<double> gradient(values.data.size()), ignored(gradient);
  const bool all_around = GENERATE(false, true);
  roughness_of(values, all_around, 2, gradient.data());
  for (std::size_t i = 0; i < values.data.size(); ++i) {
    VoxelGrid more = values, less = values;
    more.data[i] += 0.125F;
    less.data[i] -= 0.125F;
    const double difference =
        (roughness_of(more, all_around, 0, ignored.data()) - roughness_of(less, all_around, 0, ignored.data())) / 0.25;
    CHECK(gradient[i] == Approx(2 * difference).margin(1e-6));
  }
}
