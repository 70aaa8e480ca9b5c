// itn invert: from images of a scene to its parameters, with 95 % intervals.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <map>
#include <nlohmann/json.hpp>

#include "runtime/base/error.h"
#include "runtime/base/file.h"
#include "runtime/base/inputs.h"
#include "runtime/base/seconds_since.h"
#include "runtime/base/version.h"
#include "runtime/cluster/ranks.h"
#include "runtime/inversion/inversion_report.h"
#include "runtime/scene/load.h"
#include "runtime/training/network_start.h"
#include "runtime/training/trained_network.h"
#include "tools/common.h"
#include "tools/interrupt.h"
#include "tools/invert_posterior.h"
#include "tools/invert_textures.h"
#include "tools/named_numbers.h"
#include "tools/progress.h"
#include "tools/target_options.h"

namespace itn::tools {
namespace {

struct InvertArguments {
  CommonOptions common;
  std::string scene, folder, init, renderings, method = "gauss-newton";
  Operator op = Operator::full;
  TargetOptions images;
  std::vector<std::string> parameters, start, prior, range;
  int starts = 1;
  double noise = -1;      // not given
  double smoothness = 0;  // of textures
  int repeats = 4;        // of textures
  // Options that were given and mean something to the posterior alone, and to the others alone.
  std::vector<std::string> only_posterior, no_posterior;
  std::vector<std::string> only_numbers;  // options that were given and mean nothing to textures
  InversionOptions inversion;
};

// Everything that the numbers depend on: a folder goes on only with the same.
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
          {"iterations", o.inversion.iterations},
          {"spp", o.common.spp},
          {"seed", o.common.seed},
          {"noise", o.noise},
          {"exposure", o.inversion.exposure},
          {"white_balance", o.inversion.white_balance},
          {"curve", {static_cast<int>(o.images.photo.curve.kind), o.images.photo.curve.exponent}},
          {"saturation", o.images.photo.saturation},
          {"learning_rate", o.inversion.learning_rate},
          {"device", device.info().name + ", " + device.info().platform}};
}

// What a rendering of the scene depends on, but for the values of the parameters.
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
  for (const std::string& text : options.start) {
    const NamedNumbers start = named_numbers(text);
    if (std::find(options.parameters.begin(), options.parameters.end(), start.name) == options.parameters.end())
      throw UsageError(fmt::format("--start {}: need NAME=VALUE with a name given to --parameter", text));
    set_parameter(scene, find_parameter(all, start.name), start.numbers.front());
  }
  return guess;
}

Prior prior_of(const InvertArguments& options, const std::vector<Coordinate>& coordinates) {
  Prior prior;
  for (const std::string& text : options.prior) {
    const NamedNumbers known = named_numbers(text);
    const auto found = std::find_if(coordinates.begin(), coordinates.end(),
                                    [&](const Coordinate& c) { return c.parameter().name == known.name; });
    if (found == coordinates.end())
      throw UsageError(fmt::format("--prior {}: need NAME=LOW,HIGH with a name given to --parameter", text));
    const double low = known.numbers[0], high = known.numbers[1];
    const Parameter& parameter = found->parameter();
    if (!parameter.contains(low) || !parameter.contains(high) || !(low < high))
      throw UsageError(
          fmt::format("--prior {}: need LOW,HIGH, two numbers in {}, the smaller first", text, parameter.range()));
    prior.add_interval(coordinates, static_cast<std::size_t>(found - coordinates.begin()), low, high);
  }
  return prior;
}

void print_step(std::size_t start, const InversionStep& step, const std::vector<Coordinate>& coordinates) {
  std::string values;
  for (std::size_t p = 0; p < coordinates.size(); ++p)
    values += fmt::format("  {} {:.5g}", coordinates[p].parameter().name, coordinates[p].value(step.x[p]));
  fmt::print("start {}  iteration {:3}  {:4} spp  loss {:.4g}{}{}\n", start, step.iteration, step.spp, step.loss,
             values, step.accepted ? "" : "  (taken back)");
  std::fflush(stdout);
}

