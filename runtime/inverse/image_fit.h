// Tests whether the scene with the found parameters agrees with its targets, by their residuals: are these as large as
// the noise (chi-square), and are neighbours uncorrelated (structure)? Noise of pixels is independent, and residuals of
// a wrong material, light, shape, boundary or lens are not, so the second test finds a misfit far below the noise of a
// pixel, and needs no knowledge of how strong the noise is.
#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace itn {

// Rendered minus target, in standard deviations of the noise of both.
struct WhiteResidual {
  int width = 0, height = 0, channels = 1;
  std::vector<double> value;           // as TargetImage::value; 0: not compared
  std::vector<double> deviation = {};  // of that noise
};

struct ImageFit {
  double values = 0;                             // how many were compared
  double chi_square = 1, chi_square_stderr = 0;  // mean of their squares, 1: as the noise says
  double structure = 0;                          // in standard deviations of what independent noise has
  double chance = 1;                             // how often independent noise has that much
  bool noise_known = false;                      // else chi_square says nothing
  // Textures and grids have as many values as there are pixels: iterations end long before neighbours know nothing of
  // each other, and the values follow the noise, so that only what is left beyond it counts.
  bool many_unknowns = false;

  // Neighbours know no more of each other than chance makes.
  bool looks_alike() const;
  // 1: what is left is larger than the noise; -1: smaller; 0: as large, or the noise is not known.
  int size() const;
  bool fits() const;
};

// Structure: the sum of products of all pixels (channel with channel) not farther apart than a radius, with a few
// radii, over what it is with each pixel's sign thrown at random; the largest counts. residuals: one a target.
ImageFit image_fit(const std::vector<WhiteResidual>& residuals, bool noise_known, std::uint64_t seed = 0);

// A sentence.
std::string words(const ImageFit& fit);
nlohmann::ordered_json to_json(const ImageFit& fit);

}  // namespace itn
