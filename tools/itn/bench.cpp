// itn bench: paths a second and equal-error efficiency on scenes of its own, beside Mitsuba when asked.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "itn/error.h"
#include "itn/load_scene.h"
#include "itn/renderer.h"
#include "runtime/base/json_text.h"
#include "tools/itn/bench/derivatives.h"
#include "tools/itn/bench/measurement.h"
#include "tools/itn/bench/stages.h"
#include "tools/itn/bench/texture_gradients.h"
#include "tools/itn/common.h"
#include "tools/itn/interrupt.h"

namespace itn::tools {
namespace {

struct BenchArguments {
  CommonOptions common;
  std::string peer, peer_python = ".peers/bin/python", only, scenes;
  int runs = 5;
  bool surfaces = false, volumes = false, stages = false, derivatives = false;
  std::string baselines = "automatic";
};

// A folder that goes away with the object, unless the user named it.
class Folder {
 public:
  explicit Folder(const std::string& wanted) : keep_(!wanted.empty()), path_(wanted) {
    if (keep_) {
      std::error_code error;
      std::filesystem::create_directories(path_, error);
      if (error) throw ResultError("--scenes " + path_ + ": cannot make the folder: " + error.message());
      return;
    }
    std::string pattern = (std::filesystem::temp_directory_path() / "itn-bench-XXXXXX").string();
    if (!mkdtemp(pattern.data()))
      throw ResultError(pattern + ": cannot make a temporary folder; set TMPDIR to one that can be written to");
    path_ = pattern;
  }
  ~Folder() {
    std::error_code ignored;
    if (!keep_) std::filesystem::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  const std::string& path() const { return path_; }

 private:
  bool keep_;
  std::string path_;
};

void print_header(bool peer) {
  fmt::print("{:<26} {:>12} {:>10}", "scene", "Mpaths/s", "rel. var.");
  if (peer) fmt::print(" {:>12} {:>10} {:>8} {:>11} {:>8}", "Mitsuba", "rel. var.", "speed", "efficiency", "z mean");
  fmt::print("\n");
}

void print_row(const BenchRow& row) {
  fmt::print("{:<26} {:>12.3f} {:>10.3g}", row.scene.name, row.paths / row.ours.seconds() * 1e-6,
             row.ours.relative_variance(row.spp));
  if (row.peer)
    fmt::print(" {:>12.3f} {:>10.3g} {:>7.2f}x {:>10.2f}x {:>8.2f}", row.paths / row.peer->seconds() * 1e-6,
               row.peer->relative_variance(row.spp), row.speed_ratio(), row.efficiency_ratio(), row.mean_z());
  fmt::print("\n");
  std::fflush(stdout);
}

nlohmann::ordered_json to_json(const BenchRow& row) {
  const auto side = [&](const Repeats& repeats) {
    return nlohmann::ordered_json{{"paths_per_s", row.paths / repeats.seconds()},
                                  {"render_s", repeats.seconds()},
                                  {"relative_variance", repeats.relative_variance(row.spp)},
                                  {"mean", repeats.image_mean()},
                                  {"mean_stderr", repeats.image_mean_stderr()}};
  };
  nlohmann::ordered_json json{{"scene", row.scene.name}, {"group", row.scene.group}, {"itn", side(row.ours)}};
  if (row.peer) {
    json["mitsuba"] = side(*row.peer);
    json["ratio"] = {{"paths_per_s", row.speed_ratio()}, {"efficiency", row.efficiency_ratio()}};
  }
  return json;
}

void print_stages(const std::string& name, const Rendering& image) {
  fmt::print("{}: {:.3f} Mpaths/s in stages\n", name, static_cast<double>(image.paths) / image.render_s * 1e-6);
  double rest = image.render_s;
  for (const StageTime& stage : image.stages) {
    fmt::print("  {:<16} {:>5.1f} %  {:>6} calls  {:>7.0f} paths a call  {:>7.1f} ns a path\n", stage.stage,
               100 * stage.seconds / image.render_s, stage.launches,
               static_cast<double>(stage.paths) / static_cast<double>(stage.launches),
               1e9 * stage.seconds / static_cast<double>(stage.paths));
    rest -= stage.seconds;
  }
  fmt::print("  {:<16} {:>5.1f} %\n", "film, queues", 100 * rest / image.render_s);
  std::fflush(stdout);
}

void time_stages_of(const Device& device, const std::vector<BenchScene>& scenes, const BenchArguments& options,
                    nlohmann::ordered_json& result) {
  if (options.common.talkative())
    fmt::print(
        "\ntime per stage, each launched and waited for by itself (the fused schedule cannot be timed inside)\n");
  RenderOptions render_options;
  render_options.spp = options.common.spp;
  render_options.seed = options.common.seed;
  render_options.cancel = &interrupt_flag();
  for (const BenchScene& scene : scenes) {
    const Rendering image = time_stages(device, load_scene(scene.file), render_options);
    if (options.common.talkative()) print_stages(scene.name, image);
    object_in(result, "stages")[scene.name] = stages_to_json(image);
  }
  const ScatteringSpeed speed = scattering_speed(device, options.runs);
  if (options.common.talkative())
    fmt::print("\nscattering in an endless medium: {:.0f} million events/s; the bare walk {:.0f}\n",
               speed.renderer * 1e-6, speed.walk * 1e-6);
  result["scattering_events_per_s"] = {{"renderer", speed.renderer}, {"bare_walk", speed.walk}};
}

void cost_of_derivatives(const Device& device, MitsubaPeer* peer, const std::vector<BenchScene>& scenes,
                         const BenchArguments& options, nlohmann::ordered_json& result) {
  const bool talk = options.common.talkative();
  if (talk) {
    fmt::print(
        "\nimage with derivatives by sigma_t, albedo and g: time over that of the image alone{}\n",
        peer ? "; speed beside prbvolpath's value and gradient; z and efficiency of the derivatives of the mean" : "");
    fmt::print("{:<26} {:>6}", "scene", "cost");
    if (peer)
      for (const char* title : {"speed", "z sigma_t", "z albedo", "z g", "efficiency: sigma_t", "albedo", "g"})
        fmt::print(" {:>9}", title);
    fmt::print("\n");
  }
  RenderOptions render_options;
  render_options.spp = options.common.spp;
  render_options.seed = options.common.seed;
  render_options.cancel = &interrupt_flag();
  render_options.baselines = options.baselines == "on"    ? Baselines::on
                             : options.baselines == "off" ? Baselines::off
                                                          : Baselines::automatic;
  double speeds = 0;
  for (const BenchScene& scene : scenes) {
    const DerivativeCost cost =
        derivative_cost(device, load_scene(scene.file), scene.file, render_options, options.runs, peer);
    nlohmann::ordered_json json{{"cost", cost.derivatives_s / cost.value_s}};
    if (talk) fmt::print("{:<26} {:>6.3f}", scene.name, cost.derivatives_s / cost.value_s);
    if (peer) {
      const double speed = cost.peer_s / cost.derivatives_s;
      speeds += std::log(speed) / static_cast<double>(scenes.size());
      json["speed"] = speed;
      if (talk) fmt::print(" {:>8.1f}x", speed);
      std::array<double, 3> efficiency{};
      for (std::size_t k = 0; k < 3; ++k) {
        const MeanDerivative &a = cost.ours[k], &b = cost.peer[k];
        const double z = (a.value - b.value) / std::hypot(a.stderr_, b.stderr_);
        efficiency[k] = speed * b.variance / a.variance;
        json[derivative_names[k]] = {
            {"itn", a.value}, {"itn_stderr", a.stderr_},    {"mitsuba", b.value}, {"mitsuba_stderr", b.stderr_},
            {"z", z},         {"efficiency", efficiency[k]}};
        if (talk) fmt::print(" {:>9.2f}", z);
      }
      if (talk)
        for (const double e : efficiency) fmt::print(" {:>8.1f}x", e);
    }
    if (talk) fmt::print("\n");
    std::fflush(stdout);
    object_in(result, "derivatives")[scene.name] = json;
  }
  if (!peer) return;
  object_in(object_in(result, "geometric_mean"), "all")["value_and_gradient"] = std::exp(speeds);
  if (talk) fmt::print("{:<40} speed {:>6.2f}x\n", "value and gradient, geometric mean", std::exp(speeds));
}

void cost_of_texture_gradients(const Device& device, MitsubaPeer* peer, const std::vector<BenchScene>& scenes,
                               const BenchArguments& options, nlohmann::ordered_json& result) {
  const bool talk = options.common.talkative();
  if (talk) {
    fmt::print(
        "\ngradient of the mean by 512 x 512 texels or 256 x 256 x 256 voxels, image included: time over that of the "
        "image alone{}\n",
        peer ? "; speed beside prb's or prbvolpath's, z of the derivative by a factor on them all, efficiency by the "
               "variance of those that are not 0"
             : "");
    fmt::print("{:<26} {:>6}", "scene", "cost");
    if (peer) fmt::print(" {:>9} {:>9} {:>11}", "speed", "z sum", "efficiency");
    fmt::print("\n");
  }
  RenderOptions render_options;
  render_options.spp = options.common.spp;
  render_options.seed = options.common.seed;
  render_options.cancel = &interrupt_flag();
  double speeds = 0, efficiencies = 0, count = 0;
  for (const BenchScene& scene : scenes) {
    if (scene.texture.empty()) continue;
    const TextureGradientCost cost = texture_gradient_cost(device, load_scene(scene.file), scene.file, scene.texture,
                                                           render_options, options.runs, peer);
    nlohmann::ordered_json json{{"cost", cost.ours.seconds / cost.value_s}, {"itn_s", cost.ours.seconds}};
    if (talk) fmt::print("{:<26} {:>6.3f}", scene.name, cost.ours.seconds / cost.value_s);
    if (peer) {
      const double speed = cost.peer.seconds / cost.ours.seconds,
                   z = (cost.ours.sum - cost.peer.sum) / std::hypot(cost.ours.stderr_, cost.peer.stderr_),
                   efficiency = speed * cost.peer.variance / cost.ours.variance;
      speeds += std::log(speed);
      efficiencies += std::log(efficiency);
      ++count;
      json.update({{"mitsuba_s", cost.peer.seconds}, {"speed", speed}, {"z", z}, {"efficiency", efficiency}});
      if (talk) fmt::print(" {:>8.2f}x {:>9.2f} {:>10.2f}x", speed, z, efficiency);
    }
    if (talk) fmt::print("\n");
    std::fflush(stdout);
    object_in(result, "texture_gradients")[scene.name] = json;
  }
  if (!peer || count == 0) return;
  const double speed = std::exp(speeds / count), efficiency = std::exp(efficiencies / count);
  nlohmann::ordered_json& means = object_in(object_in(result, "geometric_mean"), "all");
  means["texture_gradient"] = speed;
  means["texture_gradient_efficiency"] = efficiency;
  if (talk) fmt::print("{:<40} speed {:>6.2f}x  efficiency {:>8.2f}x\n", "gradient, geometric mean", speed, efficiency);
}

void run(const BenchArguments& options) {
  if (!options.common.definitions.empty())
    throw UsageError("-D " + options.common.definitions.front() + ": bench makes its own scenes, which have no $name");
  if (options.surfaces && options.volumes) throw UsageError("--surfaces --volumes: one at a time");
  const bool compare = !options.peer.empty();
  const Device device(options.common.device);
  const Folder folder(options.scenes);
  std::unique_ptr<MitsubaPeer> peer;
  if (compare)
    peer = std::make_unique<MitsubaPeer>(options.peer_python, folder.path(),
                                         device.info().type == "cpu" ? "llvm_ad_rgb" : "cuda_ad_rgb");

  std::vector<BenchScene> scenes = (options.surfaces  ? write_surface_scenes
                                    : options.volumes ? write_volume_scenes
                                                      : write_media_scenes)(folder.path());
  std::erase_if(scenes, [&](const BenchScene& scene) { return scene.name.find(options.only) == std::string::npos; });
  if (scenes.empty()) throw UsageError("--only " + options.only + ": no scene of the bench has this in its name");

  nlohmann::ordered_json result{
      {"schema", "itn.bench/1"},
      {"device", {{"platform", device.info().platform}, {"name", device.info().name}, {"type", device.info().type}}},
      {"runs", options.runs},
      {"seed", options.common.seed},
      {"rows", nlohmann::ordered_json::array()}};
  if (options.common.talkative()) {
    fmt::print("{} ({}){}; 128x128, medians of {} runs, relative variance of one sample of a pixel\n\n",
               device.info().name, device.info().platform, compare ? ", beside Mitsuba " + peer->version() : "",
               options.runs);
    print_header(compare);
  }
  const BenchOptions how{options.runs, options.common.spp, options.common.seed, &interrupt_flag()};
  std::vector<BenchRow> rows;
  for (const BenchScene& scene : scenes) {
    rows.push_back(measure(device, peer.get(), scene, how));
    if (options.common.talkative()) print_row(rows.back());
    result["rows"].push_back(to_json(rows.back()));
  }
  if (compare) {
    result["mitsuba"] = peer->version();
    if (options.common.talkative()) fmt::print("\ngeometric means\n");
    for (const GeometricMean& mean : geometric_means(rows)) {
      const std::string label = mean.group.empty() ? "all" : mean.group;
      if (options.common.talkative())
        fmt::print("{:<40} speed {:>6.2f}x   equal-error efficiency {:>7.2f}x\n", label, mean.speed, mean.efficiency);
      object_in(result, "geometric_mean")[label] = {{"paths_per_s", mean.speed}, {"efficiency", mean.efficiency}};
    }
  }
  if (options.derivatives)
    (options.surfaces || options.volumes ? cost_of_texture_gradients : cost_of_derivatives)(device, peer.get(), scenes,
                                                                                            options, result);
  if (options.stages) time_stages_of(device, scenes, options, result);
  write_json(options.common, result);
}

}  // namespace

void add_bench(CLI::App& app) {
  auto options = std::make_shared<BenchArguments>();
  CLI::App* command =
      app.add_subcommand("bench", "Measure speed and equal-error efficiency, beside Mitsuba 3 when asked");
  command->add_flag("--surfaces", options->surfaces, "Measure surfaces without media, beside Mitsuba's path and prb");
  command->add_flag("--volumes", options->volumes, "Measure grids of voxels, beside Mitsuba's volpath");
  command->add_flag("--derivatives", options->derivatives,
                    "Also measure derivatives by sigma_t, albedo and g, or by all texels or voxels; with --peer beside "
                    "prbvolpath or prb (standard errors from 3 runs on)");
  command->add_flag("--stages", options->stages,
                    "Also time the stages of each scene, and scattering beside a bare walk without a scene");
  command->add_option("--only", options->only, "Measure only the scenes with this in their name");
  group_options(*command, "What is measured", {"--surfaces", "--volumes", "--derivatives", "--stages", "--only"});
  command->add_option("--runs", options->runs, "Images per scene and renderer (default: 5)")
      ->check(CLI::Range(2, 1000));
  command
      ->add_option("--baselines", options->baselines,
                   "Use baselines in the derivatives, which take noise away and add time")
      ->check(CLI::IsMember({"automatic", "on", "off"}))
      ->capture_default_str();
  command->add_option("--scenes", options->scenes, "Keep the scene files in this folder");
  group_options(*command, "How it is measured", {"--runs", "--baselines", "--scenes"});
  command->add_option("--peer", options->peer, "Also render with this renderer")->check(CLI::IsMember({"mitsuba"}));
  command->add_option("--peer-python", options->peer_python,
                      "Python that has Mitsuba (default: .peers/bin/python, where tools/peers puts it)");
  group_options(*command, "Comparison", {"--peer", "--peer-python"});
  add_common_options(*command, options->common);
  add_example(*command, "itn bench --peer mitsuba --runs 3 --derivatives");
  command->callback([options] { run(*options); });
}

}  // namespace itn::tools
