#include "python/src/learn.h"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>

#include "itn/error.h"
#include "itn/loss.h"
#include "itn/trained_network.h"
#include "itn/version.h"
#include "network/dataset/config.h"
#include "network/dataset/render_dataset.h"
#include "network/evaluation/report.h"
#include "network/evaluation/run_evaluation.h"
#include "network/model/input.h"
#include "network/model/threads.h"
#include "network/prediction/predict_images.h"
#include "network/training/training_run.h"
#include "python/src/arrays.h"
#include "python/src/device.h"
#include "python/src/running.h"
#include "python/src/scene.h"
#include "python/src/warning.h"
#include "runtime/base/folder_lock.h"
#include "runtime/base/folder_owner.h"
#include "runtime/base/seconds_since.h"

namespace itn::python {
namespace {

using namespace nb::literals;

nb::dict describe(const NetworkDescription& network) {
  nb::dict result;
  result["kind"] = network.kind;
  result["channels"] = network.channels;
  result["inputs"] = inputs_of(network);
  result["exposure"] = network.exposure;
  result["cut_out"] = network.cut_out;
  result["size"] = network.size;
  result["width"] = network.width;
  result["luminance"] = network.luminance;
  result["mm_per_unit"] = network.mm_per_unit;
  nb::list outputs;
  for (const OutputRange& range : network.outputs)
    outputs.append(nb::make_tuple(range.name, range.low, range.high, range.logarithmic));
  result["outputs"] = outputs;
  result["distribution"] = network.distribution;
  result["spread"] = network.spread;
  return result;
}

nb::dict weights(const Network& network) {
  nb::dict result;
  for (const Tensor& tensor : network.weights())
    result[tensor.name.c_str()] = numpy_array(std::vector<float>(tensor.values), tensor.shape);
  return result;
}

nb::object forward(Network& network, const FloatArray& images) {
  if (images.ndim() != 4) throw UsageError("images: need an array of shape (images, channels, size, size)");
  const auto batch = static_cast<int>(images.shape(0));
  std::vector<float> raw;
  {
    const nb::gil_scoped_release release;
    raw = network.forward({images.data(), images.size()}, batch);
  }
  const std::size_t outputs = raw.size() / images.shape(0);
  return numpy_array(std::move(raw), {images.shape(0), outputs});
}

// The network's input for luminance (size, size) when nothing else is known.
nb::object input(const Network& network, const FloatArray& luminance) {
  const auto size = static_cast<std::size_t>(network.description().size);
  std::vector<float> result(network.image_values());
  network_input(network.description(), {{luminance.data(), luminance.size()}}, result);
  return numpy_array(std::move(result), {result.size() / (size * size), size, size});
}

// Planes (count, size, size) and a mask (size, size), cut out around the object (network/model/input.h).
nb::object cut_out_arrays(const FloatArray& planes, const FloatArray& mask, int size, double share) {
  const auto side = static_cast<std::size_t>(size);
  if (mask.ndim() != 2 || planes.ndim() != 3 || mask.shape(0) != side || mask.shape(1) != side ||
      planes.shape(1) != side || planes.shape(2) != side)
    throw UsageError("cut_out: need planes and a mask of the network's size");
  const CutOut object = cut_out({mask.data(), mask.data() + mask.size()}, size, size, size, share, "mask");
  std::vector<float> seen = cut_planes({planes.data(), planes.data() + planes.size()}, object);
  return nb::make_tuple(numpy_array(std::move(seen), {planes.shape(0), side, side}),
                        numpy_array(std::vector<float>(object.mask.mask), {side, side}));
}

nb::dict predict(const std::vector<std::string>& images, const std::string& run, const SceneObject* scene, int sensor,
                 const std::string& dataset, const std::string& shape_buffers, const std::vector<double>& light,
                 const std::vector<std::string>& mask, const std::vector<std::string>& flash, double longest_side_mm,
                 const std::string& judge, const nb::object& progress) {
  const std::shared_ptr<const Scene> kept = scene ? scene->scene() : nullptr;
  PredictionRequest request{run, images, kept.get(), sensor, dataset, shape_buffers, light, mask, flash};
  request.longest_side_mm = longest_side_mm;
  request.judge = judge;
  const PredictedImages predicted = interruptible(progress, [&](Running& running) {
    std::size_t done = 0;
    return predict_images(request, running.cancel(), [&](const NetworkDescription&, const ImagePrediction&) {
      running.update(static_cast<double>(++done) / static_cast<double>(images.size()));
    });
  });
  nb::list rows, warnings, doubts;  // value, low, high of every parameter
  for (const ImagePrediction& image : predicted.images)
    for (const std::string& warning : image.warnings) warnings.append(warning);
  for (const ImagePrediction& image : predicted.images)
    for (const ParameterEstimate& e : image.parameters) rows.append(nb::make_tuple(e.value, e.low, e.high));
  for (const ImagePrediction& image : predicted.images)
    if (image.verdict) doubts.append(image.verdict->doubt);
  nb::dict result;
  result["doubts"] = doubts;
  result["doubt_limit"] = predicted.doubt_limit ? nb::object(nb::float_(*predicted.doubt_limit)) : nb::none();
  result["network"] = describe(predicted.network);
  result["in_scene"] = predicted.in_scene;
  result["parameters"] = rows;
  result["warnings"] = warnings;
  result["intervals"] = predicted.network.distribution;
  return result;
}

nb::dict dataset(const std::string& config_name, const std::string& folder, int spp, std::optional<std::uint64_t> seed,
                 const nb::object& progress) {
  DatasetConfig config = read_dataset_config(config_name);
  if (spp > 0) config.spp = spp;
  if (seed) config.seed = *seed;
  const DatasetProgress end = interruptible(progress, [&](Running& running) {
    const std::shared_ptr<SharedDevice> device = shared_device();
    const std::lock_guard lock(device->mutex);
    const DeviceInfo& info = device->device.info();
    const DatasetPlan plan = plan_dataset(config, version(), info.name + ", " + info.platform);
    refuse_folder_of_other(folder, "manifest.json");
    const FolderLock folder_lock(folder);
    const auto report = [&](const DatasetProgress& p) {
      running.update(static_cast<double>(p.done) / static_cast<double>(p.total));
    };
    return render_dataset(device->device, plan, folder, report, &running.cancel());
  });
  nb::dict result;
  result["images"] = end.total;
  result["rendered"] = end.rendered;
  return result;
}

// Trains to the end; what there is is stored every minute, and when it is interrupted. Returns run.json's content.
std::string train(const TrainingRequest& request, Running& running) {
  TrainingRun run(request, running.cancel());
  auto saved = std::chrono::steady_clock::now();
  while (!run.finished()) {
    try {
      if (running.cancel()) throw Interrupted();
      run.step();
    } catch (const Interrupted&) {
      run.save();
      throw;
    }
    running.update(run.fraction());
    if (seconds_since(saved) > 60) {
      run.save();
      saved = std::chrono::steady_clock::now();
    }
  }
  run.conclude();
  return run.record().dump();
}

std::string bind_train(const std::vector<std::string>& data, const std::string& unlabelled, const std::string& kind,
                       const std::string& folder, const std::string& init, const std::vector<std::string>& inputs,
                       bool exposure, bool cut_out, std::optional<int> channels, std::optional<int> width,
                       std::optional<int> threads, std::optional<double> lambda, bool distribution, bool mirrored,
                       double noise, int epochs, int batch, int patience, double learning_rate, double weight_decay,
                       std::uint64_t seed, int spp, const nb::object& progress) {
  TrainingRequest request;
  request.data = data;
  request.unlabelled = unlabelled;
  request.kind = kind;
  request.folder = folder;
  request.init = init;
  request.inputs = inputs;
  request.exposure = exposure;
  request.cut_out = cut_out;
  request.channels = channels;
  request.width = width;
  request.threads = threads;
  request.lambda = lambda;
  request.distribution = distribution;
  request.variation.mirrored = mirrored;
  request.variation.noise = noise;
  request.epochs = epochs;
  request.batch = batch;
  request.patience = patience;
  request.learning_rate = learning_rate;
  request.weight_decay = weight_decay;
  request.seed = seed;
  request.spp = spp;
  request.device = shared_device_spec();
  return interruptible(progress, [&](Running& running) { return train(request, running); });
}

std::string evaluate(const EvaluationOptions& options, Running& running) {
  const auto start = std::chrono::steady_clock::now();
  Evaluation e = begin_evaluation(options);
  for (const EvaluatedRun& run : e.runs)
    for (const std::string& text : run.warnings) {
      const nb::gil_scoped_acquire acquire;
      warn(text, 2);
    }
  const FolderLock lock(options.report);
  const EvaluationProgress progress{[](const std::string&, double, const std::string&, double, bool) {},
                                    [&](double fraction) { running.update(fraction); }, [] {}};
  run_evaluation(options, shared_device_spec(), running.cancel(), progress, e);
  e.seconds = seconds_since(start);
  write_evaluation(options.report, e);
  return to_json(e).dump();
}

std::string bind_evaluate(const std::string& data, const std::vector<std::string>& runs, const std::string& report,
                          int images, int inversions, int iterations, double learning_rate, int spp, std::uint64_t seed,
                          std::optional<int> number_of_threads, const nb::object& progress) {
  if (number_of_threads) set_threads(*number_of_threads);
  const EvaluationOptions options{data, runs, report, images, inversions, iterations, learning_rate, spp, seed};
  return interruptible(progress, [&](Running& running) { return evaluate(options, running); });
}

}  // namespace

void bind_learn(nb::module_& module) {
  nb::class_<Network>(module, "Network", "A trained network; itn.torch.network makes a torch module of it.")
      .def_prop_ro("description", [](const Network& n) { return describe(n.description()); })
      .def("weights", &weights, "Of every layer, by name.")
      .def("forward", &forward, "images"_a, "Raw outputs of (images, channels, size, size).")
      .def("input", &input, "luminance"_a);
  module.def(
      "network", [](const std::string& run) { return std::make_unique<Network>(network_of(run)); }, "run"_a);
  module.def(
      "luminance",
      [](const std::string& file, int size) {
        std::vector<float> values = size > 0 ? read_resampled_radiance(file, size, 1).value : std::vector<float>();
        const auto side = static_cast<std::size_t>(size);
        return numpy_array(std::move(values), {side, side});
      },
      "file"_a, "size"_a, "Of a square OpenEXR file, at this size.");
  module.def("cut_out", &cut_out_arrays, "planes"_a, "mask"_a, "size"_a, "share"_a);
  module.def("predict", &predict, "images"_a, "run"_a, "scene"_a.none(), "sensor"_a, "dataset"_a, "shape_buffers"_a,
             "light"_a, "mask"_a, "flash"_a, "longest_side"_a, "judge"_a, "progress"_a.none());
  module.def("dataset", &dataset, "config"_a, "folder"_a, "spp"_a, "seed"_a.none(), "progress"_a.none());
  module.def("train", &bind_train, "data"_a, "unlabelled"_a, "kind"_a, "folder"_a, "init"_a, "inputs"_a, "exposure"_a,
             "cut_out"_a, "channels"_a.none(), "width"_a.none(), "threads"_a.none(), "weight_of_images"_a.none(),
             "distribution"_a, "mirrored"_a, "noise"_a, "epochs"_a, "batch"_a, "patience"_a, "learning_rate"_a,
             "weight_decay"_a, "seed"_a, "spp"_a, "progress"_a.none());
  module.def("evaluate", &bind_evaluate, "data"_a, "runs"_a, "report"_a, "images"_a, "inversions"_a, "iterations"_a,
             "learning_rate"_a, "spp"_a, "seed"_a, "threads"_a.none(), "progress"_a.none());
}

}  // namespace itn::python
