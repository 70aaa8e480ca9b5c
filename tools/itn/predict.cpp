// itn predict: parameters for images, by a network.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "itn/error.h"
#include "itn/file.h"
#include "itn/load_scene.h"
#include "itn/trained_network.h"
#include "network/prediction/predict_images.h"
#include "network/prediction/prediction_errors.h"
#include "runtime/base/inputs.h"
#include "tools/itn/common.h"
#include "tools/itn/interrupt.h"
#include "tools/itn/progress.h"
#include "tools/itn/target_options.h"

namespace itn::tools {
namespace {

struct PredictArguments {
  CommonOptions common;
  std::string run, judge, dataset, scene, shape_buffers;
  int sensor = 0;
  std::vector<std::string> images;
  std::vector<double> light;
  std::vector<std::string> mask, flash;
  double longest_side = 0;
  PhotoOptions photo;
};

// The errors on a data set's test images.
nlohmann::ordered_json report_errors(const CommonOptions& common, const Manifest& set,
                                     const PredictedImages& predicted) {
  nlohmann::ordered_json json;
  if (common.talkative())
    fmt::print("{:10} {:>16} {:>13} {:>21} {:>18}\n", "", "root mean square", "mean absolute", "share of a constant's",
               "intervals that hold");
  for (const ParameterError& error : errors_on(set, predicted)) {
    const double share = error.mean_absolute / error.constant;
    const bool has_intervals = std::isfinite(error.held);
    json[error.name] = {{"root_mean_square", error.root_mean_square},
                        {"mean_absolute", error.mean_absolute},
                        {"constant", error.constant},
                        {"held", has_intervals ? nlohmann::ordered_json(error.held) : nlohmann::ordered_json()}};
    if (common.talkative())
      fmt::print("{:10} {:16.4g} {:13.4g} {:21.3f} {:>18}\n", error.name, error.root_mean_square, error.mean_absolute,
                 share, has_intervals ? fmt::format("{:.3f}", error.held) : "");
  }
  return json;
}

// A judge on a data set's test images.
void report_judge(const PredictArguments& options, Network& judge, const Manifest& set) {
  const NetworkDescription& description = judge.description();
  const JudgeErrors errors = errors_of_judge(judge, options.dataset, set, options.common.seed, interrupt_flag());
  nlohmann::ordered_json result{{"schema", "itn.predict/2"},
                                {"run", options.run},
                                {"network", description.kind},
                                {"doubt_limit", description.limit},
                                {"false_alarms", errors.false_alarms}};
  std::string text = fmt::format("doubted: {:.1f} % of those with nothing wrong", 100 * errors.false_alarms);
  for (std::size_t f = 0; f < errors.found.size(); ++f) {
    result["found"][description.outputs[1 + f].name] = errors.found[f];
    text += fmt::format(", {} {:.0f} %", description.outputs[1 + f].name, 100 * errors.found[f]);
  }
  if (options.common.talkative()) fmt::print("{}\n", text);
  write_json(options.common, result);
}

void run(PredictArguments options) {
  if (!options.dataset.empty()) refuse_inside(options.dataset, {options.common.json});
  std::optional<Manifest> tested;
  if (options.images.empty()) {
    tested = read_complete_manifest(options.dataset);
    options.images = test_images(options.dataset, *tested);
    if (Network network = network_of(options.run); is_judge(network.description()))
      return report_judge(options, network, *tested);
  }
  Inputs inputs;
  std::optional<Scene> scene;
  if (!options.scene.empty()) {
    scene = load_scene(options.scene, options.common.definition_map(), {.open = options.common.open});
    for (const std::string& text : scene->warnings) warn(options.common, text);
    chosen_sensor(*scene, options.sensor);  // throws where there is none
  }
  PredictionRequest request{options.run, options.images, scene ? &*scene : nullptr, options.sensor};
  request.dataset = options.dataset;
  request.test_images = tested.has_value();
  request.shape_buffers = options.shape_buffers;
  request.light = options.light;
  request.mask = options.mask;
  request.flash = options.flash;
  request.longest_side_mm = options.longest_side;
  request.photo = options.photo;
  request.judge = options.judge;
  nlohmann::ordered_json images = nlohmann::ordered_json::array();
  int doubted = 0;
  const auto each = [&](const NetworkDescription& network, const ImagePrediction& image) {
    nlohmann::ordered_json line{{"file", image.file}};
    std::string text = image.file;
    for (std::size_t i = 0; i < image.parameters.size(); ++i) {
      const ParameterEstimate& estimate = image.parameters[i];
      line[network.outputs[i].name] = {{"value", estimate.value}, {"low", estimate.low}, {"high", estimate.high}};
      if (image.verdict) line[network.outputs[i].name]["holds"] = !image.verdict->doubted;
      text += fmt::format("  {} {:.4g}", network.outputs[i].name, estimate.value);
      if (std::isfinite(estimate.low)) text += fmt::format(" ({:.4g} to {:.4g})", estimate.low, estimate.high);
    }
    if (image.verdict) {
      line["doubt"] = image.verdict->doubt;
      line["doubted"] = image.verdict->doubted;
      doubted += image.verdict->doubted;
      if (image.verdict->doubted) text += "  (doubted: does not hold)";
    }
    images.push_back(std::move(line));
    if (!tested)
      for (const std::string& warning : image.warnings) warn(options.common, warning);
    if (options.common.talkative() && !tested) fmt::print("{}\n", text);
  };
  const PredictedImages predicted = predict_images(request, interrupt_flag(), each);
  nlohmann::ordered_json result{{"schema", "itn.predict/2"},
                                {"run", options.run},
                                {"network", predicted.network.kind},
                                {"channels", predicted.network.channels},
                                {"mm_per_unit", predicted.network.mm_per_unit},
                                {"unit_of_sigma_t", predicted.in_scene ? "1/scene unit" : "1/mm"},
                                {"images", images}};
  if (predicted.doubt_limit) result["doubt_limit"] = *predicted.doubt_limit;
  if (tested) result["errors"] = report_errors(options.common, *tested, predicted);
  if (tested && predicted.doubt_limit && options.common.talkative())
    fmt::print("{} of {} images are doubted\n", doubted, predicted.images.size());
  write_json(options.common, result);
}

// Without a RUN before the images it is a shipped one: with photos by flash the one for those.
void take_run(PredictArguments& options) {
  const std::string first = options.images.front();
  const std::string extension = std::filesystem::path(first).extension().string();
  constexpr std::array<const char*, 6> pictures{".exr", ".png", ".jpg", ".jpeg", ".tif", ".tiff"};
  options.run = options.flash.empty() ? shipped_run : shipped_photos_run;
  if (std::find(pictures.begin(), pictures.end(), extension) != pictures.end() && !is_folder(first)) return;
  options.run = first;
  options.images.erase(options.images.begin());
  if (options.images.empty() && (options.dataset.empty() || !options.scene.empty()))
    throw UsageError(first + ": is taken for a RUN; which images?");
}

}  // namespace

void add_predict(CLI::App& app) {
  auto options = std::make_shared<PredictArguments>();
  CLI::App* command = app.add_subcommand(
      "predict", "Predict optical properties from images with a network: a line per image with sigma_t, albedo and g");
  command
      ->add_option("images", options->images,
                   "[RUN] IMAGE...: a network (RUN of itn train, .safetensors file, `shipped`, `shipped-photos`), then "
                   "images; RUN alone, with --dataset, predicts the set's test images and tells the errors")
      ->required();
  command->add_option("--judge", options->judge,
                      "Network of itn train --network judge that tells how much it doubts each image; `shipped-photos` "
                      "has one of its own");
  command->add_option("--dataset", options->dataset,
                      "Data set that the images belong to; it knows their shape, light, mask and flash");
  command->add_option("--scene", options->scene,
                      "Mitsuba 3 XML file of what the images show; it gives shape, light and the unit of length");
  add_sensor_option(*command, options->sensor);
  command->add_option("--shape-buffers", options->shape_buffers,
                      "OpenEXR file with the channels normal.X, normal.Y, normal.Z, depth and mask, of all images, for "
                      "networks of six channels");
  command->add_option("--light", options->light, "Direction to the light, x,y,z, for networks of six channels")
      ->delimiter(',')
      ->expected(3);
  command
      ->add_option("--mask", options->mask,
                   "Picture with the object in white, or OpenEXR (channel mask, Y, or R G B), of each image or of all, "
                   "for networks that see a mask")
      ->take_all();
  command
      ->add_option("--flash", options->flash,
                   "The same photo as each image with the flash on, by the same exposure, for networks that see a "
                   "flash")
      ->take_all();
  command
      ->add_option("--longest-side", options->longest_side,
                   "Longest side of the object [mm], for sigma_t; default: that of objects in the network's data set")
      ->check(CLI::Range(1e-6, 1e9));
  group_options(
      *command, "What the images show",
      {"--dataset", "--scene", "--sensor", "--shape-buffers", "--light", "--mask", "--flash", "--longest-side"});
  add_curve_option(*command, options->photo.curve);
  command
      ->add_option("--white", options->photo.white,
                   "Radiance that the largest sample of photos stands for; networks know how bright things are")
      ->check(CLI::Range(1e-6, 1e6))
      ->capture_default_str()
      ->group("Photos");
  add_common_options(*command, options->common);
  add_open_option(*command, options->common);
  add_example(
      *command, "itn predict photo.png --flash flash.png --mask mask.png --longest-side 60",
      "sigma_t is in 1/mm, with --scene in 1/scene unit. Without RUN the network is `shipped`, with --flash "
      "`shipped-photos`.\nImages are OpenEXR files with the channels Y or R G B, or photos as PNG, JPEG or TIFF. "
      "They are square; networks that see the object alone, as `shipped-photos` does, take any shape.");
  command->callback([options] {
    take_run(*options);
    run(*options);
  });
}

}  // namespace itn::tools
