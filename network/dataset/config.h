// The request for a data set: a JSON file or the name of a preset (README.md).
#pragma once
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "network/dataset/manifest.h"

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
    // For lights that are drawn:
    double lamps = 0;     // the share of lamps in a room, dataset_light.h
    double pictures = 0;  // the share of `environments`, which are then no others' lights
    std::optional<std::array<double, 2>> zenith_range{};  // of the sun [degree]; none: DatasetConfig::zenith
    int materials = 1;
    int albedos = 1;  // images of each material, of the same paths: it stands for so many, which differ in albedo
  };
  struct Cameras {
    std::array<double, 2> elevation{}, azimuth{};  // Manifest::Camera, drawn from here
  };
  struct Boundaries {
    double matched = 0;                        // share of them, in [0, 1]
    std::array<double, 2> alpha{}, int_ior{};  // of the others; even
  };
  int size = 64, spp = 128;
  std::uint64_t seed = 0;
  double longest_side_mm = 1;
  Manifest::Boundary boundary;
  std::optional<Boundaries> boundaries;  // each image's own, instead
  std::optional<Cameras> cameras;        // each image's own; none: the one of Manifest::Camera
  bool in_colours = false;               // red, green and blue of images, sigma_t and albedo
  double flash = 0;                      // irradiance of a lamp at the camera; 0: none
  double zenith = 30;                    // of the sun [degree]
  double environment_scale = 1;          // radiance in the scene over that in the files
  std::array<double, 2> sigma_t{25, 300}, albedo{0.3, 0.95},
      g{0, 0.9};                // sigma_t [1/mm]: equal ratios are equally likely, or
  bool linear_sigma_t = false;  // equal differences
  Side train, test;
};

// The name of a preset ("tiny", "laptop", "varied", "world", "paper"), else a JSON file. A key that the file leaves out
// has the value of the preset `laptop`. Throws InputError naming the file, the key, what is there and what is needed.
DatasetConfig read_dataset_config(const std::string& name_or_file);

const std::vector<std::string>& dataset_presets();

// As JSON, every key filled in: read_dataset_config() of it gives the same.
std::string to_json(const DatasetConfig& config);

}  // namespace itn
