// A network's guess as the start of an inversion.
#pragma once
#include <string>
#include <vector>

#include "itn/photo.h"
#include "itn/scene.h"
#include "runtime/inverse/prior.h"

namespace itn {

// What a network that says a distribution (include/itn/distribution.h) knows of the scene's parameters.
struct NetworkGuess {
  std::vector<std::string> parameters;       // of single numbers; none: the network says no distribution
  std::vector<std::vector<double>> samples;  // of the distribution inside the network's ranges: values, one a parameter
  std::string warning;                       // where its judge doubts the image; empty otherwise

  // The same normal distribution of an inversion's coordinates.
  Prior prior(const std::vector<Coordinate>& coordinates) const;
  // "NAME=LOW,HIGH (network)", intervals of 95 %: for InversionQuestion::prior.
  std::vector<std::string> words() const;
};

// Gives each of the scene's `parameters` that is the sigma_t, albedo or g of a medium what the network of `run` sees in
// the image, which `sensor` took: sigma_t [1/mm] times the millimetres of the longest side of the bodies that it learnt
// from, over that of the medium's body in scene units and the medium's scale; a colour gets the grey guess in every
// component. Those in `given` are left alone. Returns what is known of the others; a colour's components, of which the
// network sees luminance alone, are left out. Networks of six channels get shape and light from the scene. Throws
// UsageError: another parameter that is not given, parameters of several media, a medium inside of several shapes or
// none, shapes or light that the network cannot know; InputError: a network or an image (read_resampled_radiance())
// that cannot be used.
NetworkGuess set_network_start(Scene& scene, const std::vector<std::string>& parameters,
                               const std::vector<std::string>& given, const std::string& run, const std::string& image,
                               int sensor, const PhotoOptions& photo);

}  // namespace itn
