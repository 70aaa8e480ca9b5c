// From what a data set is asked for to the list of its images.
#pragma once
#include <string>
#include <vector>

#include "runtime/dataset/config.h"
#include "runtime/dataset/manifest.h"

namespace itn {

struct DatasetPlan {
  Manifest manifest;                    // not complete
  std::vector<std::string> mesh_files;  // of each shape: the file to copy its mesh from; empty: made here
};

// Training shapes under training lights: split `train`, every tenth material (with random shapes: shape) `validation`.
// Training shapes under test lights: unseen_light, unless the shapes are random. Test shapes under training lights:
// unseen_shape; under test lights: unseen_both. Where the training's lights are drawn from a range no light is unseen,
// and test shapes have the test's lights only, as unseen_shape.
// Materials follow a low-discrepancy sequence. Everything is a function of the configuration; the hash is of that, the
// mesh files, version and device. Throws InputError: mesh files that cannot be read, two shapes of one name.
DatasetPlan plan_dataset(const DatasetConfig& config, const std::string& version, const std::string& device);

}  // namespace itn
