#include "python/src/invert.h"

#include <fmt/format.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <nlohmann/json.hpp>

#include "itn/error.h"
#include "network/prediction/network_start.h"
#include "python/src/arrays.h"
#include "python/src/device.h"
#include "python/src/running.h"
#include "python/src/scene.h"
#include "python/src/target.h"
#include "python/src/warning.h"
#include "runtime/inverse/forward_model.h"
#include "runtime/inverse/gauss_newton/numbers_inversion.h"
#include "runtime/inverse/textures/stored_texture_inversion.h"

namespace itn::python {
namespace {

using namespace nb::literals;

// The arguments of both kinds of inversion.
struct Question {
  std::shared_ptr<const Scene> scene;
  std::vector<std::string> parameters;
  Targets targets;
  std::vector<int> sensors;
  std::string folder, request;  // request: JSON, all that the numbers depend on
  std::uint64_t seed = 0;
  bool single = false;
};

std::vector<TargetImage> images_of(const Targets& targets) {
  std::vector<TargetImage> result;
  for (const std::shared_ptr<TargetImage>& target : targets) result.push_back(*target);
  return result;
}

RenderOptions render_options(const Question& question, const Running& running) {
  RenderOptions options;
  options.seed = question.seed;
  options.op = question.single ? Operator::single : Operator::full;
  options.cancel = &running.cancel();
  return options;
}

nb::list image_arrays(const std::vector<Rendering>& images) {
  nb::list result;
  for (const Rendering& image : images)
    result.append(numpy_array(std::vector<float>(image.mean),
                              {static_cast<std::size_t>(image.height), static_cast<std::size_t>(image.width),
                               static_cast<std::size_t>(image.channels)}));
  return result;
}

using Numbers = std::map<std::string, double>;

struct NumbersFound {
  std::string json;
  std::vector<std::string> verdict, ambiguity;
  std::string failure;
  std::vector<Rendering> images;
};

nb::dict invert_numbers(const SceneObject& object, const std::vector<std::string>& names, const Targets& targets,
                        const std::vector<int>& sensors, const std::string& folder, const std::string& request, int spp,
                        std::uint64_t seed, bool single, const std::string& method, int iterations,
                        const std::optional<double>& relative_noise, double learning_rate, bool exposure,
                        bool white_balance, const Numbers& start, int starts, const NamedIntervals& prior,
                        const std::string& init, const std::string& init_image, const NamedIntervals& range,
                        const std::string& renderings, const std::string& scene_request, const nb::object& progress) {
  Scene scene = *object.scene();
  NetworkGuess guess;
  if (!init.empty()) {
    std::vector<std::string> given;
    for (const auto& [name, value] : start) given.push_back(name);
    guess = interruptible(progress, [&](Running&) {
      return set_network_start(scene, names, given, init, init_image, sensors.front(), {});
    });
    if (!guess.warning.empty()) warn(guess.warning, 2);  // of the line that calls itn.invert()
  }
  for (const auto& [name, value] : start) {
    if (std::find(names.begin(), names.end(), name) == names.end())
      throw UsageError(fmt::format("start: {} is none of the parameters that are asked for", name));
    set_parameter(scene, object.parameter(name), value);
  }
  NumbersQuestion asked;
  asked.scene = scene.file;
  asked.folder = folder;
  asked.targets.assign(targets.size(), "an array");
  asked.method = method;
  asked.spp = spp;
  asked.iterations = iterations;
  asked.starts = starts;
  asked.started = !start.empty() || !init.empty();
  std::vector<TargetImage> images = images_of(targets);
  asked.noise = settle_noise(images, relative_noise);
  asked.learning_rate = learning_rate;
  asked.exposure = exposure;
  asked.white_balance = white_balance;
  asked.prior = prior;
  asked.range = range;
  asked.renderings = renderings;
  asked.seed = seed;
  asked.request = StoredRun::Json::parse(request);
  asked.of_scene = StoredRun::Json::parse(scene_request);
  const Question question{
      std::make_shared<const Scene>(std::move(scene)), names, targets, sensors, folder, request, seed, single};
  check(asked, images);
  const NumbersFound found = interruptible(progress, [&](Running& running) {
    const std::shared_ptr<SharedDevice> device = shared_device();
    const std::lock_guard lock(device->mutex);
    ForwardModel model(device->device, *question.scene, names, sensors, render_options(question, running));
    NumbersWatch watch;
    watch.on_step = [&](const StoredInversion& stored, const InversionStep&, int most) {
      running.update(stored.fraction(most));
    };
    watch.on_rendering = [&](const StoredPosterior& stored, const std::vector<NaturalRange>&) {
      running.update(stored.fraction());
    };
    const NumbersAnswer answer = itn::invert_numbers(
        asked, {guess.prior(model.coordinates()), guess.words(), guess.warning}, *question.scene, images, model, watch);
    return NumbersFound{to_json(answer, model.coordinates()).dump(), verdict(answer, model.coordinates()),
                        ambiguity_words(answer, model.coordinates()), failure(answer), answer.images()};
  });
  nb::dict result;
  result["json"] = found.json;
  result["verdict"] = found.verdict;
  result["ambiguity"] = found.ambiguity;
  result["failure"] = found.failure;
  result["images"] = image_arrays(found.images);
  return result;
}

struct ValuesFound {
  std::vector<Parameter> parameters;
  std::vector<VoxelGrid> values, errors;       // of numbers: empty
  std::vector<std::array<double, 3>> numbers;  // value, low, high; of others: not looked at
  TextureImages seen;
  double loss_at_start = 0;
};

ValuesFound find_values(const Question& question, const std::vector<TargetImage>& targets,
                        const TextureInversionOptions& how, Running& running) {
  const std::shared_ptr<SharedDevice> device = shared_device();
  const std::lock_guard lock(device->mutex);
  TextureInversion inversion(device->device, *question.scene, question.parameters, question.sensors, targets,
                             render_options(question, running), how);
  StoredTextureInversion stored(question.folder, StoredRun::Json::parse(question.request), inversion);
  while (!stored.state().finished) {
    stored.advance();
    running.update(static_cast<double>(stored.steps().size()) / inversion.steps());
  }
  ValuesFound found;
  found.parameters = inversion.parameters();
  for (std::size_t p = 0; p < found.parameters.size(); ++p) {
    const bool has_values = found.parameters[p].has_values();
    found.values.push_back(has_values ? inversion.values(stored.state(), p) : VoxelGrid{});
    found.errors.push_back(has_values && how.repeats > 0 ? inversion.uncertainty(stored.state(), p) : VoxelGrid{});
    if (has_values)
      found.numbers.push_back({});
    else
      found.numbers.push_back({inversion.number(stored.state(), p), inversion.number(stored.state(), p, -1.96),
                               inversion.number(stored.state(), p, 1.96)});
  }
  found.seen = inversion.render(stored.state());
  found.loss_at_start = stored.steps().front().loss;
  return found;
}

nb::dict invert_values(const SceneObject& object, const std::vector<std::string>& names, const Targets& targets,
                       const std::vector<int>& sensors, const std::string& folder, const std::string& request, int spp,
                       std::uint64_t seed, bool single, int iterations, const std::optional<double>& relative_noise,
                       double learning_rate, bool exposure, double smoothness, int repeats,
                       const nb::object& progress) {
  TextureInversionOptions how;
  how.iterations = iterations > 0 ? iterations : how.iterations;
  how.spp = spp > 0 ? spp : how.spp;
  how.learning_rate = learning_rate;
  how.smoothness = smoothness;
  how.exposure = exposure;
  how.repeats = repeats;
  std::vector<TargetImage> images = images_of(targets);
  const TargetNoise noise = settle_noise(images, relative_noise);
  how.relative_noise = noise.relative;
  how.noise_known = noise.known;
  if (how.spp < 2) throw UsageError("spp 1: a loss compares different samples of a pixel; need 2 or more");
  const Question question{object.scene(), names, targets, sensors, folder, request, seed, single};
  ValuesFound found =
      interruptible(progress, [&](Running& running) { return find_values(question, images, how, running); });
  nb::dict values, errors, numbers;
  for (std::size_t p = 0; p < found.parameters.size(); ++p) {
    const char* name = found.parameters[p].name.c_str();
    if (!found.parameters[p].has_values()) {
      numbers[name] = nb::make_tuple(found.numbers[p][0], found.numbers[p][1], found.numbers[p][2]);
      continue;
    }
    VoxelGrid& of = found.values[p];
    std::vector<std::size_t> shape;
    if (found.parameters[p].by_voxels) shape.push_back(static_cast<std::size_t>(of.depth));
    for (const int side : {of.height, of.width, of.channels}) shape.push_back(static_cast<std::size_t>(side));
    values[name] = numpy_array(std::move(of.data), shape);
    if (repeats > 0) errors[name] = numpy_array(std::move(found.errors[p].data), shape);
  }
  nb::dict result;
  result["values"] = values;
  result["stderr"] = errors;
  result["numbers"] = numbers;
  result["loss"] = found.seen.loss.loss;
  result["loss_stderr"] = found.seen.loss.loss_stderr;
  result["loss_at_start"] = found.loss_at_start;
  result["verdict"] = words(found.seen);
  result["converged"] = found.seen.fit();
  result["fit"] = to_json(found.seen.comparison.fit).dump();
  result["misfit"] = to_json(found.seen.comparison.misfit).dump();
  result["images"] = image_arrays(found.seen.images);
  return result;
}

}  // namespace

void bind_invert(nb::module_& module) {
  module.def("invert_numbers", &invert_numbers, "scene"_a, "parameters"_a, "targets"_a, "sensors"_a, "folder"_a,
             "request"_a, "spp"_a, "seed"_a, "single"_a, "method"_a, "iterations"_a, "noise"_a.none(),
             "learning_rate"_a, "exposure"_a, "white_balance"_a, "start"_a, "starts"_a, "prior"_a, "init"_a,
             "init_image"_a, "range"_a, "renderings"_a, "scene_request"_a, "progress"_a.none());
  module.def("invert_values", &invert_values, "scene"_a, "parameters"_a, "targets"_a, "sensors"_a, "folder"_a,
             "request"_a, "spp"_a, "seed"_a, "single"_a, "iterations"_a, "noise"_a.none(), "learning_rate"_a,
             "exposure"_a, "smoothness"_a, "repeats"_a, "progress"_a.none());
}

}  // namespace itn::python
