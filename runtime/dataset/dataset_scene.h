// The scene of a data set's images, as in the authors' code: one translucent object on a large textured floor, seen by
// a long lens from 45 degrees above.
#pragma once
#include <memory>

#include "runtime/dataset/dataset_light.h"
#include "runtime/dataset/manifest.h"
#include "runtime/scene/scene.h"

namespace itn {

struct DatasetMaterial {
  double sigma_t = 100;  // [1/mm]
  double albedo = 0.8, g = 0.4;
};

// The medium's sigma_t, albedo and the phase function's g, as list_parameters() names them in every such scene.
extern const char *const dataset_sigma_t, *const dataset_albedo, *const dataset_g;

// set: its size, spp, millimetres a unit, and boundary are looked at. shape: closed, resting on z = 0, longest side 1,
// its middle over the origin. light: sun_and_sky() or environment_light(). Scenes of one shape share its mesh, and all
// share the floor's: they have the same geometry.
Scene dataset_scene(const Manifest& set, const std::shared_ptr<const Mesh>& shape,
                    const Environment& light = sun_and_sky({0, 0, 1}), const DatasetMaterial& material = {});

}  // namespace itn
