#include "runtime/view/session.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "itn/error.h"
#include "runtime/base/seconds_since.h"
#include "runtime/inverse/forward_model.h"
#include "runtime/scene/parameter_refusal.h"

namespace itn {
namespace {

constexpr double part_s = 0.03;         // of rendering between two checks for new wishes
constexpr double step_s = 0.5;          // of rendering for the first step of Gauss-Newton
constexpr double best_there_is = 0.4;   // standard errors: a step that is shorter leads nowhere
constexpr std::size_t loss_groups = 4;  // of independent samples, for the loss and its error
// No step is computed while sliders still move: samples a pixel, and seconds since the last move.
constexpr int before_step = 32;
constexpr double rest_s = 0.4;
constexpr int soon_shown = 16;  // samples a pixel up to which every part is published
constexpr double between_frames_s = 0.1;
constexpr std::size_t most_kept = 4;

Sensor sensor_of(const Scene& scene, int index) {
  if (index < 0 || index >= static_cast<int>(scene.sensors.size()))
    throw UsageError(
        fmt::format("sensor {}: the scene has sensors 0 to {}", index, static_cast<int>(scene.sensors.size()) - 1));
  return scene.sensors[static_cast<std::size_t>(index)];
}

std::vector<double> numbers_of(const std::vector<Parameter>& parameters) {
  std::vector<double> values(parameters.size());
  std::transform(parameters.begin(), parameters.end(), values.begin(), [](const Parameter& p) { return p.value; });
  return values;
}

const Parameter* named(const std::vector<Parameter>& parameters, const std::string& name) {
  const auto found =
      std::find_if(parameters.begin(), parameters.end(), [&](const Parameter& p) { return p.name == name; });
  return found == parameters.end() ? nullptr : &*found;
}

// The parameters of media; of scenes without one those of their surfaces. A medium's scale is left out: no image tells
// it from sigma_t.
std::vector<std::string> usually_fitted(const std::vector<Parameter>& parameters) {
  constexpr std::size_t most = 12;  // derivative images
  std::vector<std::string> media, surfaces;
  for (const Parameter& p : parameters) {
    if (!p.not_differentiable.empty()) continue;
    if (p.owner == Owner::phase || (p.owner == Owner::medium && p.member != "scale")) media.push_back(p.name);
    if (p.owner == Owner::bsdf) surfaces.push_back(p.name);
  }
  std::vector<std::string> names = media.empty() ? surfaces : media;
  names.resize(std::min(names.size(), most));
  return names;
}

// So little different that images, of single precision, are the same.
void move_apart(Scene& scene, const Parameter& p, double value) {
  constexpr double little = 1e-12, nothing = 1e-30;
  const double share = little * (1 + p.component);
  for (const double near : {value * (1 - share), value * (1 + share), value + nothing * (1 + p.component)})
    if (near != value && p.contains(near)) return set_parameter(scene, p, near);
}

}  // namespace

ViewSession::ViewSession(Scene scene, ViewOptions options)
    : options_(std::move(options)),
      scene_(std::move(scene)),
      parameters_(list_parameters(scene_)),
      sensor_(sensor_of(scene_, options_.sensor)),
      device_(options_.device),
      watched_(std::chrono::steady_clock::now()),
      builder_(std::make_unique<ProgramBuilder>(options_.device)) {
  wanted_.values = numbers_of(parameters_);
  if (options_.target) {
    options_.spp = std::max(options_.spp, static_cast<int>(loss_groups));
    wanted_.fit = usually_fitted(parameters_);
    targets_.push_back(*options_.target);
  }
}

ViewSession::~ViewSession() = default;

const Parameter& ViewSession::find(const std::string& name) const {
  find_parameter(parameters_, name);
  return *named(parameters_, name);
}

std::size_t ViewSession::index(const std::string& name) const {
  return static_cast<std::size_t>(&find(name) - parameters_.data());
}

Scene ViewSession::scene_of(const std::vector<double>& values) const {
  Scene scene = scene_;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (!std::isnan(values[i])) set_parameter(scene, parameters_[i], values[i]);
  // A colour whose components have become equal would be one parameter, and have another name.
  const std::vector<Parameter> there = list_parameters(scene);
  for (std::size_t i = 0; i < values.size(); ++i)
    if (parameters_[i].component >= 0 && !named(there, parameters_[i].name))
      move_apart(scene, parameters_[i], values[i]);
  return scene;
}

Scene ViewSession::scene_of(const ViewFrame& frame) const { return scene_of(frame.values); }

void ViewSession::change(const std::function<void(Wanted&)>& what) {
  const std::lock_guard lock(mutex_);
  const std::uint64_t before = wanted_.revision;
  what(wanted_);
  // One picture of values that nobody has seen yet is finished first: a slider that never rests would never get one.
  if (pictured_ >= before) cancel_ = true;
  work_.notify_all();
}

std::uint64_t ViewSession::set(const std::map<std::string, double>& values) {
  for (const auto& [name, value] : values) {
    const Parameter& p = find(name);
    if (std::isnan(p.value))
      throw UsageError(fmt::format("{}: a texture or a grid; a number cannot take its place", name));
    if (const std::string why = refusal(p, value); !why.empty())
      throw UsageError(fmt::format("parameter {}: {}", name, why));
  }
  std::uint64_t revision = 0;
  change([&](Wanted& wanted) {
    std::vector<double> all = wanted.values;
    for (const auto& [name, value] : values) all[index(name)] = value;
    const auto differs = [](double a, double b) { return a != b && !(std::isnan(a) && std::isnan(b)); };
    bool changed = false;
    for (std::size_t i = 0; i < all.size(); ++i) changed = changed || differs(all[i], wanted.values[i]);
    if (changed) {
      wanted.values = std::move(all);
      ++wanted.revision;
    }
    revision = wanted.revision;
  });
  return revision;
}

void ViewSession::differentiate(const std::string& parameter) {
  if (!parameter.empty()) find(parameter);
  change([&](Wanted& wanted) { wanted.derivative = parameter; });
}

void ViewSession::fit(const std::vector<std::string>& parameters) {
  if (!options_.target) throw UsageError("there is no target to fit parameters to; give one (target)");
  if (std::set<std::string>(parameters.begin(), parameters.end()).size() != parameters.size())
    throw UsageError("fit: got a name twice, need each once");
  for (const std::string& name : parameters)
    if (const std::string why_not = find(name).not_differentiable; !why_not.empty())
      throw UsageError(fmt::format("{}: {}", name, why_not));
  change([&](Wanted& wanted) { wanted.fit = parameters; });
}

std::vector<std::string> ViewSession::fitted() const {
  const std::lock_guard lock(mutex_);
  return wanted_.fit;
}

std::vector<double> ViewSession::values() const {
  const std::lock_guard lock(mutex_);
  return wanted_.values;
}

bool ViewSession::stopped() const {
  const std::lock_guard lock(mutex_);
  return stopped_;
}

bool ViewSession::take_step() {
  std::map<std::string, double> values;
  {
    const std::lock_guard lock(mutex_);
    if (!frame_->step || frame_->revision != wanted_.revision || frame_->step->parameters != wanted_.fit) return false;
    for (std::size_t i = 0; i < frame_->step->parameters.size(); ++i)
      values[frame_->step->parameters[i]] = frame_->step->to[i];
  }
  set(values);
  return true;
}

std::shared_ptr<const ViewFrame> ViewSession::frame() const {
  const std::lock_guard lock(mutex_);
  return frame_;
}

std::shared_ptr<const ViewFrame> ViewSession::wait(std::uint64_t after, std::chrono::milliseconds timeout) const {
  std::unique_lock lock(mutex_);
  watched_ = std::chrono::steady_clock::now();
  work_.notify_all();
  news_.wait_for(lock, timeout, [&] { return frame_->number > after || stopped_; });
  watched_ = std::chrono::steady_clock::now();
  return frame_;
}

std::chrono::steady_clock::time_point ViewSession::watched() const {
  const std::lock_guard lock(mutex_);
  return watched_;
}

void ViewSession::stop() {
  const std::lock_guard lock(mutex_);
  stopped_ = cancel_ = true;
  work_.notify_all();
  news_.notify_all();
}

void ViewSession::wait_for_work(std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  if (wanted_.revision == now_.revision && wanted_.derivative == now_.derivative && wanted_.fit == now_.fit &&
      !stopped_)
    work_.wait_for(lock, timeout);
}

RenderOptions ViewSession::render_options(const std::vector<std::string>& derivatives) {
  RenderOptions options;
  options.sensor = options_.sensor;
  options.seed = options_.seed;
  options.op = options_.op;
  options.derivatives = derivatives;
  options.cancel = &cancel_;
  return options;
}

Renderer& ViewSession::renderer_of(const std::vector<std::string>& derivatives, std::uint64_t revision,
                                   const Scene& scene) {
  const auto found =
      std::find_if(kept_.begin(), kept_.end(), [&](const Kept& k) { return k.derivatives == derivatives; });
  if (found != kept_.end()) {
    kept_.splice(kept_.begin(), kept_, found);
  } else {
    kept_.push_front({derivatives, revision, std::make_unique<Renderer>(device_, scene, render_options(derivatives))});
    if (kept_.size() > most_kept) kept_.pop_back();
  }
  Kept& kept = kept_.front();
  if (kept.revision != revision) {
    kept.revision = 0;  // of none, where this fails
    kept.renderer->replace(scene);
    kept.revision = revision;
  }
  return *kept.renderer;
}

// From now on what is wanted.
void ViewSession::begin(const Wanted& wanted) {
  const bool moved = wanted.revision != now_.revision || now_.values.empty();
  if (moved) current_ = scene_of(wanted.values);
  if (moved) {
    groups_.clear();
    samples_ = 0;
    loss_.reset();
    problem_.clear();
    moved_ = std::chrono::steady_clock::now();
  }
  if (moved || wanted.derivative != now_.derivative) derivative_problem_.clear();
  if (moved || wanted.fit != now_.fit) {
    step_.reset();
    step_note_.clear();
    step_done_ = false;
    step_tries_ = 0;
  }
  now_ = wanted;
}

// Can the derivative that is wanted be rendered, and at once? Else the note says why not.
bool ViewSession::wants_derivative(const Scene& scene) {
  derivative_note_.clear();
  if (now_.derivative.empty()) return false;
  const std::vector<Parameter> there = list_parameters(scene);
  const Parameter* parameter = named(there, now_.derivative);
  derivative_note_ = parameter ? parameter->not_differentiable : "there is no derivative by it at these values";
  if (derivative_note_.empty()) derivative_note_ = derivative_problem_;
  if (!derivative_note_.empty()) return false;
  if (builder_->is_ready(scene, render_options({now_.derivative}))) return true;
  derivative_note_ = "its program is being compiled";
  return false;
}

bool ViewSession::refine() {
  if (!problem_.empty()) return false;
  const std::string derivative = wants_derivative(current_) ? now_.derivative : "";
  if (groups_.empty() || derivative != derivative_) {
    groups_.assign(options_.target ? loss_groups : 1, {});
    next_group_ = 0;
    samples_ = 0;
    part_ = 1;
    loss_.reset();
    derivative_ = derivative;
  }
  const int groups = static_cast<int>(groups_.size());
  if (next_group_ == 0) part_ = std::min(part_, (options_.spp - samples_) / groups);
  if (part_ < 1) {
    if (frame_->derivative_note != derivative_note_ || frame_->step_note != step_note_) publish();
    return false;
  }
  const std::vector<std::string> derivatives =
      derivative.empty() ? std::vector<std::string>{} : std::vector{derivative};
  const auto start = std::chrono::steady_clock::now();
  try {
    Renderer& renderer = renderer_of(derivatives, now_.revision, current_);
    groups_[next_group_].add(renderer.render(samples_, part_));
  } catch (const Interrupted&) {
    throw;
  } catch (const std::runtime_error& error) {
    return explain(error);
  }
  // Measured from the last part: the first one of a program contains work that the driver defers to it.
  sample_s_ = seconds_since(start) / part_;
  const bool first = samples_ == 0;
  samples_ += part_;
  next_group_ = (next_group_ + 1) % groups_.size();
  if (next_group_ == 0) {
    const double fitting = std::clamp(part_s / std::max(sample_s_, 1e-9), 1.0, 1e6);
    part_ = std::min(2 * part_, static_cast<int>(fitting));
    if (options_.target) loss_.reset();
  }
  const bool done = next_group_ == 0 && options_.spp - samples_ < groups;
  if (first || done || (next_group_ == 0 && (samples_ <= soon_shown || seconds_since(published_) > between_frames_s)))
    publish();
  return true;
}

// Why it could not be rendered. A derivative is left out then; values are for whoever moved them there to mend. Called
// by a handler: throws again what is neither.
bool ViewSession::explain(const std::runtime_error& error) {
  if (!derivative_.empty()) {
    derivative_problem_ = error.what();
    return true;
  }
  if (frame_->number == 0 || dynamic_cast<const DeviceError*>(&error)) throw;
  problem_ = error.what();
  publish();
  return true;
}

// The model of the fitted parameters; made anew only where others have moved: that takes longer than a picture.
ForwardModel& ViewSession::forward_model() {
  std::vector<double> others = now_.values;
  for (const std::string& name : now_.fit) others[index(name)] = 0;
  for (double& value : others)
    if (std::isnan(value)) value = 0;  // of textures
  if (model_ && model_fit_ == now_.fit && model_others_ == others) return *model_;
  model_.reset();
  RenderOptions how = render_options(now_.fit);
  // Launches as short as parts: between them a slider that moves is noticed.
  const double pixels = static_cast<double>(sensor_.crop_width) * sensor_.crop_height;
  how.paths_a_launch = static_cast<int>(std::clamp(pixels * part_s / std::max(sample_s_, 1e-9), 4096.0, 1e6));
  model_ = std::make_unique<ForwardModel>(device_, current_, now_.fit, std::vector{options_.sensor}, how);
  model_fit_ = now_.fit;
  model_others_ = std::move(others);
  return *model_;
}

// A first step of few samples, then others from the same values with as many as Gauss-Newton asks for, pooled with what
// was there, until it asks for no more. Between them the image goes on.
bool ViewSession::look_for_step() {
  if (!options_.target || now_.fit.empty() || step_done_) return false;
  const int samples = std::min(before_step * (1 + step_tries_), options_.spp / 2);
  if (samples_ < samples || seconds_since(moved_) < rest_s) return false;
  if (!builder_->is_ready(current_, render_options(now_.fit))) {
    step_note_ = "the program for it is being compiled";
    return false;
  }
  try {
    ForwardModel& model = forward_model();
    if (step_tries_ == 0) {
      std::vector<double> x;
      for (const Coordinate& c : model.coordinates()) x.push_back(c.of(now_.values[index(c.parameter().name)]));
      InversionOptions how;
      how.noise = options_.noise;
      how.exposure = options_.exposure;
      inversion_ = std::make_unique<Inversion>(model, targets_, how);
      inversion_state_ = inversion_->start(x);
      constexpr int least = 16, most = 256;
      inversion_state_.spp = static_cast<int>(std::clamp<double>(step_s / std::max(sample_s_, 1e-9), least, most));
    }
    const int spp = inversion_state_.spp;
    const InversionStep step = inversion_->advance(inversion_state_);
    constexpr double far = 2;  // standard errors: noise does not matter
    constexpr int most_tries = 6;
    step_done_ = step.distance > far || inversion_state_.spp == spp || ++step_tries_ == most_tries;
    ViewStep result{now_.fit, {}, {}, step.distance, step_done_};
    if (step_done_ && step.distance < best_there_is) result.misfit = misfit();
    for (std::size_t p = 0; p < now_.fit.size(); ++p) {
      result.from.push_back(model.coordinates()[p].value(step.x[p]));
      result.to.push_back(model.coordinates()[p].value(inversion_state_.x[p]));
    }
    inversion_state_.x = step.x;
    inversion_state_.done = inversion_state_.converged = false;
    step_ = std::move(result);
    step_note_.clear();
  } catch (const ResultError& error) {
    step_note_ = error.what();
    step_done_ = true;
  } catch (const UsageError& error) {
    step_note_ = error.what();
    step_done_ = true;
  }
  publish();
  return true;
}

// The image that is seen is compared with the target.
std::string ViewSession::misfit() const {
  const std::vector<Rendering> groups = renderings();
  const double exposure = options_.exposure ? best_exposure(groups, *options_.target) : 1;
  const ImageComparison comparison =
      compare_images({groups}, targets_, {exposure}, options_.exposure, options_.noise.relative, options_.noise.known);
  return comparison.fit.fits() ? "" : "what is left is not the noise. " + comparison.misfit.words;
}

std::vector<Rendering> ViewSession::renderings() const {
  std::vector<Rendering> groups;
  for (const Accumulation& group : groups_) groups.push_back(group.rendering());
  return groups;
}

void ViewSession::look_at_loss() {
  const std::vector<Rendering> groups = renderings();
  try {
    if (options_.exposure) exposure_ = best_exposure(groups, *options_.target);
    loss_ = loss_gradient(groups, *options_.target, exposure_);
  } catch (const ResultError&) {  // a black image: no factor makes it the target
    exposure_ = 1;
    loss_ = loss_gradient(groups, *options_.target, exposure_);
  }
}

void ViewSession::publish() {
  auto frame = std::make_shared<ViewFrame>();
  frame->revision = now_.revision;
  frame->values = now_.values;
  Accumulation all;
  for (const Accumulation& group : groups_)
    if (group.rendering().spp > 0) all.add(group.rendering());
  frame->image = all.rendering();
  if (!problem_.empty()) frame->image = frame_->image;
  frame->problem = problem_;
  frame->derivative = problem_.empty() ? derivative_ : frame_->derivative;
  frame->derivative_note = derivative_note_;
  if (options_.target && problem_.empty() && next_group_ == 0 && !loss_) look_at_loss();
  frame->loss = loss_;
  frame->exposure = exposure_;
  frame->step = step_;
  frame->step_note = step_note_;
  frame->done = next_group_ == 0 && options_.spp - samples_ < static_cast<int>(groups_.size());
  published_ = std::chrono::steady_clock::now();
  const std::lock_guard lock(mutex_);
  frame->number = frame_->number + 1;
  frame_ = std::move(frame);
  pictured_ = now_.revision;
  news_.notify_all();
}

bool ViewSession::advance() {
  Wanted wanted;
  {
    const std::lock_guard lock(mutex_);
    if (stopped_) return false;
    cancel_ = false;
    wanted = wanted_;
  }
  begin(wanted);
  try {
    return look_for_step() || refine();
  } catch (const Interrupted&) {
    return true;
  }
}

}  // namespace itn
