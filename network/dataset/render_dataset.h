// From the plan of a data set to its files.
#pragma once
#include <atomic>
#include <functional>
#include <string>

#include "itn/device.h"
#include "network/dataset/plan.h"

namespace itn {

struct DatasetProgress {
  std::size_t done = 0, total = 0;  // images, those found in the folder included
  std::size_t rendered = 0;         // of them now
};

// One of so many parts of about equal size, to be rendered apart (merge_dataset.h).
struct DatasetPart {
  std::size_t index = 0, count = 1;
};

// Renders the images that the folder has not yet, many at once, and writes the manifest: first as the plan, complete at
// the end. Stopped at any moment and called again with the same plan, it ends with the same bytes. The caller has
// locked the folder. Of several parts it renders one, and leaves the manifest incomplete. All ranks of world() call it
// together, and render what the next has not taken yet; `report` tells of this rank. Throws UsageError: the folder
// holds another set, or another rank's device is another; InputError: a mesh file; ResultError: not writable;
// Interrupted.
DatasetProgress render_dataset(const Device& device, const DatasetPlan& plan, const std::string& folder,
                               const std::function<void(const DatasetProgress&)>& report,
                               const std::atomic<bool>* cancel, const DatasetPart& part = {});

}  // namespace itn
