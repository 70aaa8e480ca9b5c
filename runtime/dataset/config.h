// What a data set is asked for with: a JSON file or the name of a preset (README.md).
#pragma once
#include <array>
#include <string>
#include <vector>

#include "runtime/dataset/manifest.h"

namespace itn {

struct DatasetConfig {
  // Shapes and lights of one side of the experiment; every combination of them gets so many materials.
  struct Side {
    std::vector<std::string> shapes;  // names of named_shapes(), or mesh files
    int random_shapes = 0;            // more, from random_shape()
    int triangles = 6000;             // of a random shape, about
    std::vector<double> azimuths;     // of the sun [degree], dataset_light.h; no light at all: drawn for each image
    std::array<double, 2> azimuth_range{};  // drawn from here
    // Besides, or instead: pictures of the surroundings, each turned so that its middle stands at each azimuth.
    std::vector<std::string> environments;  // files, dataset_light.h
    std::vector<double> environment_azimuths{0};
    int materials = 1;
  };
  int size = 64, spp = 128;
  std::uint64_t seed = 0;
  double longest_side_mm = 1;
  Manifest::Boundary boundary;
  double zenith = 30;            // of the sun [degree]
  double environment_scale = 1;  // radiance in the scene over that in the files
  std::array<double, 2> sigma_t{25, 300}, albedo{0.3, 0.95},
      g{0, 0.9};  // sigma_t [1/mm]: equal ratios are equally likely
  Side train, test;
};

// The name of a preset ("tiny", "laptop", "varied", "paper"), else a JSON file. A key that the file leaves out has the
// value of the preset `laptop`. Throws InputError naming the file, the key, what is there and what is needed.
DatasetConfig read_dataset_config(const std::string& name_or_file);

const std::vector<std::string>& dataset_presets();

// As JSON, every key filled in: read_dataset_config() of it gives the same.
std::string to_json(const DatasetConfig& config);

}  // namespace itn
