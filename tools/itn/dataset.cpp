// itn dataset: renders the images that networks learn from and are tested on.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <chrono>
#include <map>
#include <nlohmann/json.hpp>

#include "itn/error.h"
#include "itn/version.h"
#include "network/dataset/config.h"
#include "network/dataset/merge_dataset.h"
#include "network/dataset/render_dataset.h"
#include "network/dataset/stored_image.h"
#include "network/model/input.h"
#include "runtime/base/folder_lock.h"
#include "runtime/base/folder_owner.h"
#include "runtime/base/inputs.h"
#include "runtime/base/seconds_since.h"
#include "runtime/image/contact_sheet.h"
#include "tools/itn/common.h"
#include "tools/itn/interrupt.h"
#include "tools/itn/progress.h"

namespace itn::tools {
namespace {

struct DatasetArguments {
  CommonOptions common;
  std::string config, folder;
  std::string part;  // K/N
  bool preview = false, merge = false;
};

std::map<std::string, std::size_t> images_of_splits(const Manifest& set) {
  std::map<std::string, std::size_t> count;
  for (const Manifest::Image& image : set.images) ++count[split_name(image.split)];
  return count;
}

// Row-major, the colours of a pixel one after the other.
std::vector<float> picture_of(const std::string& folder, const Manifest& set, const Manifest::Image& image) {
  const int colours = set.in_colours ? 3 : 1;
  const std::vector<float> planes = radiance_of(read_stored(folder, set, image), folder + "/" + image.file, colours);
  const auto count = static_cast<std::size_t>(colours), pixels = planes.size() / count;
  std::vector<float> picture(planes.size());
  for (std::size_t i = 0; i < picture.size(); ++i) picture[i] = planes[i % count * pixels + i / count];
  return picture;
}

// Some images of the set, evenly over its order, in one picture.
void write_preview(const std::string& folder, const Manifest& set) {
  constexpr int columns = 10, most = 60;
  const int count = std::min(most, static_cast<int>(set.images.size()));
  ContactSheet sheet(count, columns, set.size, std::max(1, 96 / set.size));
  for (int i = 0; i < count; ++i) {
    const std::size_t at = set.images.size() * static_cast<std::size_t>(i) / static_cast<std::size_t>(count);
    const Manifest::Image& image = set.images[at];
    sheet.add(picture_of(folder, set, image), set.in_colours ? 3 : 1);
  }
  sheet.write(folder + "/preview.png");
}

DatasetPart part_of(const DatasetArguments& options) {
  if (options.part.empty()) return {};
  std::size_t number = 0, count = 0;
  const char* end = options.part.data() + options.part.size();
  const auto [slash, no_number] = std::from_chars(options.part.data(), end, number);
  bool is_part = no_number == std::errc() && slash != end && *slash == '/';
  if (is_part) {
    const auto [stop, no_count] = std::from_chars(slash + 1, end, count);
    is_part = no_count == std::errc() && stop == end && number >= 1 && number <= count;
  }
  if (!is_part) throw UsageError("--part " + options.part + ": need K/N, the K-th of N parts, K from 1 to N");
  if (options.preview) throw UsageError("--preview: a part has not all images; give it with --merge");
  return {number - 1, count};
}

// This process alone, or beside those of other parts.
FolderLock lock_of(const DatasetArguments& options, const DatasetPart& part) {
  if (part.count == 1) return FolderLock(options.folder);
  return {options.folder, fmt::format("{} of {}", part.index + 1, part.count)};
}

void merge(const DatasetArguments& options, const DatasetConfig& config) {
  const CommonOptions& common = options.common;
  const FolderLock lock(options.folder);
  check_outputs(common, {}, {manifest_file(options.folder)});
  const Manifest set = merge_dataset(config, options.folder, &interrupt_flag());
  if (options.preview) write_preview(options.folder, set);
  if (common.talkative()) fmt::print("{}: all {} images are there and whole\n", options.folder, set.images.size());
  write_json(common, {{"schema", "itn.dataset.merge/1"},
                      {"folder", options.folder},
                      {"hash", set.hash},
                      {"images", set.images.size()}});
}

void run(const DatasetArguments& options, bool seed_given) {
  const CommonOptions& common = options.common;
  check_folder(options.folder);
  refuse_folder_of_other(options.folder, "manifest.json");
  Inputs inputs;
  DatasetConfig config = read_dataset_config(options.config);
  if (common.spp) config.spp = common.spp;
  if (seed_given) config.seed = common.seed;
  const DatasetPart part = part_of(options);
  if (options.merge) {
    if (part.count > 1) throw UsageError("--merge: of all parts; leave --part out");
    inputs.end();
    return merge(options, config);
  }
  const Device device(common.device);
  const DatasetPlan plan = plan_dataset(config, version(), device.info().name + ", " + device.info().platform);
  inputs.end();
  const FolderLock lock = lock_of(options, part);
  check_outputs(common, {}, {manifest_file(options.folder)});

  const auto start = std::chrono::steady_clock::now();
  Progress progress(options.config, static_cast<double>(plan.manifest.images.size()), "images", !common.quiet);
  const DatasetProgress end = render_dataset(
      device, plan, options.folder,
      [&](const DatasetProgress& p) { progress.update(static_cast<double>(p.done) / static_cast<double>(p.total)); },
      &interrupt_flag(), part);
  progress.clear();
  if (options.preview) write_preview(options.folder, plan.manifest);
  const double seconds = seconds_since(start);
  const std::map<std::string, std::size_t> splits = images_of_splits(plan.manifest);
  if (common.talkative()) {
    fmt::print("{}: {} images of {} x {} pixels, {} samples each, of {} shapes\n", options.folder, end.total,
               config.size, config.size, config.spp, plan.manifest.shapes.size());
    if (part.count > 1) fmt::print("  part {} of {}\n", part.index + 1, part.count);
    for (const auto& [split, count] : splits) fmt::print("  {:<14} {:>7}\n", split, count);
    if (end.rendered > 0)
      fmt::print("{} rendered in {:.1f} s: {:.1f} images/s\n", end.rendered, seconds,
                 static_cast<double>(end.rendered) / seconds);
    else
      fmt::print("all were there already\n");
  }
  write_json(common, {{"schema", "itn.dataset.render/1"},
                      {"folder", options.folder},
                      {"hash", plan.manifest.hash},
                      {"images", end.total},
                      {"rendered", end.rendered},
                      {"splits", splits},
                      {"time", {{"render_s", seconds}}}});
}

}  // namespace

void add_dataset(CLI::App& app) {
  auto options = std::make_shared<DatasetArguments>();
  CLI::App* command = app.add_subcommand("dataset", "Render a data set of shapes, lights and materials");
  command
      ->add_option("config", options->config,
                   fmt::format("JSON file, or one of the presets {}", fmt::join(dataset_presets(), ", ")))
      ->required();
  command->add_option("-o,--output", options->folder, "Folder for manifest.json, images/ and shapes/")->required();
  command->add_flag("--preview", options->preview, "Also write preview.png: some of the images side by side");
  command->add_option("--part", options->part,
                      "Render only part K of N, given as K/N; parts may run at the same time, on several machines, "
                      "into one folder that --merge completes");
  command->add_flag("--merge", options->merge,
                    "Render nothing, but check that all parts are there and whole, and complete the manifest");
  group_options(*command, "Parts", {"--part", "--merge"});
  add_common_options(*command, options->common, "the configuration's");
  add_example(*command, "itn dataset tiny -o tiny --preview",
              "Stopped at any moment, the same command resumes, with the same result.");
  command->callback([options, command] { run(*options, command->count("--seed") > 0); });
}

}  // namespace itn::tools
