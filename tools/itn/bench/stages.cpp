#include "tools/itn/bench/stages.h"

#include <chrono>

#include "runtime/base/seconds_since.h"

namespace itn {
namespace {

constexpr double g = 0.5;
constexpr int events = 1000;  // a path

// A camera in the middle of a sphere that no path reaches: each scatters until max_depth ends it. No light is
// connected.
Scene endless_medium() {
  Scene scene;
  Medium& medium = scene.media.emplace_back();
  medium.set("albedo", 1);
  medium.phase.become(*find_model(phase_models(), "hg"));
  medium.phase.set("g", g);
  scene.bsdfs.emplace_back();  // null
  Shape& shape = scene.shapes.emplace_back();
  shape.kind = Shape::Kind::sphere;
  shape.radius = 1e4;  // mean free paths; 1000 events lead some 60 away
  shape.bsdf = 0;
  shape.interior = 0;
  Sensor& sensor = scene.sensors.emplace_back();
  sensor.fov_x = 30;
  sensor.width = sensor.height = sensor.crop_width = sensor.crop_height = 32;
  sensor.filter = FilterKind::box;
  sensor.spp = 128;
  sensor.medium = 0;
  scene.environment.emplace();
  scene.integrator.max_depth = scene.integrator.rr_depth = events;
  return scene;
}

double seconds_of_walk(const Device& device, const cl::Kernel& kernel, std::size_t items) {
  const auto start = std::chrono::steady_clock::now();
  device.launch_at_least(kernel, items);
  device.finish();
  return seconds_since(start);
}

}  // namespace

Rendering time_stages(const Device& device, const Scene& scene, RenderOptions options) {
  options.schedule = Schedule::staged;
  options.time_stages = true;
  render(device, scene, options);
  return render(device, scene, options);
}

nlohmann::ordered_json stages_to_json(const Rendering& image) {
  nlohmann::ordered_json stages = nlohmann::ordered_json::array();
  for (const StageTime& stage : image.stages)
    stages.push_back(
        {{"stage", stage.stage}, {"seconds", stage.seconds}, {"calls", stage.launches}, {"paths", stage.paths}});
  return {{"render_s", image.render_s}, {"paths", image.paths}, {"stages", stages}};
}

ScatteringSpeed scattering_speed(const Device& device, int runs) {
  const Scene scene = endless_medium();
  const int width = device.default_width();
  const std::size_t items =
      64 * static_cast<std::size_t>(std::max(1, device.info().compute_units)) * (device.info().type == "cpu" ? 1 : 64);
  const std::size_t paths = items * static_cast<std::size_t>(width);
  const cl::Program program = device.build("walk.cl", {{"WIDTH", std::to_string(width)}});
  const cl::Buffer out = device.allocate(paths * sizeof(float), "ends of walks");
  cl::Kernel kernel(program, "walk");
  kernel.setArg(0, 1.0F);
  kernel.setArg(1, static_cast<float>(g));
  kernel.setArg(2, cl_int{events});
  kernel.setArg(4, out);

  double rendered = 0, render_s = 0, walked = 0, walk_s = 0;
  for (int run = 0; run <= runs; ++run) {  // the first compiles the kernels
    RenderOptions options;
    options.seed = static_cast<std::uint64_t>(run);
    const Rendering image = render(device, scene, options);
    kernel.setArg(3, static_cast<cl_uint>(run));
    const double seconds = seconds_of_walk(device, kernel, items);
    if (run == 0) continue;
    rendered += static_cast<double>(image.paths) * events;
    render_s += image.render_s;
    walked += static_cast<double>(paths) * events;
    walk_s += seconds;
  }
  return {rendered / render_s, walked / walk_s};
}

}  // namespace itn
