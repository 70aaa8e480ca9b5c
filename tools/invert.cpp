// itn invert: from images of a scene to its parameters, with 95 % intervals.
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <random>

#include "runtime/error.h"
#include "runtime/image/file.h"
#include "runtime/inversion/inversion.h"
#include "runtime/scene/load.h"
#include "runtime/seconds_since.h"
#include "runtime/statistics.h"
#include "tools/common.h"
#include "tools/interrupt.h"
#include "tools/invert_report.h"
#include "tools/network_start.h"
#include "tools/progress.h"
#include "tools/run_folder.h"
#include "tools/target_options.h"

namespace itn::tools {
namespace {

constexpr const char* state_schema = "itn.invert.state/1";
constexpr double assumed_noise = 0.01;  // where nobody says

struct Options {
  CommonOptions common;
  std::string scene, folder, init, method = "gauss-newton";
  Operator op = Operator::full;
  TargetOptions images;
  std::vector<std::string> parameters, start, prior;
  int starts = 1;
  double noise = -1;  // not given
  InversionOptions inversion;
};

// One start and how far it has come: what is stored after every iteration.
struct Run {
  std::vector<double> start;  // coordinates
  InversionState state;
  std::vector<InversionStep> steps;
};

// JSON has no infinity: a standard error that is not known becomes null.
nlohmann::json number(double v) { return std::isfinite(v) ? nlohmann::json(v) : nlohmann::json(nullptr); }
double number_from(const nlohmann::json& v) {
  return v.is_null() ? std::numeric_limits<double>::infinity() : v.get<double>();
}

nlohmann::json stored(const InversionState& s) {
  return {{"iteration", s.iteration},
          {"spp", s.spp},
          {"next_sample", s.next_sample},
          {"x", s.x},
          {"done", s.done},
          {"converged", s.converged},
          {"reference_x", s.reference_x},
          {"reference_spp", s.reference_spp},
          {"reference_sample", s.reference_sample},
          {"accepted", s.accepted},
          {"accepted_x", s.accepted_x},
          {"accepted_loss", s.accepted_loss},
          {"accepted_loss_stderr", s.accepted_loss_stderr},
          {"damping", s.damping},
          {"pool", s.pool},
          {"first_moment", s.moments.first},
          {"second_moment", s.moments.second}};
}

InversionState state_from(const nlohmann::json& j) {
  InversionState s;
  j.at("iteration").get_to(s.iteration);
  j.at("spp").get_to(s.spp);
  j.at("next_sample").get_to(s.next_sample);
  j.at("x").get_to(s.x);
  j.at("done").get_to(s.done);
  j.at("converged").get_to(s.converged);
  j.at("reference_x").get_to(s.reference_x);
  j.at("reference_spp").get_to(s.reference_spp);
  j.at("reference_sample").get_to(s.reference_sample);
  j.at("accepted").get_to(s.accepted);
  j.at("accepted_x").get_to(s.accepted_x);
  j.at("accepted_loss").get_to(s.accepted_loss);
  j.at("accepted_loss_stderr").get_to(s.accepted_loss_stderr);
  j.at("damping").get_to(s.damping);
  j.at("pool").get_to(s.pool);
  j.at("first_moment").get_to(s.moments.first);
  j.at("second_moment").get_to(s.moments.second);
  return s;
}

nlohmann::json stored(const Run& run) {
  nlohmann::json steps = nlohmann::json::array();
  for (const InversionStep& s : run.steps)
    steps.push_back({s.spp, s.x, s.loss, number(s.loss_stderr), s.accepted, s.distance});
  return {{"start", run.start}, {"state", stored(run.state)}, {"steps", steps}};
}

Run run_from(const nlohmann::json& j) {
  Run run{j.at("start").get<std::vector<double>>(), state_from(j.at("state")), {}};
  for (const nlohmann::json& s : j.at("steps"))
    run.steps.push_back(
        {static_cast<int>(run.steps.size()), s.at(0), s.at(1), s.at(2), number_from(s.at(3)), s.at(4), s.at(5)});
  return run;
}

// Everything that the numbers depend on: a folder goes on only with the same.
nlohmann::json request(const Options& o, const Device& device) {
  nlohmann::json files = nlohmann::json::object();
  files[o.scene] = fingerprint_of(o.scene);
  for (const auto* list : {&o.images.targets, &o.images.masks})
    for (const std::string& file : *list)
      if (!file.empty()) files[file] = fingerprint_of(file);
  return {{"version", ITN_VERSION},
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
          {"method", o.method},
          {"operator", name_of(o.op)},
          {"iterations", o.inversion.iterations},
          {"spp", o.common.spp},
          {"seed", o.common.seed},
          {"noise", o.noise},
          {"exposure", o.inversion.exposure},
          {"learning_rate", o.inversion.learning_rate},
          {"device", device.info().name + ", " + device.info().platform}};
}

// The folder's state: saved whole after every iteration.
class Journal {
 public:
  Journal(const std::string& folder, nlohmann::json request)
      : file_(folder + "/state.json"), lines_(folder + "/iterations.jsonl"), request_(std::move(request)) {
    if (!std::filesystem::exists(file_)) return;
    try {
      const nlohmann::json j = nlohmann::json::parse(read_file(file_));
      if (j.at("schema") != state_schema) throw InputError("");
      for (const auto& [key, value] : request_.items())
        if (!j.at("request").contains(key) || j.at("request").at(key) != value)
          throw UsageError(fmt::format(
              "{}: holds an inversion with another {} ({}, now {}); give another folder with -o, or remove this one",
              folder, key, j.at("request").value(key, nlohmann::json()).dump(), value.dump()));
      for (const nlohmann::json& run : j.at("runs")) runs.push_back(run_from(run));
    } catch (const UsageError&) {
      throw;
    } catch (const std::exception&) {
      throw InputError(file_ + ": not the state of an inversion by this version; remove it to begin anew");
    }
  }

