// itn shapes: the closed meshes of the data set, and random ones.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>

#include "itn/error.h"
#include "itn/file.h"
#include "itn/renderer.h"
#include "runtime/image/contact_sheet.h"
#include "runtime/scene/mesh/mesh_file.h"
#include "runtime/scene/mesh/mesh_topology.h"
#include "runtime/scene/mesh/shape_meshes.h"
#include "runtime/scene/shapes/named_shapes.h"
#include "runtime/scene/shapes/polygonise.h"
#include "runtime/scene/shapes/random_shape.h"
#include "runtime/scene/transform.h"
#include "tools/itn/common.h"
#include "tools/itn/interrupt.h"

namespace itn::tools {
namespace {

struct ShapesArguments {
  CommonOptions common;
  std::string output;
  int random = 0;
  bool preview = false;
};

constexpr int tile = 160, columns = 5;  // of the preview [pixels], [tiles]

// The shape, painted, on a floor under sun and sky. The floor is a little lower than z = 0: surfaces that coincide
// have no order.
Scene preview_scene(std::shared_ptr<const Mesh> mesh) {
  Scene scene;
  scene.file = "preview";
  Sensor sensor;
  sensor.fov_x = 28;
  sensor.to_world = look_at({1.1, -2.2, 1.7}, {0, 0, 0.38}, {0, 0, 1});
  sensor.width = sensor.height = sensor.crop_width = sensor.crop_height = tile;
  scene.sensors.push_back(sensor);
  Bsdf paint = make_bsdf("diffuse");
  paint.value("reflectance").value = {0.72, 0.6, 0.42};
  Bsdf ground = paint;
  ground.value("reflectance").value = {0.3, 0.32, 0.35};
  scene.bsdfs = {paint, ground};
  Shape shape, floor;
  shape.mesh = std::move(mesh);
  shape.bsdf = 0;
  Mesh rectangle = rectangle_mesh();
  for (auto& p : rectangle.position) p = {20 * p[0], 20 * p[1], -1e-3F};
  floor.mesh = std::make_shared<const Mesh>(std::move(rectangle));
  floor.bsdf = 1;
  scene.shapes = {shape, floor};
  Environment light = make_environment("sunsky");
  light.sun.direction = normalize(Vec3{-0.9, -0.75, 1});
  light.sun.aperture = 8;
  scene.environment = light;
  return scene;
}

// Every shape, rendered, side by side.
class Preview {
 public:
  Preview(const CommonOptions& common, int count)
      : device_(common.device), spp_(common.spp ? common.spp : 64), sheet_(count, columns, tile) {}

  void add(const std::shared_ptr<const Mesh>& mesh) {
    RenderOptions options;
    options.spp = spp_;
    options.cancel = &interrupt_flag();
    sheet_.add(render(device_, preview_scene(mesh), options).mean, 3);
  }

  void write(const std::string& file) const { sheet_.write(file); }

 private:
  Device device_;
  int spp_;
  ContactSheet sheet_;
};

nlohmann::ordered_json describe(const std::string& name, const std::string& role, const Mesh& mesh) {
  return {{"name", name},
          {"role", role},
          {"file", name + ".ply"},
          {"triangles", mesh.triangle.size()},
          {"vertices", mesh.position.size()},
          {"volume", topology(mesh).volume},
          {"genus", genus(mesh)}};
}

void run(const ShapesArguments& options) {
  const CommonOptions& common = options.common;
  if (common.seed > std::numeric_limits<std::uint64_t>::max() - static_cast<std::uint64_t>(options.random))
    throw UsageError(fmt::format("--seed {} and --random {}: got seeds beyond 2^64 - 1", common.seed, options.random));
  check_folder(options.output);
  make_folder(options.output);
  const auto path = [&](const std::string& name) { return (std::filesystem::path(options.output) / name).string(); };
  check_writable(path("shapes.json"));
  const int count = static_cast<int>(named_shapes().size()) + options.random;
  std::optional<Preview> preview;
  if (options.preview) preview.emplace(common, count);

  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  const auto keep = [&](nlohmann::ordered_json entry, Mesh made) {
    if (interrupt_flag()) throw Interrupted();
    const auto mesh = std::make_shared<const Mesh>(std::move(made));
    write_ply(path(entry["file"]), *mesh);
    if (preview) preview->add(mesh);
    if (common.talkative())
      fmt::print("{:<24} {:<8} {:>7} triangles, volume {:.4f}, genus {}\n", entry["file"].get<std::string>(),
                 entry["role"].get<std::string>(), mesh->triangle.size(), entry["volume"].get<double>(),
                 entry["genus"].get<int>());
    list.push_back(std::move(entry));
  };
  for (const NamedShape& shape : named_shapes()) {
    Mesh mesh = shape.mesh();
    nlohmann::ordered_json entry = describe(shape.name, shape.for_testing ? "test" : "train", mesh);
    keep(std::move(entry), std::move(mesh));
  }
  for (int i = 0; i < options.random; ++i) {
    const std::uint64_t seed = common.seed + static_cast<std::uint64_t>(i);
    const RandomShape shape = random_shape(seed);
    Mesh mesh = shape.mesh();
    nlohmann::ordered_json entry = describe(fmt::format("random_{}", seed), "random", mesh);
    entry["seed"] = seed;
    entry["family"] = shape.family;
    keep(std::move(entry), std::move(mesh));
  }
  const nlohmann::ordered_json result{{"schema", "itn.shapes/1"}, {"shapes", list}};
  write_file(path("shapes.json"), result.dump(2) + "\n");
  if (preview) preview->write(path("shapes.png"));
  write_json(common, result);
}

}  // namespace

void add_shapes(CLI::App& app) {
  auto options = std::make_shared<ShapesArguments>();
  CLI::App* command =
      app.add_subcommand("shapes", "Write the ten closed meshes of the data set, and random ones, as PLY");
  command->add_option("-o,--output", options->output, "Folder to write to; made where it is missing")->required();
  command
      ->add_option("--random", options->random,
                   "Also write this many random shapes, of the seeds --seed, --seed + 1, ...")
      ->check(CLI::Range(0, 1'000'000));
  command->add_flag("--preview", options->preview, "Also write shapes.png, a picture of all of them");
  add_common_options(*command, options->common, "64 (of the preview)");
  add_example(*command, "itn shapes -o shapes --random 20 --preview");
  command->callback([options] { run(*options); });
}

}  // namespace itn::tools
