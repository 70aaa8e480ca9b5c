// From the parts of a data set, each rendered by itself, to the whole.
#pragma once
#include <atomic>
#include <string>

#include "network/dataset/config.h"
#include "network/dataset/manifest.h"

namespace itn {

// Reads every image and every shape's buffers, and then writes the manifest as complete. Needs no device. The caller
// has locked the folder. Throws InputError: no manifest there; UsageError: of another configuration or version;
// ResultError: some are missing or damaged, which it counts and whose first it names; Interrupted.
Manifest merge_dataset(const DatasetConfig& config, const std::string& folder, const std::atomic<bool>* cancel);

// Finishes a set whose images are all there: removes remains, and has the manifest say that the set is complete.
void complete_dataset(const std::string& folder, Manifest& set);

}  // namespace itn
