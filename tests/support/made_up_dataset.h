// A small data set that was not rendered, from whose images the parameters can be learnt.
#pragma once
#include <string>

#include "network/dataset/manifest.h"

constexpr int made_up_size = 8;  // pixels a side

// Contents of the images: chequers whose mean tells albedo, whose contrast sigma_t and whose slope across g, times
// some noise. Shapes 0 (train) and 1 (test): the upper half of a ball, and a slope; lights: the zenith, and 60 degrees
// from it.
struct MadeUpDataset {
  std::string folder;
  itn::Manifest manifest;

  // As the files of the folder, which must be there.
  MadeUpDataset(std::string folder, int training, int validation);

  std::string path(const std::string& file) const { return folder + "/" + file; }
  void write_manifest() const { itn::write_manifest(folder, manifest); }
};
