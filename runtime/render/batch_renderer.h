// Many small images of different scenes in one wavefront, so that the device stays full: data sets, mini-batches.
#pragma once
#include <memory>
#include <vector>

#include "itn/renderer.h"
#include "runtime/render/compile/geometry.h"

namespace itn {

// One image of a batch: samples first_sample, first_sample + 1, ... of one sensor's pixels.
struct BatchImage {
  const Scene* scene = nullptr;
  int geometry = 0;  // as add_geometry() returned for the scene's shapes
  std::uint64_t seed = 0;
  int first_sample = 0;
  // Also renders the scene with other albedos of its only medium, from the same paths, an image for each at hardly any
  // more time: a path of n scattering events gathers (other / albedo)^n times as much (White Monte Carlo). For albedos
  // up to the scene's the noise is about that of a rendering of their own. All images of a batch have equally many.
  std::vector<Rgb> other_albedos = {};
};

class BatchRenderer {
 public:
  // Options as for render(), of all images; seed and spp are not looked at, and derivatives are by media and surfaces
  // only. The device must outlive it.
  BatchRenderer(const Device& device, const RenderOptions& options);
  ~BatchRenderer();

  // The shapes of a scene as the device needs them: some tenths of a second of work. Any thread may call it at any
  // time.
  Geometry geometry_of(const Scene& scene) const;

  // Keeps them on the device, for any scenes that have the same shapes with whatever BSDFs and media, as long as the
  // same of them have a medium.
  int add_geometry(const Geometry& geometry);
  void forget_geometries();

  // The same bits as render() of each alone, in whichever batch, as long as the scenes of all batches have the same
  // kinds of BSDFs, media and light; Baselines::automatic has them off here, where to learn them for each image anew
  // would take as long as many a small image itself. groups, a divisor of spp: that many renderings of each image, one
  // after another, of spp / groups samples each: those from first_sample on, then the next. Throws as render(), and
  // UsageError: sensors that differ in `luminance`, scenes in which the derivatives' parameters are others, and as
  // albedo_exponents() (compile/derivative_data.h).
  std::vector<Rendering> render(const std::vector<BatchImage>& images, int spp, int groups = 1);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace itn