void print(const InversionOutcome& outcome, const std::vector<Coordinate>& coordinates) {
  for (const std::string& sentence : verdict(outcome, coordinates)) fmt::print("{}\n", sentence);
  for (const auto* list : {&outcome.parameters, &outcome.coefficients, &outcome.exposures})
    for (const Interval& i : *list)
      fmt::print("{:<24} {:>10.5g}   95 %: {:.5g} to {:.5g}\n", i.name, i.value, i.low, i.high);
  for (const std::string& sentence : ambiguity_words(outcome, coordinates)) fmt::print("{}\n", sentence);
  fmt::print("{}/report.html: {:.1f} s\n", outcome.question.folder, outcome.seconds);
}

void find_textures(const InvertArguments& options, const Scene& scene, const std::vector<TargetImage>& targets,
                   const Device& device, const Inputs& inputs) {
  if (!options.only_numbers.empty())
    throw UsageError(options.only_numbers.front() +
                     ": of numbers alone; textures are found by adam, from the scene's own");
  TextureInversionOptions how;
  how.iterations = options.inversion.iterations > 0 ? options.inversion.iterations : how.iterations;
  how.spp = options.common.spp > 0 ? options.common.spp : how.spp;
  how.learning_rate = options.inversion.learning_rate;
  how.smoothness = options.smoothness;
  how.exposure = options.inversion.exposure;
  how.repeats = options.repeats;
  how.relative_noise = relative_noise(options.noise, targets);
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

void find_posterior(const InvertArguments& options, const Scene& scene, const std::vector<TargetImage>& targets,
                    ForwardModel& model, const StoredRun::Json& of_scene, const StoredRun::Json& asked) {
  PosteriorQuestion question{options.common,
                             {options.scene, options.method, options.folder, options.images.targets, options.prior,
                              errors_known(targets) || options.noise >= 0},
                             options.parameters,
                             options.range,
                             options.images,
                             prior_of(options, model.coordinates()),
                             {},
                             options.renderings.empty() ? options.folder + "/renderings" : options.renderings};
  PosteriorOptions& how = question.posterior;
  if (options.inversion.iterations > 0) how.rounds = options.inversion.iterations;
  how.spp = options.common.spp;
  how.seed = options.common.seed;
  how.relative_noise = relative_noise(options.noise, targets);
  how.exposure = options.inversion.exposure;
  invert_posterior(question, scene, targets, model, of_scene, asked);
}

void run(InvertArguments options) {
  const CommonOptions& common = options.common;
  const auto seconds = [start = std::chrono::steady_clock::now()] { return seconds_since(start); };
  check_folder(options.folder);
  Inputs inputs(Inputs::Keep::fingerprints);
  Scene scene = load_scene(options.scene, common.definition_map(), {.size = options.images.size, .open = common.open});
  for (const std::string& text : scene.warnings) warn(common, text);
  const std::map<std::string, std::string> scene_files = inputs.fingerprints();
  const std::vector<Parameter> all = list_parameters(scene);
  for (std::vector<std::string>* texts : {&options.parameters, &options.start, &options.prior, &options.range})
    *texts = by_component(all, *texts);
  const std::vector<TargetImage> targets = read_targets(options.images, scene);
  const NetworkGuess guess = set_starts(options, scene);
  inputs.end();
  print_notes(common, targets, !options.inversion.exposure);
  const Device device(common.device);
  const bool posterior = options.method == "posterior";
  const std::vector<std::string>& without_meaning = posterior ? options.no_posterior : options.only_posterior;
  if (!without_meaning.empty())
    throw UsageError(fmt::format("{}: means nothing to --method {}", without_meaning.front(), options.method));
  if (names_texture(all, options.parameters)) return find_textures(options, scene, targets, device, inputs);
  if (posterior) {
    RenderOptions render_options;
    render_options.seed = options.common.seed;
    render_options.op = options.op;
    render_options.cancel = &interrupt_flag();
    if (options.common.spp == 1) throw UsageError("--spp 1: a rendering has two halves; need 2 or more");
    ForwardModel model(device, scene, options.parameters, options.images.sensors, render_options);
    return find_posterior(options, scene, targets, model, scene_request(options, device, scene_files),
                          request(options, device, inputs));
  }

  InversionOptions& how = options.inversion;
  how.method = options.method == "adam" ? InversionOptions::Method::adam : InversionOptions::Method::gauss_newton;
  if (options.method == "adam" && !options.prior.empty())
    throw UsageError("--prior: adam minimises the image loss alone; use --method gauss-newton");
  if (how.white_balance && options.method == "adam")
    throw UsageError("--white-balance: adam finds exposures alone; use --method gauss-newton");
  if (how.white_balance &&
      std::any_of(targets.begin(), targets.end(), [](const TargetImage& t) { return t.channels == 1; }))
    throw UsageError("--white-balance: the sensor's film has luminance alone; need one with colours");
  how.spp = common.spp;
  if (how.sample_limit() < 2) throw UsageError("--spp 1: a loss compares different samples of a pixel; need 2 or more");
  constexpr double most_samples = 1 << 29;  // that a pixel has, over all iterations
  if (double(how.iteration_limit()) * how.sample_limit() > most_samples)
    throw UsageError(fmt::format("--iterations {} of --spp {}: need at most {} samples in all", how.iteration_limit(),
                                 how.sample_limit(), most_samples));
  how.relative_noise = relative_noise(options.noise, targets);

  RenderOptions render_options;
  render_options.seed = common.seed;
  render_options.op = options.op;
  render_options.cancel = &interrupt_flag();
  render_options.ranks = &world();
  ForwardModel model(device, scene, options.parameters, options.images.sensors, render_options);
  std::vector<std::string> known = options.prior;
  how.prior = prior_of(options, model.coordinates());
  if (how.method == InversionOptions::Method::gauss_newton && known.empty()) {
    how.prior = guess.prior(model.coordinates());
    known = guess.words();
  }
  Inversion inversion(model, targets, how);

  check_outputs(common, {});
  StoredInversion stored(options.folder, request(options, device, inputs), inversion, model.coordinates(),
                         inversion_starts(model.coordinates(), model.start(), options.starts, common.seed));
  Progress progress(options.scene, double(how.iteration_limit()) * options.starts, "iterations at most", !common.quiet);
  while (!stored.finished()) {
    const InversionStep& step = stored.advance();
    progress.clear();
    if (common.talkative()) print_step(stored.current(), step, model.coordinates());
    progress.update(stored.fraction(how.iteration_limit()));
  }
  progress.clear();

  const InversionQuestion question{options.scene,          options.method, options.folder,
                                   options.images.targets, known,          errors_known(targets) || options.noise >= 0};
  InversionOutcome outcome = conclude(question, inversion, model.coordinates(), scene, stored.started());
  outcome.seconds = seconds();
  write_inversion(outcome, model.coordinates(), targets);
  if (common.talkative()) print(outcome, model.coordinates());
  write_json(common, to_json(outcome, model.coordinates()));
  if (!outcome.converged())
    throw ResultError("invert: not converged; " + options.folder + "/report.html shows how far");
}

}  // namespace

