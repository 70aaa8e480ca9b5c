// From what a data set is asked for to the list of its images.
#pragma once
#include <map>
#include <string>
#include <vector>

#include "network/dataset/config.h"
#include "network/dataset/manifest.h"

namespace itn {

struct DatasetPlan {
  Manifest manifest;                    // not complete
  std::vector<std::string> mesh_files;  // of each shape: the file to copy its mesh from; empty: made here
  std::map<std::string, std::string> environment_files;  // in the set's folder: the file to copy it from
};

// Training shapes under training lights: split `train`, every tenth material (with random shapes: shape) `validation`.
// Training shapes under test lights: unseen_light, unless the shapes are random. Test shapes under training lights:
// unseen_shape; under test lights: unseen_both. Where the training's suns are drawn from a range no sun is unseen, and
// test shapes have the test's lights only, under suns as unseen_shape.
// Materials follow a low-discrepancy sequence. Everything is a function of the configuration; the hash is of that, the
// mesh and environment files, version and device. Throws UsageError: too few samples a pixel; InputError: mesh or
// environment files that cannot be used, two shapes or environments of one name, more than 10^6 images.
DatasetPlan plan_dataset(const DatasetConfig& config, const std::string& version, const std::string& device);

}  // namespace itn
