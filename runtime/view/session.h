// An interactive view of a scene: its image refines while nothing changes, and begins anew with few samples as soon as
// a parameter does. The display (tools/itn/view.cpp) and the renderer are different threads.
#pragma once
#include <chrono>
#include <condition_variable>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "itn/parameters.h"
#include "itn/renderer.h"
#include "runtime/image/accumulation.h"
#include "runtime/inverse/gauss_newton/inversion.h"
#include "runtime/inverse/misfit.h"
#include "runtime/view/program_builder.h"

namespace itn {

struct ViewOptions {
  std::string device;  // as Device's constructor takes it
  int sensor = 0;
  int spp = 1024;  // refined to this many samples a pixel
  std::uint64_t seed = 0;
  Operator op = Operator::full;
  std::optional<TargetImage> target;
  TargetNoise noise;
  bool exposure = false;  // the target is known up to a factor
};

// The step that Gauss-Newton proposes.
struct ViewStep {
  std::vector<std::string> parameters;
  std::vector<double> from, to;  // values
  double distance = 0;           // InversionStep::distance
  bool settled = false;          // more samples would not change it much
  std::string misfit = {};  // of values that are the best: why they are not those of the target; empty: they may be
};

// All that can be seen at one moment; never changed afterwards.
struct ViewFrame {
  std::uint64_t number = 0;     // later ones have larger numbers
  std::uint64_t revision = 0;   // of the values; each change of a parameter makes another
  std::vector<double> values;   // that the image was rendered with, one a parameter
  Rendering image;              // spp 0: nothing has been rendered yet
  std::string derivative;       // the parameter of image.derivatives.front(); empty: there is none
  std::string derivative_note;  // why there is none yet, or at all
  // With a target, from four samples a pixel on. gradient: by the derivative's parameter.
  std::optional<LossGradient> loss;
  double exposure = 1;           // of the target over the image; found with the loss where it is not known
  std::optional<ViewStep> step;  // from these values
  std::string step_note;         // why there is none yet, or at all
  std::string problem;           // why these values cannot be rendered; the image is then that of earlier ones
  bool done = false;             // refined as far as it will be
};

class ViewSession {
 public:
  // Throws UsageError (no such sensor) and as the renderer does.
  ViewSession(Scene scene, ViewOptions options);
  ~ViewSession();

  // The scene's parameters, with the values that it was loaded with.
  const std::vector<Parameter>& parameters() const { return parameters_; }
  const Sensor& sensor() const { return sensor_; }
  const Device& device() const { return device_; }
  const ViewOptions& options() const { return options_; }
  // The scene with a frame's values.
  Scene scene_of(const ViewFrame& frame) const;

  // All of these may be called by any thread at any time.
  //
  // All values or none. Returns the revision. Throws UsageError: an unknown parameter, or a value outside of its range.
  std::uint64_t set(const std::map<std::string, double>& values);
  // The parameter that the image is differentiated by; empty: none. Throws UsageError: there is none of that name.
  void differentiate(const std::string& parameter);
  // Sets the parameters that Gauss-Newton moves; at first those of media, or else of surfaces. Throws UsageError: no
  // target, a parameter that is unknown or not differentiable.
  void fit(const std::vector<std::string>& parameters);
  std::vector<std::string> fitted() const;
  std::vector<double> values() const;  // that are wanted; the frame may not have them yet
  // To where Gauss-Newton would step. False where no step from these values is known.
  bool take_step();
  std::shared_ptr<const ViewFrame> frame() const;
  // A frame with a larger number, or after that time the last one.
  std::shared_ptr<const ViewFrame> wait(std::uint64_t after, std::chrono::milliseconds timeout) const;
  // The last time anybody asked for a frame.
  std::chrono::steady_clock::time_point watched() const;
  // Interrupts the rendering: advance() returns soon, and so does wait_for_work().
  void stop();
  bool stopped() const;

  // One thread renders. advance(): a part of what is to be done, of some 30 ms where the scene allows it; false: there
  // is nothing left to do. Throws as the renderer.
  bool advance();
  // Until something is to be done again, or that time is over.
  void wait_for_work(std::chrono::milliseconds timeout);

 private:
  struct Wanted {
    std::uint64_t revision = 1;
    std::vector<double> values;
    std::string derivative;
    std::vector<std::string> fit;
  };
  // A renderer of a set of derivatives, and the revision that it renders.
  struct Kept {
    std::vector<std::string> derivatives;
    std::uint64_t revision = 0;
    std::unique_ptr<Renderer> renderer;
  };

  const Parameter& find(const std::string& name) const;
  std::size_t index(const std::string& name) const;
  Scene scene_of(const std::vector<double>& values) const;
  RenderOptions render_options(const std::vector<std::string>& derivatives);
  Renderer& renderer_of(const std::vector<std::string>& derivatives, std::uint64_t revision, const Scene& scene);
  void begin(const Wanted& wanted);
  bool wants_derivative(const Scene& scene);
  bool refine();
  bool look_for_step();
  ForwardModel& forward_model();
  bool explain(const std::runtime_error& error);
  void publish();
  std::string misfit() const;
  std::vector<Rendering> renderings() const;  // of groups_
  void look_at_loss();
  void change(const std::function<void(Wanted&)>& what);

  ViewOptions options_;
  Scene scene_;  // as it was loaded
  std::vector<Parameter> parameters_;
  Sensor sensor_;
  Device device_;

  // Shared.
  mutable std::mutex mutex_;
  mutable std::condition_variable news_, work_;
  Wanted wanted_;
  std::shared_ptr<const ViewFrame> frame_ = std::make_shared<ViewFrame>();
  mutable std::chrono::steady_clock::time_point watched_;
  std::uint64_t pictured_ = 0;  // the revision of which a picture is there
  bool stopped_ = false;
  std::atomic<bool> cancel_{false};

  // Used by the rendering thread alone.
  Wanted now_;
  Scene current_;
  std::list<Kept> kept_;  // the last that were used
  std::vector<Accumulation> groups_;
  std::size_t next_group_ = 0;
  int samples_ = 0, part_ = 1;  // of a pixel so far; of the next part
  double sample_s_ = 0;         // what a sample of all pixels takes
  std::string derivative_;      // what groups_ have
  std::string derivative_note_, step_note_, derivative_problem_, problem_;
  std::optional<LossGradient> loss_;
  double exposure_ = 1;
  std::optional<ViewStep> step_;
  bool step_done_ = false;
  std::chrono::steady_clock::time_point published_{}, moved_{};
  // For steps, of the parameters that are fitted and the values of all others.
  std::unique_ptr<ForwardModel> model_;
  std::vector<std::string> model_fit_;
  std::vector<double> model_others_;
  std::vector<TargetImage> targets_;  // one
  std::unique_ptr<Inversion> inversion_;
  InversionState inversion_state_;
  int step_tries_ = 0;
  std::unique_ptr<ProgramBuilder> builder_;
};

}  // namespace itn
