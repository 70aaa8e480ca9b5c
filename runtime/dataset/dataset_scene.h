// The scene of a data set's images, as in the authors' code: one translucent object on a large textured floor, seen by
// a long lens from 45 degrees above, under sun and sky with a widened sun.
#pragma once
#include <memory>

#include "runtime/dataset/manifest.h"
#include "runtime/scene/scene.h"

namespace itn {

struct DatasetMaterial {
  double sigma_t = 100;  // [1/mm]
  double albedo = 0.8, g = 0.4;
};

// Towards the sun, unit; z is up, the camera looks along +y and down. azimuth [degree]: from behind the object (0,
// back-lighting) to its side (90); zenith [degree].
std::array<double, 3> sun_direction(double azimuth, double zenith);

// The medium's sigma_t, albedo and the phase function's g, as list_parameters() names them in every such scene.
extern const char *const dataset_sigma_t, *const dataset_albedo, *const dataset_g;

// set: its size, spp, millimetres a unit, and boundary are looked at. shape: closed, resting on z = 0, longest side 1,
// its middle over the origin. Scenes of one shape share its mesh, and all share the floor's: they have the same
// geometry.
Scene dataset_scene(const Manifest& set, const std::shared_ptr<const Mesh>& shape,
                    const std::array<double, 3>& towards_sun, const DatasetMaterial& material);

}  // namespace itn
