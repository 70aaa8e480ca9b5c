#include "runtime/render/derivative_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "itn/error.h"
#include "runtime/base/statistics.h"

namespace itn {
namespace {

// Renders one image after the other, each of one batch of the samples, and says how far the whole job is. The geometry
// goes to the device twice, not once an image.
class RenderSeries {
 public:
  RenderSeries(const Device& device, const Scene& scene, const RenderOptions& options,
               const std::vector<std::string>& names, int spp, std::size_t images)
      : spp_(spp),
        images_(static_cast<double>(images)),
        progress_(options.progress),
        differentiated_(device, scene, render_options(options, names)),
        moved_(device, scene, render_options(options, {})) {}

  Rendering differentiated(int batch) { return counted(differentiated_.render(batch * spp_, spp_)); }
  Rendering moved(const Scene& scene, int batch) {
    moved_.replace(scene);
    return counted(moved_.render(batch * spp_, spp_));
  }
  double seconds() const { return seconds_; }

 private:
  RenderOptions render_options(RenderOptions options, const std::vector<std::string>& derivatives) {
    options.derivatives = derivatives;
    if (progress_) options.progress = [this](double fraction) { progress_((done_ + fraction) / images_); };
    return options;
  }
  Rendering counted(Rendering image) {
    done_ += 1;
    seconds_ += image.render_s;
    return image;
  }

