// itn invert: from images of a scene to its parameters, with 95 % intervals.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "itn/error.h"
#include "itn/file.h"
#include "itn/load_scene.h"
#include "itn/trained_network.h"
#include "itn/version.h"
#include "network/prediction/network_start.h"
#include "runtime/base/inputs.h"
#include "runtime/base/ranks.h"
#include "runtime/inverse/gauss_newton/numbers_inversion.h"
#include "tools/itn/common.h"
#include "tools/itn/interrupt.h"
#include "tools/itn/invert_textures.h"
#include "tools/itn/named_numbers.h"
#include "tools/itn/progress.h"
#include "tools/itn/target_options.h"

namespace itn::tools {
namespace {

struct InvertArguments {
  CommonOptions common;
  std::string scene, folder, init, renderings, method;
  Operator op = Operator::full;
  TargetOptions images;
  std::vector<std::string> parameters, start, prior, range;
  int iterations = 0, starts = 0;  // not given
  std::optional<double> noise;
  double learning_rate = 0.05;
  bool exposure = false, white_balance = false;
  double smoothness = 0;                  // of textures
  int repeats = 4;                        // of textures
  std::vector<std::string> only_numbers;  // options that were given and mean nothing to textures
};

// Everything that the numbers depend on, but for the method: a folder goes on only with the same.
nlohmann::ordered_json request(const InvertArguments& o, const Device& device, const Inputs& inputs) {
  // the scene, all that it names, and the images
  nlohmann::ordered_json files = nlohmann::ordered_json::object();
  for (const auto& [file, fingerprint] : inputs.fingerprints()) files[file] = fingerprint;
  return {{"version", version()},
          {"files", files},
          {"definitions", o.common.definitions},
          {"targets", o.images.targets},
          {"masks", o.images.masks},
          {"sensors", o.images.sensors},
          {"parameters", o.parameters},
          {"init", o.init.empty() ? "" : network_fingerprint(o.init)},
          {"start", o.start},
          {"starts", o.starts},
          {"prior", o.prior},
          {"range", o.range},
          {"method", o.method},
          {"operator", name_of(o.op)},
          {"iterations", o.iterations},
          {"spp", o.common.spp},
          {"seed", o.common.seed},
          {"noise", o.noise ? StoredRun::Json(*o.noise) : StoredRun::Json()},
          {"exposure", o.exposure},
          {"white_balance", o.white_balance},
          {"curve", {static_cast<int>(o.images.photo.curve.kind), o.images.photo.curve.exponent}},
          {"saturation", o.images.photo.saturation},
          {"learning_rate", o.learning_rate},
          {"device", device.info().name + ", " + device.info().platform}};
}

// Everything that a rendering of the scene depends on, but for the values of the parameters.
nlohmann::ordered_json scene_request(const InvertArguments& o, const Device& device,
                                     const std::map<std::string, std::string>& scene_files) {
  nlohmann::ordered_json files = nlohmann::ordered_json::object();
  for (const auto& [file, fingerprint] : scene_files) files[file] = fingerprint;
  const std::optional<FilmSize>& size = o.images.size;
  return {{"version", version()},
          {"files", files},
          {"definitions", o.common.definitions},
          {"sensors", o.images.sensors},
          {"size", size ? fmt::format("{}x{}", size->width, size->height) : ""},
          {"parameters", o.parameters},
          {"operator", name_of(o.op)},
          {"seed", o.common.seed},
          {"device", device.info().name + ", " + device.info().platform}};
}

// The values of --start, else what the network of --init sees in the first target, else the scene's.
// Returns what that network knows of the parameters.
NetworkGuess set_starts(const InvertArguments& options, Scene& scene) {
  const std::vector<Parameter> all = list_parameters(scene);
  std::vector<std::string> given;
  for (const std::string& text : options.start) given.push_back(named_numbers(text).name);
  NetworkGuess guess;
  if (!options.init.empty())
    guess = set_network_start(scene, options.parameters, given, options.init, options.images.targets.front(),
                              options.images.sensors.front(), options.images.photo);
  if (!guess.warning.empty()) warn(options.common, guess.warning);
  for (const std::string& text : options.start) {
    const NamedNumbers start = named_numbers(text);
    if (std::find(options.parameters.begin(), options.parameters.end(), start.name) == options.parameters.end())
      throw UsageError(fmt::format("--start {}: need NAME=VALUE with a name given to --parameter", text));
    set_parameter(scene, find_parameter(all, start.name), start.numbers.front());
  }
  return guess;
}

// NAME=LOW,HIGH each.
NamedIntervals named_intervals(const std::vector<std::string>& texts) {
  NamedIntervals intervals;
  for (const std::string& text : texts) {
    const NamedNumbers named = named_numbers(text);
    intervals[named.name] = {named.numbers[0], named.numbers[1]};
  }
  return intervals;
}

void print_step(std::size_t start, const InversionStep& step, const std::vector<Coordinate>& coordinates) {
  std::string values;
  for (std::size_t p = 0; p < coordinates.size(); ++p)
    values += fmt::format("  {} {:.5g}", coordinates[p].parameter().name, coordinates[p].value(step.x[p]));
  fmt::print("start {}  iteration {:3}  {:4} spp  loss {:.4g}{}{}\n", start, step.iteration, step.spp, step.loss,
             values, step.accepted ? "" : "  (taken back)");
  std::fflush(stdout);
}

void print_round(std::size_t number, const PosteriorRound& round, const std::vector<NaturalRange>& ranges) {
  std::string values;
  for (std::size_t p = 0; p < ranges.size(); ++p) {
    const auto i = static_cast<Eigen::Index>(p);
    const double low = std::max(-1.0, round.mean[i] - round.deviation[i]),
                 high = std::min(1.0, round.mean[i] + round.deviation[i]);
    values +=
        fmt::format("  {} {:.4g} to {:.4g}", ranges[p].parameter().name, ranges[p].value(low), ranges[p].value(high));
  }
  fmt::print("round {}  {} renderings{}  emulator {:.0f} %\n", number, round.renderings, values,
             100 * round.emulator_share);
  std::fflush(stdout);
}

// outcome: of an inversion or a posterior.
template <class Outcome>
void print(const Outcome& outcome, const std::vector<std::string>& sentences,
           const std::vector<Coordinate>& coordinates) {
  for (const std::string& sentence : sentences) fmt::print("{}\n", sentence);
  for (const auto* list : {&outcome.parameters, &outcome.coefficients, &outcome.exposures})
    for (const Interval& i : *list)
      fmt::print("{:<24} {:>10.5g}   95 %: {:.5g} to {:.5g}{}\n", i.name, i.value, i.low, i.high, mark(i));
  for (const std::string& sentence : ambiguity_words(outcome, coordinates)) fmt::print("{}\n", sentence);
  fmt::print("{}/report.html: {:.1f} s\n", outcome.question.folder, outcome.seconds);
  if (const std::string wrong = failure(outcome); !wrong.empty()) fmt::print("NOT converged: {}\n", wrong);
}

void find_textures(const InvertArguments& options, const Scene& scene, const std::vector<TargetImage>& targets,
                   const TargetNoise& noise, const Device& device, const Inputs& inputs) {
  if (!options.only_numbers.empty())
    throw UsageError(options.only_numbers.front() +
                     ": of numbers alone; textures are found by adam, from the scene's own");
  TextureInversionOptions how;
  how.iterations = options.iterations > 0 ? options.iterations : how.iterations;
  how.spp = options.common.spp > 0 ? options.common.spp : how.spp;
  how.learning_rate = options.learning_rate;
  how.smoothness = options.smoothness;
  how.exposure = options.exposure;
  how.repeats = options.repeats;
  how.relative_noise = noise.relative;
  how.noise_known = noise.known;
  RenderOptions render_options;
  render_options.seed = options.common.seed;
  render_options.op = options.op;
  render_options.cancel = &interrupt_flag();
  render_options.ranks = &world();
  StoredRun::Json asked = request(options, device, inputs);
  asked["smoothness"] = options.smoothness;
  asked["repeats"] = options.repeats;
  invert_textures({options.common, options.scene, options.folder, options.parameters, options.images, how}, scene,
                  targets, device, render_options, asked);
}

NumbersQuestion question_of(const InvertArguments& options, const TargetNoise& noise) {
  NumbersQuestion question;
  question.scene = options.scene;
  question.folder = options.folder;
  question.targets = options.images.targets;
  question.method = options.method;
  question.spp = options.common.spp;
  question.iterations = options.iterations;
  question.starts = options.starts;
  question.started = !options.start.empty() || !options.init.empty();
  question.noise = noise;
  question.learning_rate = options.learning_rate;
  question.exposure = options.exposure;
  question.white_balance = options.white_balance;
  question.prior = named_intervals(options.prior);
  question.range = named_intervals(options.range);
  question.renderings = options.renderings;
  question.seed = options.common.seed;
  question.alone = world().alone();
  return question;
}

void run(InvertArguments options) {
  const CommonOptions& common = options.common;
  const auto begun = std::chrono::steady_clock::now();
  check_folder(options.folder);
  if (!options.renderings.empty()) check_folder(options.renderings);
  Inputs inputs(Inputs::Keep::fingerprints);
  Scene scene = load_scene(options.scene, common.definition_map(), {.size = options.images.size, .open = common.open});
  for (const std::string& text : scene.warnings) warn(common, text);
  const std::map<std::string, std::string> scene_files = inputs.fingerprints();
  const std::vector<Parameter> all = list_parameters(scene);
  for (std::vector<std::string>* texts : {&options.parameters, &options.start, &options.prior, &options.range})
    *texts = by_component(all, *texts);
  std::vector<TargetImage> targets = read_targets(options.images, scene);
  const TargetNoise noise = settle_noise(common, targets, options.noise);
  const bool textures = names_texture(all, options.parameters);
  NumbersQuestion question = question_of(options, noise);
  if (!textures) check(question, targets);
  const Device device(common.device);
  const NetworkGuess guess = set_starts(options, scene);
  inputs.end();
  print_notes(common, targets, !options.exposure);
  if (textures) return find_textures(options, scene, targets, noise, device, inputs);

  question.begun = begun;
  question.request = request(options, device, inputs);
  question.of_scene = scene_request(options, device, scene_files);
  check_outputs(common, {});
  RenderOptions render_options;
  render_options.seed = common.seed;
  render_options.op = options.op;
  render_options.cancel = &interrupt_flag();
  if (options.method != "posterior") render_options.ranks = &world();
  ForwardModel model(device, scene, options.parameters, options.images.sensors, render_options);
  const std::vector<Coordinate>& coordinates = model.coordinates();
  std::optional<Progress> progress;
  std::size_t rounds = 0;
  NumbersWatch watch;
  watch.on_step = [&](const StoredInversion& stored, const InversionStep& step, int most) {
    if (!progress) progress.emplace(options.scene, most, "iterations at most", !common.quiet);
    progress->clear();
    if (common.talkative()) print_step(stored.current(), step, coordinates);
    progress->update(stored.fraction(most));
  };
  watch.on_rendering = [&](const StoredPosterior& stored, const std::vector<NaturalRange>& ranges) {
    if (!progress) progress.emplace(options.scene, stored.most_rounds(), "rounds at most", !common.quiet);
    progress->clear();
    for (const auto& all_rounds = stored.posterior().rounds(); rounds < all_rounds.size(); ++rounds)
      if (common.talkative()) print_round(rounds, all_rounds[rounds], ranges);
    progress->update(stored.fraction());
  };
  const NumbersAnswer answer =
      invert_numbers(question, {guess.prior(coordinates), guess.words(), guess.warning}, scene, targets, model, watch);
  progress.reset();
  if (common.talkative() && answer.posterior) print(*answer.posterior, verdict(*answer.posterior), coordinates);
  if (common.talkative() && !answer.posterior)
    print(*answer.inversion, verdict(*answer.inversion, coordinates), coordinates);
  write_json(common, to_json(answer, coordinates));
  if (!answer.converged())
    throw ResultError(
        fmt::format("invert: not converged: {} {}/report.html shows how far", failure(answer), answer.folder()));
}

}  // namespace

void add_invert(CLI::App& app) {
  auto options = std::make_shared<InvertArguments>();
  CLI::App* command = app.add_subcommand(
      "invert", "Find the parameters of a scene from images of it, with 95 % intervals (analysis by synthesis)");
  command->add_option("scene", options->scene, "Mitsuba 3 XML file")->required();
  command
      ->add_option("--parameter", options->parameters,
                   "Scene parameter to find (itn parameters lists them), or a bitmap or grid, texel by texel or voxel "
                   "by voxel (adam); may be repeated")
      ->required()
      ->take_all();
  command->add_option("-o,--output", options->folder, "Folder for the result: report.html, result.json and images")
      ->required();
  add_target_options(*command, options->images);
  add_noise_option(*command, options->noise);
  command->add_flag("--exposure", options->exposure, "Find a factor on each target, too: its exposure");
  command->add_flag("--white-balance", options->white_balance,
                    "Find a factor on the red and one on the blue of all targets, too (gauss-newton)");
  group_options(*command, "Targets", {"--noise", "--exposure", "--white-balance"});
  command
      ->add_option("--method", options->method,
                   "Weighted least squares (gauss-newton), stochastic gradients (adam), or samples of all materials "
                   "that fit (posterior); default: posterior for up to 8 numbers without a start")
      ->check(CLI::IsMember({"adam", "gauss-newton", "posterior"}));
  command
      ->add_option("--iterations", options->iterations,
                   "Most iterations; default: 50 (gauss-newton), 200 (adam), 8 rounds (posterior)")
      ->check(CLI::Range(1, 1000000));
  command->add_option("--learning-rate", options->learning_rate, "Learning rate of the first iterations (adam)")
      ->check(CLI::Range(1e-6, 10.0))
      ->capture_default_str();
  command->add_option("--renderings", options->renderings,
                      "Folder that keeps renderings of the scene for its next photo (posterior); default: renderings "
                      "in that of --output");
  add_operator_option(*command, options->op);
  group_options(*command, "Method", {"--method", "--iterations", "--learning-rate", "--renderings", "--operator"});
  command
      ->add_option("--init", options->init,
                   "Start from what a network predicts for the first target: RUN of itn train, .safetensors file, or "
                   "nothing for the shipped one; also gauss-newton's prior unless --prior is given")
      ->expected(0, 1)
      ->default_str(shipped_run);
  command->add_option("--start", options->start, "Start from this value, NAME=VALUE; may be repeated")
      ->check(gives_numbers(1, "NAME=VALUE"))
      ->take_all();
  command
      ->add_option("--starts", options->starts,
                   "Number of starts, all but the first at random, of which the best end counts; default: 1 (adam), 4, "
                   "and up to 8 until two agree (gauss-newton)")
      ->check(CLI::Range(1, 1000));
  command
      ->add_option("--prior", options->prior,
                   "Knowledge before the image as a 95 % interval, NAME=LOW,HIGH, which the result combines with the "
                   "image; may be repeated")
      ->check(gives_numbers(2, "NAME=LOW,HIGH"))
      ->take_all();
  command
      ->add_option("--range", options->range,
                   "Range to search, NAME=LOW,HIGH (posterior); default: the valid range if bounded, else a tenth to "
                   "ten times the scene's value; may be repeated")
      ->check(gives_numbers(2, "NAME=LOW,HIGH"))
      ->take_all();
  group_options(*command, "Start and prior", {"--init", "--start", "--starts", "--prior", "--range"});
  command
      ->add_option("--smoothness", options->smoothness,
                   "Weight of the mean squared difference of neighbouring texels or voxels, beside that of the images")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  command
      ->add_option("--repeats", options->repeats,
                   "Repetitions for targets with other noise, of a quarter of the iterations each, whose spread is the "
                   "uncertainty; 0: none")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  group_options(*command, "Textures and grids", {"--smoothness", "--repeats"});
  add_common_options(*command, options->common,
                     "at most 1024, more for few pixels (gauss-newton), 16 (adam), as the targets' noise asks for "
                     "(posterior)");
  add_open_option(*command, options->common);
  add_example(*command, "itn invert wax.xml --target photo.exr --parameter wax.sigma_t --parameter wax.albedo -o fit",
              "The posterior needs no start; Gauss-Newton and Adam start from the scene's values, or from a network's "
              "prediction.\nStopped at any moment, the same command resumes.\nExit code 1, with intervals that are "
              "marked: it has not settled, or the image found does not fit, and it says what the misfit looks like.");
  command->callback([options, command] {
    for (const char* name : {"--init", "--start", "--starts", "--prior", "--white-balance", "--range", "--renderings"})
      if (command->count(name) > 0) options->only_numbers.emplace_back(name);
    if (command->count("--method") > 0 && options->method != "adam")
      options->only_numbers.push_back("--method " + options->method);
    run(*options);
  });
}

}  // namespace itn::tools