  void save(const std::vector<Coordinate>& coordinates) const {
    nlohmann::json all = nlohmann::json::array();
    std::string lines;
    for (std::size_t k = 0; k < runs.size(); ++k) {
      all.push_back(stored(runs[k]));
      for (const InversionStep& step : runs[k].steps) {
        nlohmann::ordered_json line{{"start", k}};
        line.update(tools::to_json(step, coordinates));
        lines += line.dump() + "\n";
      }
    }
    write_file(lines_, lines);
    write_file(file_, nlohmann::json{{"schema", state_schema}, {"request", request_}, {"runs", all}}.dump() + "\n");
  }

  std::vector<Run> runs;

 private:
  std::string file_, lines_;
  nlohmann::json request_;
};

// The values of --start, else what the network of --init sees in the first target, else the scene's.
void set_starts(const Options& options, Scene& scene) {
  const std::vector<Parameter> all = list_parameters(scene);
  std::vector<std::string> given;
  for (const std::string& text : options.start) given.push_back(text.substr(0, text.find('=')));
  if (!options.init.empty())
    set_network_start(scene, options.parameters, given, options.init, options.images.targets.front(),
                      options.images.sensors.front());
  for (const std::string& text : options.start) {
    const std::size_t equals = text.find('=');
    const std::string name = text.substr(0, equals);
    if (std::find(options.parameters.begin(), options.parameters.end(), name) == options.parameters.end())
      throw UsageError(fmt::format("--start {}: need NAME=VALUE with a name given to --parameter", text));
    char* end = nullptr;
    const std::string value = equals == std::string::npos ? "" : text.substr(equals + 1);
    const double v = std::strtod(value.c_str(), &end);
    if (value.empty() || *end != '\0')
      throw UsageError(fmt::format("--start {}: got \"{}\" for the value, need a number", text, value));
    set_parameter(scene, find_parameter(all, name), v);
  }
}

// Of --prior, with LOW and HIGH where a normal distribution of the coordinate has its 95 %.
Prior prior_of(const Options& options, const std::vector<Coordinate>& coordinates) {
  Prior prior;
  if (options.prior.empty()) return prior;
  prior.mean.assign(coordinates.size(), 0);
  prior.precision.assign(coordinates.size(), 0);
  for (const std::string& text : options.prior) {
    const std::string name = text.substr(0, text.find('='));
    const auto found = std::find_if(coordinates.begin(), coordinates.end(),
                                    [&](const Coordinate& c) { return c.parameter().name == name; });
    if (found == coordinates.end())
      throw UsageError(fmt::format("--prior {}: need NAME=LOW,HIGH with a name given to --parameter", text));
    double low = 0, high = 0;
    char rest = 0;
    const std::string numbers = text.substr(std::min(text.size(), name.size() + 1));
    if (std::sscanf(numbers.c_str(), "%lf,%lf%c", &low, &high, &rest) != 2 || !found->parameter().contains(low) ||
        !found->parameter().contains(high) || !(low < high))
      throw UsageError(fmt::format("--prior {}: got \"{}\", need LOW,HIGH, two numbers in {}, the smaller first", text,
                                   numbers, found->parameter().range()));
    const auto i = static_cast<std::size_t>(found - coordinates.begin());
    prior.mean[i] = (found->of(low) + found->of(high)) / 2;
    prior.precision[i] = std::pow(2 * normal_quantile(0.975) / (found->of(high) - found->of(low)), 2);
  }
  return prior;
}

// The first start is that of set_starts(); the others are drawn.
std::vector<std::vector<double>> all_starts(const Options& options, const ForwardModel& model) {
  std::vector<std::vector<double>> result{model.start()};
  std::mt19937_64 random(options.common.seed);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  while (static_cast<int>(result.size()) < options.starts) {
    std::vector<double> x;
    for (const Coordinate& c : model.coordinates()) x.push_back(c.start(uniform()));
    result.push_back(x);
  }
  return result;
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
  fmt::print("{}/report.html: {:.1f} s\n", outcome.folder, outcome.seconds);
}

InversionOutcome outcome_of(const Options& options, Inversion& inversion, const ForwardModel& model, Scene scene,
                            const std::vector<Run>& runs) {
  InversionOutcome outcome;
  outcome.scene = options.scene;
  outcome.method = options.method;
  outcome.folder = options.folder;
  outcome.targets = options.images.targets;
  outcome.prior = options.prior;
  const std::vector<Coordinate>& coordinates = model.coordinates();
  for (const Run& run : runs) {
    std::vector<double> values;
    for (std::size_t p = 0; p < coordinates.size(); ++p) values.push_back(coordinates[p].value(run.start[p]));
    outcome.runs.push_back({values, run.steps, inversion.conclude(run.state)});
    if (outcome.runs.back().end.loss < outcome.found().end.loss) outcome.best = outcome.runs.size() - 1;
  }
  const Inversion::Conclusion& end = outcome.found().end;
  for (std::size_t p = 0; p < coordinates.size(); ++p)
    set_parameter(scene, coordinates[p].parameter(), coordinates[p].value(end.x[p]));
  outcome.parameters = intervals(coordinates, end.x, end.covariance);
  outcome.coefficients = transport_coefficients(scene, coordinates, end.x, end.covariance);
  outcome.directions = ambiguity(coordinates, end.x, end.covariance);
  outcome.exposures = exposures(coordinates, end.x, end.covariance, inversion.names());
  return outcome;
}

void run(Options options) {
  const CommonOptions& common = options.common;
  const auto seconds = [start = std::chrono::steady_clock::now()] { return seconds_since(start); };
  Scene scene = load_scene(options.scene, common.definition_map());
  for (const std::string& text : scene.warnings) warn(common, text);
  const std::vector<Parameter> all = list_parameters(scene);
  for (std::vector<std::string>* texts : {&options.parameters, &options.start, &options.prior})
    *texts = by_component(all, *texts);
  const std::vector<TargetImage> targets = read_targets(options.images, scene);
  set_starts(options, scene);
  const Device device(common.device);

  InversionOptions& how = options.inversion;
  how.method = options.method == "adam" ? InversionOptions::Method::adam : InversionOptions::Method::gauss_newton;
  if (options.method == "adam" && !options.prior.empty())
    throw UsageError("--prior: adam minimises the image loss alone; use --method gauss-newton");
  how.spp = common.spp;
  if (how.sample_limit() < 2) throw UsageError("--spp 1: a loss compares different samples of a pixel; need 2 or more");
  constexpr double most_samples = 1 << 29;  // that a pixel has, over all iterations
  if (double(how.iteration_limit()) * how.sample_limit() > most_samples)
    throw UsageError(fmt::format("--iterations {} of --spp {}: need at most {} samples in all", how.iteration_limit(),
                                 how.sample_limit(), most_samples));
  const bool errors_known =
      std::all_of(targets.begin(), targets.end(), [](const TargetImage& t) { return !t.error.empty(); });
  how.relative_noise = options.noise >= 0 ? options.noise : errors_known ? 0 : assumed_noise;

  RenderOptions render_options;
  render_options.seed = common.seed;
  render_options.op = options.op;
  render_options.cancel = &interrupt_flag();
  ForwardModel model(device, scene, options.parameters, options.images.sensors, render_options);
  how.prior = prior_of(options, model.coordinates());
  Inversion inversion(model, targets, how);

  std::error_code failure;
  std::filesystem::create_directories(options.folder, failure);
  check_writable(options.folder + "/state.json");
  if (!common.json.empty() && common.json != "-") check_writable(common.json);
  Journal journal(options.folder, request(options, device));
  const std::vector<std::vector<double>> starts = all_starts(options, model);
  Progress progress(options.scene, how.iteration_limit() * static_cast<double>(starts.size()), "iterations at most",
                    !common.quiet);
  for (std::size_t k = 0; k < starts.size(); ++k) {
    if (k == journal.runs.size()) journal.runs.push_back({starts[k], inversion.start(starts[k]), {}});
    Run& current = journal.runs[k];
    while (!current.state.done) {
      current.steps.push_back(inversion.advance(current.state));
      journal.save(model.coordinates());
      progress.clear();
      if (common.talkative()) print_step(k, current.steps.back(), model.coordinates());
      progress.update((static_cast<double>(k) + current.state.iteration / double(how.iteration_limit())) /
                      static_cast<double>(starts.size()));
    }
  }
  progress.clear();

  InversionOutcome outcome = outcome_of(options, inversion, model, scene, journal.runs);
  outcome.noise_known = errors_known || options.noise >= 0;
  outcome.seconds = seconds();
  write_inversion(outcome, model.coordinates(), targets);
  if (common.talkative()) print(outcome, model.coordinates());
  write_json(common, to_json(outcome, model.coordinates()));
  if (!outcome.converged())
    throw ResultError("invert: not converged; " + options.folder + "/report.html shows how far");
}

}  // namespace

void add_invert(CLI::App& app) {
  auto options = std::make_shared<Options>();
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
                   "scene parameter to find (itn parameters lists them); may be repeated")
      ->required()
      ->take_all();
  command->add_option("-o,--output", options->folder, "folder for the result: report.html, result.json, images")
      ->required();
  command
      ->add_option("--method", options->method,
                   "gauss-newton: steps of weighted least squares; adam: 200 iterations of stochastic gradients")
      ->check(CLI::IsMember({"adam", "gauss-newton"}))
      ->capture_default_str();
  command->add_option("--iterations", options->inversion.iterations, "at most; default 50, adam 200")
      ->check(CLI::Range(1, 1000000));
  command
      ->add_option("--noise", options->noise,
                   "standard deviation of the targets' noise over their radiance, beside what their files say")
      ->check(CLI::Range(0.0, 10.0));
  command->add_flag("--exposure", options->inversion.exposure, "each target is known up to a factor: find it, too");
  command
      ->add_option("--init", options->init,
                   "start from what the network of this RUN (itn train; or .safetensors file; without RUN: the one "
                   "that ships with the program) sees in the first target: sigma_t, albedo and g of one medium")
      ->expected(0, 1)
      ->default_str(shipped_run);
  command->add_option("--start", options->start, "NAME=VALUE: start there instead; may be repeated")->take_all();
  command
      ->add_option("--starts", options->starts,
                   "also start from this many less one random places; the best end is the result")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command
      ->add_option("--prior", options->prior,
                   "NAME=LOW,HIGH: what is known before the image, as a 95 % interval; may be repeated. The result is "
                   "then what both say (the mean of the posterior, as far as all is normal)")
      ->take_all();
  command->add_option("--learning-rate", options->inversion.learning_rate, "adam: of the first iterations")
      ->check(CLI::Range(1e-6, 10.0))
      ->capture_default_str();
  add_operator_option(*command, options->op);
  add_common_options(*command, options->common, "1024 at most (Gauss-Newton), 16 (Adam)");
  command->callback([options] { run(*options); });
}

}  // namespace itn::tools
