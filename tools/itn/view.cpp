// itn view: a scene in a browser, live.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <exception>
#include <nlohmann/json.hpp>
#include <thread>

#include "itn/error.h"
#include "runtime/base/inputs.h"
#include "tools/itn/common.h"
#include "tools/itn/interrupt.h"
#include "tools/itn/private_json.h"
#include "tools/itn/target_options.h"
#include "tools/itn/view_page.h"

namespace itn::tools {
namespace {

struct ViewArguments {
  CommonOptions common;
  std::string scene, target, mask;
  Operator op = Operator::full;
  int sensor = 0, port = 0;
  std::optional<FilmSize> size;
  std::optional<double> noise;
  bool exposure = false;
  PhotoOptions photo;
};

// Renders while somebody looks, in a thread of its own. What it fails with ends the command.
class Painter {
 public:
  explicit Painter(ViewSession& session) : session_(session), thread_([this] { paint(); }) {}
  ~Painter() { end(); }
  Painter(const Painter&) = delete;
  Painter& operator=(const Painter&) = delete;

  const std::atomic<bool>& ended() const { return ended_; }
  void end() {
    session_.stop();
    if (thread_.joinable()) thread_.join();
  }
  void raise() const {
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  void paint() {
    constexpr auto unwatched = std::chrono::seconds(5);
    constexpr auto rest = std::chrono::milliseconds(100);
    try {
      while (!interrupt_flag()) {
        const bool watched = std::chrono::steady_clock::now() - session_.watched() < unwatched;
        const bool first = session_.frame()->number == 0;
        if ((!watched && !first) || !session_.advance()) {
          if (session_.stopped()) break;
          session_.wait_for_work(rest);
        }
      }
    } catch (...) {
      failure_ = std::current_exception();
    }
    ended_ = true;
  }

  ViewSession& session_;
  std::atomic<bool> ended_{false};
  std::exception_ptr failure_;
  std::thread thread_;
};

void run(const ViewArguments& options) {
  const CommonOptions& common = options.common;
  Inputs inputs;
  const ViewedScene viewed{options.scene, common.definition_map(), {.size = options.size, .open = common.open}};
  Scene scene = load_scene(viewed.file, viewed.definitions, viewed.options);
  for (const std::string& text : scene.warnings) warn(common, text);
  const Sensor& sensor = chosen_sensor(scene, options.sensor);
  ViewOptions view;
  if (!options.target.empty()) {
    std::vector<TargetImage> target{read_target(options.target, options.mask, sensor.crop_width, sensor.crop_height,
                                                sensor.luminance ? 1 : 3, options.photo)};
    print_notes(common, target, !options.exposure);
    view.noise = settle_noise(common, target, options.noise);
    view.target = target.front();
    view.exposure = options.exposure;
  } else if (!options.mask.empty()) {
    throw UsageError("--mask: it weighs the pixels of a target; need --target, too");
  }
  inputs.end();
  check_outputs(common, {});
  view.device = common.device;
  view.sensor = options.sensor;
  view.spp = common.spp > 0 ? common.spp : view.spp;
  view.seed = common.seed;
  view.op = options.op;
  ViewSession session(std::move(scene), view);
  Painter painter(session);
  ViewPage page(session, viewed);
  LoopbackServer server(options.port, [&](const WebRequest& request) { return page.answer(request); });
  if (common.talkative()) {
    fmt::print("{}\nOpen this address in a browser on this machine. Ctrl-C ends.\n", server.address());
    std::fflush(stdout);
  }
  // Anybody who reads the address can change what is shown.
  write_private_json(common, {{"schema", "itn.view/1"},
                              {"scene", options.scene},
                              {"target", options.target},
                              {"address", server.address()},
                              {"port", server.port()}});
  server.run(painter.ended());
  painter.end();
  painter.raise();
  throw Interrupted();
}

}  // namespace

void add_view(CLI::App& app) {
  auto options = std::make_shared<ViewArguments>();
  CLI::App* command = app.add_subcommand("view", "Show a scene in a browser, live, with sliders for its parameters");
  command->add_option("scene", options->scene, "Mitsuba 3 XML file")->required();
  command->add_option("--port", options->port, "Port of the address; 0: any that is free")
      ->check(CLI::Range(0, 65535))
      ->capture_default_str();
  add_operator_option(*command, options->op);
  add_sensor_option(*command, options->sensor);
  add_size_option(*command, options->size);
  group_options(*command, "What is rendered", {"--operator", "--sensor", "--size"});
  command->add_option("--target", options->target,
                      "Image to compare with, OpenEXR of the film's size or a photo (PNG, JPEG, TIFF): shows residual, "
                      "loss and Gauss-Newton's step");
  command->add_option(
      "--mask", options->mask,
      "Weights of the target's pixels, 0 to 1: OpenEXR (channel Y, R or else the first), or PNG and the "
      "like (grey or red)");
  command->add_flag("--exposure", options->exposure, "Find a factor on the target, too: its exposure");
  add_noise_option(*command, options->noise);
  group_options(*command, "Target", {"--target", "--mask", "--exposure", "--noise"});
  add_photo_options(*command, options->photo);
  add_common_options(*command, options->common, "refined up to 1024");
  add_open_option(*command, options->common);
  add_example(*command, "itn view wax.xml --size 128x128 --target photo.exr",
              "Prints the address of a page that only browsers on this machine can open, and ends with Ctrl-C (exit "
              "code 130).");
  command->callback([options] { run(*options); });
}

}  // namespace itn::tools
