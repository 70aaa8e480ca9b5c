// The scene of a data set's images, as in the authors' code: one translucent object on a large textured floor, seen by
// a long lens from 45 degrees above, or from wherever its image says.
#pragma once
#include <memory>
#include <optional>

#include "itn/scene.h"
#include "network/dataset/dataset_light.h"
#include "network/dataset/manifest.h"

namespace itn {

struct DatasetMaterial {
  double sigma_t = 100;  // [1/mm]
  double albedo = 0.8, g = 0.4;
  std::optional<Manifest::Colours> colours = {};  // instead of sigma_t and albedo, in a set in colours
};

// The material of the object in an image.
DatasetMaterial material_of(const Manifest::Image& image);

// The medium's sigma_t, albedo and the phase function's g, as list_parameters() names them in every such scene.
extern const char *const dataset_sigma_t, *const dataset_albedo, *const dataset_g;

// set: its size, spp, millimetres a unit, boundary and whether it is in colours are looked at, image: its camera and
// boundary. shape: closed, resting on z = 0, longest side 1, its middle over the origin. light: of dataset_light.h.
// Scenes of one shape share its mesh, and all share the floor's: they have the same geometry.
Scene dataset_scene(const Manifest& set, const Manifest::Image& image, const std::shared_ptr<const Mesh>& shape,
                    const Environment& light = sun_and_sky({0, 0, 1}), const DatasetMaterial& material = {});

// From the camera and within the boundary that the set has for all images.
Scene dataset_scene(const Manifest& set, const std::shared_ptr<const Mesh>& shape,
                    const Environment& light = sun_and_sky({0, 0, 1}), const DatasetMaterial& material = {});

// Such a scene in no other light than that of a soft lamp around the camera. irradiance: of a surface that faces it.
Scene in_flash(Scene scene, double irradiance);

// A direction in the frame of the image's camera: rotated about the vertical, as if the camera looked along +y and
// down.
Vec3 before_camera(const Manifest::Image& image, const Vec3& direction);

}  // namespace itn
