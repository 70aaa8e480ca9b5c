// The public interface: a scene in, an image with its standard error out.
#pragma once
#include <memory>

#include "itn/device.h"
#include "itn/render_options.h"
#include "itn/rendering.h"
#include "itn/scene.h"

namespace itn {

// A scene on a device, ready to render its samples in parts.
class Renderer {
 public:
  // Options as for render(), but that spp is not looked at. Throws as render().
  Renderer(const Device& device, const Scene& scene, const RenderOptions& options);
  ~Renderer();
  // Samples first_sample ... first_sample + samples - 1 of every pixel: parts of one seed make up the whole.
  // first_sample >= 0, samples >= 1.
  Rendering render(int first_sample, int samples);
  // From now on renders this scene: the one of before with other values of its parameters (scene/parameters.h), the
  // same shapes, sensors and files. Quick: the geometry stays on the device.
  void replace(const Scene& scene);
  // From now on the random numbers of another seed, as if this had been made with it.
  void reseed(std::uint64_t seed);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// Throws UsageError (no such sensor, spp < 1, a parameter that is unknown or not differentiable), DeviceError,
// Interrupted.
Rendering render(const Device& device, const Scene& scene, const RenderOptions& options);

}  // namespace itn
