#include "runtime/view/program_builder.h"

#include <exception>

#include "itn/renderer.h"

namespace itn {

ProgramBuilder::~ProgramBuilder() {
  if (thread_.joinable()) thread_.join();
}

bool ProgramBuilder::is_ready(const Scene& scene, const RenderOptions& options) {
  const std::lock_guard lock(mutex_);
  const auto known = done_.find(options.derivatives);
  if (known != done_.end()) return known->second;
  if (busy_) return false;
  if (thread_.joinable()) thread_.join();
  busy_ = true;
  done_[options.derivatives] = false;
  thread_ = std::thread([this, scene, options] { build(scene, options); });
  return false;
}

void ProgramBuilder::build(Scene scene, RenderOptions options) {
  options.cancel = nullptr;
  options.progress = nullptr;
  Sensor& sensor = scene.sensors.at(static_cast<std::size_t>(options.sensor));
  constexpr int few = 8;
  sensor.crop_width = std::min(few, sensor.crop_width);
  sensor.crop_height = std::min(few, sensor.crop_height);
  try {
    const Device device(device_);
    Renderer(device, scene, options).render(0, 1);
  } catch (const std::exception&) {
    // Whoever asked builds it again and hears the same.
  }
  const std::lock_guard lock(mutex_);
  done_[options.derivatives] = true;
  busy_ = false;
}

}  // namespace itn
