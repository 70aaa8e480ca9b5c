// itn predict: parameters for images, by a network.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "runtime/base/error.h"
#include "runtime/base/inputs.h"
#include "runtime/scene/load.h"
#include "runtime/training/predict_images.h"
#include "runtime/training/trained_network.h"
#include "tools/common.h"
#include "tools/interrupt.h"

namespace itn::tools {
namespace {

struct Options {
  CommonOptions common;
  std::string run, dataset, scene, shape_buffers;
  int sensor = 0;
  std::vector<std::string> images;
  std::vector<double> light;
};

<<<<<<< HEAD
void run(const Options& options) {
  std::optional<Scene> scene;
  if (!options.scene.empty()) {
    scene = load_scene(options.scene, options.common.definition_map(), {.open = options.common.open});
    for (const std::string& text : scene->warnings) warn(options.common, text);
    chosen_sensor(*scene, options.sensor);  // throws where there is none
  }
  const PredictionRequest request{options.run,    options.images,  scene ? &*scene : nullptr,
                                  options.sensor, options.dataset, options.shape_buffers,
                                  options.light};
=======
// Shape and light of the images, for networks of six channels.
class Known {
 public:
  Known(const Options& options, const NetworkDescription& network) : options_(options), network_(network) {
    if (!options.scene.empty()) {
      look_at(load_scene(options.scene, options.common.definition_map(), {.open = options.common.open}));
    } else if (!options.shape_buffers.empty()) {
      shapes_[0] = read_resampled_seen_shape(options.shape_buffers, network.size);
      double square = 0;
      for (const double part : options.light) square += part * part;
      if (!(square > 0 && std::isfinite(square))) throw UsageError("--light: need a direction");
      for (std::size_t i = 0; i < 3; ++i) light_[i] = options.light[i] / std::sqrt(square);
    } else {
      manifest_ = read_manifest(options.dataset);
      for (const Manifest::Image& image : manifest_.images)
        images_[canonical(std::filesystem::path(options.dataset) / image.file)] = &image;
    }
  }

  // What the scene's medium is inside of; none without a scene.
  const std::optional<Body>& body() const { return body_; }

  KnownScene of(const std::string& file) {
    if (view_) return view_->known();
    if (!options_.shape_buffers.empty()) return {shapes_.at(0), light_};
    const auto found = images_.find(canonical(file));
    if (found == images_.end())
      throw InputError(file + ": is no image of the data set " + options_.dataset +
                       "; give --shape-buffers and --light");
    const Manifest::Image& image = *found->second;
    if (!shapes_.count(image.shape)) {
      const std::string& buffers = manifest_.shapes[static_cast<std::size_t>(image.shape)].buffers;
      shapes_[image.shape] = read_resampled_seen_shape((std::filesystem::path(options_.dataset) / buffers).string(),
                                                       network_.size, manifest_.hash);
    }
    return {shapes_.at(image.shape), manifest_.lights[static_cast<std::size_t>(image.light)].direction};
  }

 private:
  void look_at(const Scene& scene) {
    const std::string who = "--scene " + options_.scene;
    for (const std::string& text : scene.warnings) warn(options_.common, text);
    chosen_sensor(scene, options_.sensor);  // throws where there is none
    if (scene.media.size() != 1)
      throw UsageError(fmt::format("{}: the network knows one medium, the scene has {}", who, scene.media.size()));
    body_ = body_of(scene, 0, who);
    if (network_.channels > 1) view_.emplace(scene, options_.sensor, network_.size, *body_, who);
  }

  static std::string canonical(const std::filesystem::path& path) {
    std::error_code error;
    const std::filesystem::path result = std::filesystem::weakly_canonical(path, error);
    return error ? path.string() : result.string();
  }

  const Options& options_;
  const NetworkDescription& network_;
  Manifest manifest_;
  std::map<std::string, const Manifest::Image*> images_;
  std::map<int, SeenShape> shapes_;
  std::array<double, 3> light_{};
  std::optional<Body> body_;
  std::optional<SceneView> view_;
};

void check(const Options& options, const NetworkDescription& network) {
  const bool one_by_one = !options.shape_buffers.empty() || !options.light.empty();
  if (network.channels == 1) {
    if (one_by_one || !options.dataset.empty())
      throw UsageError(options.run +
                       ": its network sees luminance alone; leave out --dataset, --shape-buffers and --light");
  } else if (!options.dataset.empty() + !options.scene.empty() + one_by_one != 1 ||
             options.shape_buffers.empty() != options.light.empty()) {
    throw UsageError(
        options.run +
        ": its network knows shape and light; give --dataset, or --scene, or both --shape-buffers and --light");
  }
}

void run(const Options& options) {
  Inputs inputs;
  Network network = network_of(options.run);
  const NetworkDescription& description = network.description();
  check(options, description);
  std::optional<Known> known;
  if (description.channels > 1 || !options.scene.empty()) known.emplace(options, description);

  const bool in_scene = known && known->body();
>>>>>>> hostile
  nlohmann::ordered_json images = nlohmann::ordered_json::array();
  const auto each = [&](const NetworkDescription& network, const ImagePrediction& image) {
    nlohmann::ordered_json line{{"file", image.file}};
    std::string text = image.file;
    for (std::size_t i = 0; i < image.parameters.size(); ++i) {
      line[network.outputs[i].name] = image.parameters[i];
      text += fmt::format("  {} {:.4g}", network.outputs[i].name, image.parameters[i]);
    }
    images.push_back(std::move(line));
    if (options.common.talkative()) fmt::print("{}\n", text);
  };
  const PredictedImages predicted = predict_images(request, interrupt_flag(), each);
  write_json(options.common, {{"schema", "itn.predict/1"},
                              {"run", options.run},
                              {"network", predicted.network.kind},
                              {"channels", predicted.network.channels},
                              {"mm_per_unit", predicted.network.mm_per_unit},
                              {"unit_of_sigma_t", predicted.in_scene ? "1/scene unit" : "1/mm"},
                              {"images", images}});
}

// Without a RUN before the images it is the shipped one.
void take_run(Options& options) {
  const std::string first = options.images.front();
  options.run = shipped_run;
  if (std::filesystem::path(first).extension() == ".exr" && !is_folder(first)) return;
  options.run = first;
  options.images.erase(options.images.begin());
  if (options.images.empty()) throw UsageError(first + ": is taken for a RUN; which images?");
}

}  // namespace

void add_predict(CLI::App& app) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "predict",
      "parameters for images by a network: sigma_t [1/mm; with --scene 1/scene unit], albedo, g; a line an image");
  command
      ->add_option(
          "images", options->images,
          "[RUN] IMAGE...: folder that itn train wrote or a .safetensors file, else the network that ships with "
          "the program; square OpenEXR files with the channels Y or R G B")
      ->required();
  command->add_option("--dataset", options->dataset,
                      "six channels: the data set that the images belong to; it knows their shape and light");
  command->add_option("--scene", options->scene,
                      "Mitsuba 3 XML file of what the images show: gives shape, light and the unit of length (-D fills "
                      "$name, as for itn render)");
  add_sensor_option(*command, options->sensor);
  command->add_option("--shape-buffers", options->shape_buffers,
                      "six channels: OpenEXR file with the channels normal.X, normal.Y, normal.Z, depth and mask, of "
                      "all images");
  command->add_option("--light", options->light, "six channels: direction to the light, x,y,z")
      ->delimiter(',')
      ->expected(3);
  add_common_options(*command, options->common);
  add_open_option(*command, options->common);
  command->callback([options] {
    take_run(*options);
    run(*options);
  });
}

}  // namespace itn::tools
