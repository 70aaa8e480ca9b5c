// Exemplars (runtime/training/shown_scene.h) on the device that all calls share.
#pragma once
#include <memory>
#include <mutex>

#include "python/src/device.h"
#include "python/src/running.h"
#include "runtime/training/shown_scene.h"

namespace itn::python {

// Keeps the device for itself as long as it lives, where there is anything to show.
class SharedShowing {
 public:
  SharedShowing(int exemplars, int spp, std::uint64_t seed, Running& running) {
    if (exemplars == 0) return;
    device_ = shared_device();
    lock_ = std::unique_lock(device_->mutex);
    showing = {exemplars, &device_->device, spp, seed, [&running](double fraction) { running.update(fraction); }};
  }
  Showing showing;

 private:
  std::shared_ptr<SharedDevice> device_;
  std::unique_lock<std::mutex> lock_;
};

}  // namespace itn::python