void add_invert(CLI::App& app) {
  auto options = std::make_shared<InvertArguments>();
  CLI::App* command =
      app.add_subcommand("invert",
                         "from images of a scene to its parameters, with 95 % intervals (analysis by synthesis)\n\n"
                         "Starts from the scene's values, or from a network's guess. Stopped at any moment, the same "
                         "command goes on where it was. Exit code 1 if it "
                         "does not converge.");
  command->add_option("scene", options->scene, "Mitsuba 3 XML file")->required();
  add_target_options(*command, options->images);
  command
      ->add_option("--parameter", options->parameters,
                   "scene parameter to find (itn parameters lists them); may be repeated. Textures are found texel by "
                   "texel, grids voxel by voxel, with adam, and numbers beside them")
      ->required()
      ->take_all();
  command->add_option("-o,--output", options->folder, "folder for the result: report.html, result.json, images")
      ->required();
  command
      ->add_option("--method", options->method,
                   "gauss-newton: steps of weighted least squares; adam: 200 iterations of stochastic gradients; "
                   "posterior: no start, renderings all over the range, an emulator of the image and samples of all "
                   "materials that fit")
      ->check(CLI::IsMember({"adam", "gauss-newton", "posterior"}))
      ->capture_default_str();
  command
      ->add_option("--iterations", options->inversion.iterations, "at most; default 50, adam 200, posterior 8 (rounds)")
      ->check(CLI::Range(1, 1000000));
  command
      ->add_option("--noise", options->noise,
                   "standard deviation of the targets' noise over their radiance, beside what their files say")
      ->check(CLI::Range(0.0, 10.0));
  command->add_flag("--exposure", options->inversion.exposure, "each target is known up to a factor: find it, too");
  command->add_flag("--white-balance", options->inversion.white_balance,
                    "gauss-newton: red and blue of all targets are known up to a factor each: find them, too");
  command
      ->add_option("--init", options->init,
                   "start from what the network of this RUN (itn train; or .safetensors file; without RUN: the one "
                   "that ships with the program) sees in the first target: sigma_t, albedo and g of one medium. "
                   "Without --prior what it says of them, and how surely, is Gauss-Newton's prior, too")
      ->expected(0, 1)
      ->default_str(shipped_run);
  command->add_option("--start", options->start, "NAME=VALUE: start there instead; may be repeated")
      ->check(gives_numbers(1, "NAME=VALUE"))
      ->take_all();
  command
      ->add_option("--starts", options->starts,
                   "also start from this many less one random places; the best end is the result")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command
      ->add_option("--prior", options->prior,
                   "NAME=LOW,HIGH: what is known before the image, as a 95 % interval; may be repeated. The result is "
                   "then what both say (the mean of the posterior, as far as all is normal)")
      ->check(gives_numbers(2, "NAME=LOW,HIGH"))
      ->take_all();
  command
      ->add_option(
          "--range", options->range,
          "NAME=LOW,HIGH: posterior: look for it between these, evenly (numbers above 0 without an upper bound "
          "in their logarithm); default: all of a range with two bounds, else a tenth to ten times the scene's "
          "value; may be repeated")
      ->check(gives_numbers(2, "NAME=LOW,HIGH"))
      ->take_all();
  command->add_option("--renderings", options->renderings,
                      "posterior: the folder where renderings of the scene are kept for the next photo of it; default: "
                      "renderings in that of --output");
  command->add_option("--learning-rate", options->inversion.learning_rate, "adam: of the first iterations")
      ->check(CLI::Range(1e-6, 10.0))
      ->capture_default_str();
  command
      ->add_option(
          "--smoothness", options->smoothness,
          "textures and grids: what the mean squared difference of neighbours weighs beside that of the images")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  command
      ->add_option("--repeats", options->repeats,
                   "textures and grids: repetitions for targets with other noise, of a quarter of the iterations each, "
                   "whose spread "
                   "is the uncertainty; 0: none")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str();
  add_operator_option(*command, options->op);
  add_common_options(*command, options->common,
                     "1024 at most (Gauss-Newton), 16 (Adam), as the targets' noise asks for (posterior)");
  add_open_option(*command, options->common);
  command->callback([options, command] {
    for (const char* name : {"--init", "--start", "--starts", "--prior", "--white-balance"})
      if (command->count(name) > 0) options->only_numbers.emplace_back(name);
    for (const char* name : {"--range", "--renderings"})
      if (command->count(name) > 0) options->only_posterior.emplace_back(name);
    for (const char* name : {"--init", "--start", "--starts", "--learning-rate", "--white-balance"})
      if (command->count(name) > 0) options->no_posterior.emplace_back(name);
    if (command->count("--method") > 0 && options->method != "adam")
      options->only_numbers.push_back("--method " + options->method);
    run(*options);
  });
}

}  // namespace itn::tools
