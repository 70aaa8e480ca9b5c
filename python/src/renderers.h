// The renderers that a scene keeps, and how a call uses one.
#pragma once
#include <algorithm>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "itn/error.h"
#include "itn/gradient_renderer.h"
#include "itn/renderer.h"
#include "python/src/device.h"
#include "python/src/running.h"
#include "python/src/scene.h"
#include "runtime/render/batch_renderer.h"

namespace itn::python {

// The options that a renderer is made for.
struct RendererKey {
  int sensor = 0;
  Operator op = Operator::full;
  std::vector<std::string> derivatives;
  bool operator==(const RendererKey&) const = default;
};

// A renderer that lives longer than the calls that use it, one after the other. Declared in the order in which what
// comes later needs what comes before.
template <class Made>
struct Kept {
  RendererKey key;
  std::shared_ptr<SharedDevice> device;
  std::shared_ptr<const Scene> scene;  // that it renders now
  std::uint64_t seed = 0;
  std::atomic<bool> cancel{false};
  Running* call = nullptr;  // that it renders for now
  std::unique_ptr<Made> renderer;
  int geometry = -1;  // of batches

  RenderOptions options() {
    RenderOptions result;
    result.sensor = key.sensor;
    result.op = key.op;
    result.derivatives = key.derivatives;
    result.seed = seed;
    result.cancel = &cancel;
    result.progress = [this](double done) { call->update(done); };
    return result;
  }
};

// The last that were used, so that the next image of the same kind finds its geometry and program on the device.
template <class Made>
class KeptRenderers {
 public:
  // Null: there is none.
  std::unique_ptr<Kept<Made>> take(const SharedDevice* device, const RendererKey& key) {
    const std::lock_guard lock(mutex_);
    const auto found = std::find_if(kept_.begin(), kept_.end(), [&](const std::unique_ptr<Kept<Made>>& k) {
      return k->device.get() == device && k->key == key;
    });
    if (found == kept_.end()) return nullptr;
    std::unique_ptr<Kept<Made>> result = std::move(*found);
    kept_.erase(found);
    return result;
  }
  void give_back(std::unique_ptr<Kept<Made>> renderer) {
    const std::lock_guard lock(mutex_);
    kept_.push_front(std::move(renderer));
    if (kept_.size() > most) kept_.pop_back();
  }

 private:
  static constexpr std::size_t most = 4;
  std::mutex mutex_;
  std::list<std::unique_ptr<Kept<Made>>> kept_;
};

struct SceneObject::Renderers {
  KeptRenderers<Renderer> images;
  KeptRenderers<GradientRenderer> gradients;
  KeptRenderers<BatchRenderer> batches;
};

// Made for this scene, or told of it: Renderer and GradientRenderer.
template <class Made>
void show(Kept<Made>& kept, const std::shared_ptr<const Scene>& scene, std::uint64_t seed) {
  if (kept.renderer && kept.scene != scene) {
    try {
      kept.renderer->replace(*scene);
    } catch (const std::logic_error&) {  // it needs another program
      kept.renderer.reset();
    }
  }
  kept.scene = scene;
  if (!kept.renderer) {
    kept.seed = seed;
    kept.renderer = std::make_unique<Made>(kept.device->device, *scene, kept.options());
  } else if (kept.seed != seed) {
    kept.renderer->reseed(seed);
    kept.seed = seed;
  }
}

// use(kept) with a renderer for it, and the device to itself. One that fails is thrown away: half of a rendering may
// be left in it.
template <class Made, class Use>
auto with_renderer(KeptRenderers<Made>& all, const RendererKey& key, Running& running, const Use& use) {
  const std::shared_ptr<SharedDevice> device = shared_device();
  const std::lock_guard lock(device->mutex);
  if (running.cancel()) throw Interrupted();
  std::unique_ptr<Kept<Made>> kept = all.take(device.get(), key);
  if (!kept) {
    kept = std::make_unique<Kept<Made>>();
    kept->key = key;
    kept->device = device;
  }
  kept->cancel = false;
  kept->call = &running;
  running.also_cancel(&kept->cancel);
  struct End {
    Running& running;
    ~End() { running.also_cancel(nullptr); }
  } end{running};
  auto result = use(*kept);
  all.give_back(std::move(kept));
  return result;
}

}  // namespace itn::python
