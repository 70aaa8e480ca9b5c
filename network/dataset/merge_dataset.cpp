#include "network/dataset/merge_dataset.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <vector>

#include "itn/error.h"
#include "itn/file.h"
#include "itn/version.h"
#include "network/dataset/stored_image.h"
#include "runtime/base/folder_lock.h"
#include "runtime/base/parallel.h"

namespace itn {
namespace {

void require_same(const std::string& folder, const Manifest& set, const DatasetConfig& config) {
  if (set.version != version())
    throw UsageError(
        fmt::format("{}: its parts were rendered by version {}, this is {}", folder, set.version, version()));
  if (nlohmann::json::parse(set.config) != nlohmann::json::parse(to_json(config)))
    throw UsageError(folder +
                     ": holds a data set of another configuration; give the one that its parts were made with");
}

// The indices of those that are not there as they should be.
template <class Item>
std::vector<std::size_t> missing_of(const std::string& folder, const Manifest& set, const std::vector<Item>& items,
                                    const std::atomic<bool>* cancel) {
  std::vector<char> is_missing(items.size());
  parallel_for(items.size(), [&](std::size_t i) {
    if (cancel && *cancel) throw Interrupted();
    is_missing[i] = !is_stored(folder, set, items[i]);
  });
  std::vector<std::size_t> missing;
  for (std::size_t i = 0; i < items.size(); ++i)
    if (is_missing[i]) missing.push_back(i);
  return missing;
}

}  // namespace

Manifest merge_dataset(const DatasetConfig& config, const std::string& folder, const std::atomic<bool>* cancel) {
  Manifest set = read_manifest(folder);
  require_same(folder, set, config);
  const std::vector<std::size_t> images = missing_of(folder, set, set.images, cancel),
                                 shapes = set.cameras ? std::vector<std::size_t>()
                                                      : missing_of(folder, set, set.shapes, cancel);
  if (!images.empty() || !shapes.empty())
    throw ResultError(fmt::format(
        "{}: {} of {} images and the buffers of {} of {} shapes are missing or damaged, the first {}; run the parts "
        "again that hold them, or render the set as a whole (neither part nor merge), which renders what is missing",
        folder, images.size(), set.images.size(), shapes.size(), set.shapes.size(),
        images.empty() ? set.shapes[shapes.front()].buffers : set.images[images.front()].file));
  complete_dataset(folder, set);
  return set;
}

void complete_dataset(const std::string& folder, Manifest& set) {
  for (const char* part : {"", "/images", "/shapes"}) remove_remains(folder + part);
  remove_part_locks(folder);
  sync_folder(folder);  // a complete set is there whole, whatever happens to the machine
  set.complete = true;
  write_manifest(folder, set);
}

}  // namespace itn