  int spp_;
  double images_, done_ = 0, seconds_ = 0;
  std::function<void(double)> progress_;
  Renderer differentiated_, moved_;
};

std::vector<double> difference_image(const Scene& scene, const DerivativeCheck::OfParameter& check, int batch,
                                     RenderSeries& images) {
  std::vector<double> difference;
  for (std::size_t k = 0; k < check.stencil.offset.size(); ++k) {
    const Rendering other = images.moved(moved_scene(scene, check.parameter, check.stencil.offset[k]), batch);
    difference.resize(other.mean.size(), 0.0);
    for (std::size_t i = 0; i < difference.size(); ++i)
      difference[i] += check.stencil.weight[k] * static_cast<double>(other.mean[i]);
  }
  return difference;
}

// The parameter, or the components of a colour, by which images can be differentiated. The other components, such as a
// channel that is 0, go to `not_differentiable`. given: the name that stands for them.
std::vector<Parameter> differentiable_of(const std::vector<Parameter>& all, const std::vector<std::string>& names,
                                         const std::string& given, std::vector<Parameter>& not_differentiable) {
  std::vector<Parameter> possible, others;
  for (const std::string& name : names) {
    const Parameter p = find_parameter(all, name);
    (p.not_differentiable.empty() ? possible : others).push_back(p);
  }
  if (possible.empty())
    throw UsageError(
        fmt::format("parameter {} cannot be differentiated by: {}", given, others.at(0).not_differentiable));
  not_differentiable.insert(not_differentiable.end(), others.begin(), others.end());
  return possible;
}

}  // namespace

bool DerivativeCheck::passed() const {
  return std::all_of(checks.begin(), checks.end(), [](const OfParameter& c) { return c.passed; });
}

DerivativeCheck plan_check(const Scene& scene, const std::vector<std::string>& parameters) {
  DerivativeCheck plan;
  const std::vector<Parameter> all = list_parameters(scene);
  std::string reasons;
  for (const std::string& given : parameters) {
    const std::vector<std::string> names = by_component(all, {given});
    const std::vector<Parameter> possible = differentiable_of(all, names, given, plan.not_differentiable);
    for (const Parameter& p : possible) {
      const auto same = [&](const DerivativeCheck::OfParameter& c) { return c.parameter.name == p.name; };
      if (std::any_of(plan.checks.begin(), plan.checks.end(), same))
        throw UsageError(fmt::format("parameter {}: named twice", p.name));
      plan.checks.push_back({p, difference_stencil(scene, p), {}, false});
    }
  }
  if (parameters.empty())
    for (const Parameter& p : all) {
      if (p.not_differentiable.empty()) {
        plan.checks.push_back({p, difference_stencil(scene, p), {}, false});
      } else {
        plan.not_differentiable.push_back(p);
        reasons += fmt::format("\n  {}: {}", p.name, p.not_differentiable);
      }
    }
  if (plan.checks.empty())
    throw UsageError(fmt::format("{}: the scene has no differentiable parameter{}", scene.file, reasons));
  return plan;
}

void run_check(const Device& device, const Scene& scene, const RenderOptions& options, DerivativeCheck& check) {
  const Sensor& sensor = scene.sensors.at(static_cast<std::size_t>(options.sensor));
  check.width = sensor.crop_width;
  check.height = sensor.crop_height;
  check.channels = sensor.luminance ? 1 : 3;
  check.seed = options.seed;
  check.op = options.op;
  constexpr int batches = DerivativeCheck::batches;
  const int spp = options.spp ? options.spp : sensor.spp;
  const int batch_spp = std::min((spp - 1) / batches + 1, std::numeric_limits<int>::max() / batches);
  check.spp = batch_spp * batches;
  const std::size_t pixels = static_cast<std::size_t>(check.width) * static_cast<std::size_t>(check.height);
  const auto channels = static_cast<std::size_t>(check.channels);
  std::vector<DerivativeComparison> comparisons(check.checks.size(), {pixels, channels});
  std::vector<std::string> names;
  for (const DerivativeCheck::OfParameter& of : check.checks) names.push_back(of.parameter.name);

  RenderSeries series(device, scene, options, names, batch_spp, batches * (1 + 4 * check.checks.size()));
  double largest_mean = 0;
  for (int batch = 0; batch < batches; ++batch) {
    const Rendering image = series.differentiated(batch);
    for (const double mean : image.mean_of_image) largest_mean = std::max(largest_mean, std::fabs(mean));
    for (std::size_t i = 0; i < comparisons.size(); ++i)
      comparisons[i].add(image.derivatives[i].mean, difference_image(scene, check.checks[i], batch, series));
  }
  check.render_s = series.seconds();
  check.bound = largest_z_bound(comparisons.size() * channels, DerivativeCheck::significance);
  for (std::size_t i = 0; i < comparisons.size(); ++i) {
    DerivativeCheck::OfParameter& of = check.checks[i];
    of.channels = comparisons[i].result(rounding_error(of.stencil, largest_mean));
    of.passed = std::all_of(of.channels.begin(), of.channels.end(),
                            [&](const auto& c) { return std::fabs(c.z) <= check.bound; });
  }
}

nlohmann::ordered_json to_json(const DerivativeCheck& check, const std::string& scene, const Device& device) {
  nlohmann::ordered_json parameters = nlohmann::ordered_json::object();
  for (const DerivativeCheck::OfParameter& of : check.checks) {
    nlohmann::ordered_json json{{"value", of.parameter.value}, {"step", of.stencil.step}};
    for (const char* list : {"derivative", "derivative_stderr", "difference", "difference_stderr", "z", "stderr",
                             "pixels", "pixels_beyond_95"})
      json[list] = nlohmann::ordered_json::array();
    for (const auto& c : of.channels) {
      json["derivative"].push_back(c.derivative);
      json["derivative_stderr"].push_back(c.derivative_stderr);
      json["difference"].push_back(c.difference);
      json["difference_stderr"].push_back(c.difference_stderr);
      json["z"].push_back(c.z);
      json["stderr"].push_back(c.stderr_between);
      json["pixels"].push_back(c.pixels);
      json["pixels_beyond_95"].push_back(c.beyond_95);
    }
    json["passed"] = of.passed;
    parameters[of.parameter.name] = std::move(json);
  }
  nlohmann::ordered_json not_differentiable = nlohmann::ordered_json::object();
  for (const Parameter& p : check.not_differentiable) not_differentiable[p.name] = p.not_differentiable;
  const DeviceInfo& info = device.info();
  return {{"schema", "itn.gradcheck/1"},
          {"scene", scene},
          {"operator", check.op == Operator::single ? "single" : "full"},
          {"width", check.width},
          {"height", check.height},
          {"spp", check.spp},
          {"batches", DerivativeCheck::batches},
          {"seed", check.seed},
          {"device", {{"platform", info.platform}, {"name", info.name}, {"type", info.type}}},
          {"time", {{"render_s", check.render_s}}},
          {"significance", DerivativeCheck::significance},
          {"bound", check.bound},
          {"passed", check.passed()},
          {"parameters", parameters},
          {"not_differentiable", not_differentiable}};
}

}  // namespace itn
