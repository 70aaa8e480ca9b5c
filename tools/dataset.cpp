// itn dataset: renders the images that networks learn from and are tested on.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <map>
#include <nlohmann/json.hpp>

#include "network/input.h"
#include "runtime/base/error.h"
#include "runtime/base/folder_lock.h"
#include "runtime/base/inputs.h"
#include "runtime/base/seconds_since.h"
#include "runtime/base/version.h"
#include "runtime/dataset/config.h"
#include "runtime/dataset/render_dataset.h"
#include "runtime/dataset/stored_image.h"
#include "runtime/image/contact_sheet.h"
#include "tools/common.h"
#include "tools/interrupt.h"
#include "tools/progress.h"

namespace itn::tools {
namespace {

struct DatasetArguments {
  CommonOptions common;
  std::string config, folder;
  bool preview = false;
};

std::map<std::string, std::size_t> images_of_splits(const Manifest& set) {
  std::map<std::string, std::size_t> count;
  for (const Manifest::Image& image : set.images) ++count[split_name(image.split)];
  return count;
}

// Some images of the set, evenly over its order, in one picture.
void write_preview(const std::string& folder, const Manifest& set) {
  constexpr int columns = 10, most = 60;
  const int count = std::min(most, static_cast<int>(set.images.size()));
  ContactSheet sheet(count, columns, set.size, std::max(1, 96 / set.size));
  for (int i = 0; i < count; ++i) {
    const std::size_t at = set.images.size() * static_cast<std::size_t>(i) / static_cast<std::size_t>(count);
    const Manifest::Image& image = set.images[at];
    sheet.add(luminance_of(read_stored(folder, set, image), folder + "/" + image.file), 1);
  }
  sheet.write(folder + "/preview.png");
}

void run(const DatasetArguments& options, bool seed_given) {
  const CommonOptions& common = options.common;
  Inputs inputs;
  DatasetConfig config = read_dataset_config(options.config);
  if (common.spp == 1)
    throw UsageError("--spp 1: images without standard errors, which nothing can be learnt from; need 2 or more");
  if (common.spp) config.spp = common.spp;
  if (seed_given) config.seed = common.seed;
  const Device device(common.device);
  const DatasetPlan plan = plan_dataset(config, version(), device.info().name + ", " + device.info().platform);
  inputs.end();
  const FolderLock lock(options.folder);
  check_outputs(common, {}, {manifest_file(options.folder)});

  const auto start = std::chrono::steady_clock::now();
  Progress progress(options.config, static_cast<double>(plan.manifest.images.size()), "images", !common.quiet);
  const DatasetProgress end = render_dataset(
      device, plan, options.folder,
      [&](const DatasetProgress& p) { progress.update(static_cast<double>(p.done) / static_cast<double>(p.total)); },
      &interrupt_flag());
  progress.clear();
  if (options.preview) write_preview(options.folder, plan.manifest);
  const double seconds = seconds_since(start);
  const std::map<std::string, std::size_t> splits = images_of_splits(plan.manifest);
  if (common.talkative()) {
    fmt::print("{}: {} images of {} x {} pixels, {} samples each, of {} shapes\n", options.folder, end.total,
               config.size, config.size, config.spp, plan.manifest.shapes.size());
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
  CLI::App* command =
      app.add_subcommand("dataset",
                         "renders a data set: shapes x lights x materials\n\n"
                         "Stopped at any moment, the same command goes on where it was, with the same result.");
  command
      ->add_option("config", options->config,
                   fmt::format("JSON file, or one of the presets {}", fmt::join(dataset_presets(), ", ")))
      ->required();
  command->add_option("-o,--output", options->folder, "folder for manifest.json, images/ and shapes/")->required();
  command->add_flag("--preview", options->preview, "also preview.png: some of the images side by side");
  add_common_options(*command, options->common, "the configuration's");
  command->callback([options, command] { run(*options, command->count("--seed") > 0); });
}

}  // namespace itn::tools
