#include "runtime/dataset/render_dataset.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "runtime/base/error.h"
#include "runtime/base/file.h"
#include "runtime/cluster/ranks.h"
#include "runtime/dataset/dataset_mesh.h"
#include "runtime/dataset/dataset_scene.h"
#include "runtime/dataset/dataset_shapes.h"
#include "runtime/dataset/merge_dataset.h"
#include "runtime/dataset/shape_buffers.h"
#include "runtime/dataset/stored_image.h"
#include "runtime/image/exr.h"
#include "runtime/scene/mesh/mesh_file.h"

namespace itn {
namespace {

constexpr std::int64_t batch_paths = 1 << 22;  // a few seconds: what is lost when the program is killed
constexpr std::size_t most_bytes = 1 << 28;    // of geometries in memory: those of one batch, or all of a few

void write_picture(const std::string& file, const Bitmap& picture) {
  using Channels = std::vector<std::string>;
  const Channels channels = picture.channels == 1 ? Channels{"Y"} : Channels{"R", "G", "B"};
  write_exr(file, {picture.width, picture.height, channels, picture.data, {}});
}

void check_same(const std::string& folder, const Manifest& set) {
  if (!is_there(manifest_file(folder))) return;
  const Manifest there = read_manifest(folder);
  if (there.hash != set.hash)
    throw UsageError(
        fmt::format("{}: holds a data set of another configuration, version or device ({}, now {}); choose "
                    "another folder, or remove this one",
                    folder, there.hash, set.hash));
}

class DatasetRenderer {
 public:
  DatasetRenderer(const Device& device, const Manifest& set, std::string folder, const std::atomic<bool>* cancel)
      : set_(set),
        folder_(std::move(folder)),
        lights_(set, folder_),
        renderer_(device, options(cancel)),
        shapes_(set, folder_, most_bytes),
        placed_(renderer_, shapes_) {}

  // All under the sun or all under environments: then an image's bits do not depend on the others (batch_renderer.h).
  void render(const std::vector<const Manifest::Image*>& images) {
    place(images);
    std::vector<Scene> scenes;
    scenes.reserve(images.size());
    for (const Manifest::Image* image : images) scenes.push_back(scene_of(*image));
    std::vector<BatchImage> batch;
    for (std::size_t i = 0; i < images.size(); ++i)
      batch.push_back({&scenes[i], placed_.geometry(images[i]->shape), images[i]->seed, 0});
    const std::vector<Rendering> renderings = renderer_.render(batch, set_.spp);
    for (std::size_t i = 0; i < images.size(); ++i) write(*images[i], renderings[i]);
  }

 private:
  static RenderOptions options(const std::atomic<bool>* cancel) {
    RenderOptions options;
    options.cancel = cancel;
    return options;
  }

  std::string path(const std::string& file) const { return folder_ + "/" + file; }

  Scene scene_of(const Manifest::Image& image) {
    return dataset_scene(set_, shapes_.made(image.shape).mesh, lights_.of(image.light),
                         {image.sigma_t, image.albedo, image.g});
  }

  // Makes sure that the images' shapes are on the device, and their buffers in the folder.
  void place(const std::vector<const Manifest::Image*>& images) {
    std::vector<int> shapes;
    shapes.reserve(images.size());
    for (const Manifest::Image* image : images) shapes.push_back(image->shape);
    placed_.place(shapes);
    for (const int shape : shapes) {
      const Manifest::Shape& s = set_.shapes[static_cast<std::size_t>(shape)];
      if (!has_buffers_.insert(shape).second || is_stored(folder_, set_, s)) continue;
      write(s, shape_buffers(dataset_scene(set_, shapes_.made(shape).mesh), 0, 1));
    }
  }

  void write(const Manifest::Shape& shape, const ShapeBuffers& buffers) const {
    ExrImage out{set_.size, set_.size, {"normal.X", "normal.Y", "normal.Z", "depth", "mask"}, {}, {}};
    for (std::size_t i = 0; i < buffers.mask.size(); ++i) {
      for (const double n : buffers.normal[i]) out.data.push_back(static_cast<float>(n));
      out.data.push_back(static_cast<float>(buffers.depth[i]));
      out.data.push_back(static_cast<float>(buffers.mask[i]));
    }
    write_stored(folder_, set_, shape, std::move(out));
  }

  void write(const Manifest::Image& image, const Rendering& rendering) const {
    ExrImage out{set_.size, set_.size, {"Y", "stderr.Y"}, {}, {}};
    for (std::size_t i = 0; i < rendering.mean.size(); ++i) {
      out.data.push_back(rendering.mean[i]);
      out.data.push_back(rendering.stderr_[i]);
    }
    write_stored(folder_, set_, image, std::move(out));
  }

  const Manifest& set_;
  std::string folder_;
  DatasetLights lights_;
  BatchRenderer renderer_;
  DatasetShapes shapes_;
  PlacedShapes placed_;
  std::set<int> has_buffers_;  // shapes whose buffers are in the folder
};

// What the images need beside their shapes, and the plan.
void write_sources(const DatasetPlan& plan, const std::string& folder) {
  const Manifest& set = plan.manifest;
  make_folder(folder + "/images");
  make_folder(folder + "/shapes");
  for (std::size_t s = 0; s < set.shapes.size(); ++s)
    if (const auto* mesh = std::get_if<Manifest::FileMesh>(&set.shapes[s].mesh))
      write_ply(folder + "/" + mesh->file, as_dataset_mesh(plan.mesh_files[s]));
  if (!plan.environment_files.empty()) make_folder(folder + "/environments");
  for (const auto& [file, from] : plan.environment_files) write_picture(folder + "/" + file, *read_environment(from));
  write_manifest(folder, set);
}

// All must render with the same bits.
void require_same_plan(Ranks& ranks, const std::string& hash) {
  const std::vector<std::string> all = ranks.gather(hash);
  for (std::size_t r = 0; r < all.size(); ++r)
    if (all[r] != all[0])
      throw UsageError(
          fmt::format("rank {} has another version or device than the first, or sees other files: the "
                      "images of a set must all come from one kind of device",
                      r));
}

// Every rank looks at some of the images. Returns those that are not there, the same on all.
std::vector<const Manifest::Image*> missing_of(const Manifest& set, const std::string& folder, std::size_t first,
                                               std::size_t end, const std::atomic<bool>* cancel, Ranks& ranks) {
  std::vector<std::int64_t> is_missing(end - first);
  std::map<int, bool> has_buffers;  // shapes
  const auto rank = static_cast<std::size_t>(ranks.rank()), count = static_cast<std::size_t>(ranks.count());
  for (std::size_t i = first + rank; i < end; i += count) {
    if (cancel && *cancel) throw Interrupted();
    const Manifest::Image& image = set.images[i];
    const auto [known, is_new] = has_buffers.try_emplace(image.shape, false);
    if (is_new) known->second = is_stored(folder, set, set.shapes[static_cast<std::size_t>(image.shape)]);
    is_missing[i - first] = !(known->second && is_stored(folder, set, image));
  }
  add_up(ranks, is_missing);
  std::vector<const Manifest::Image*> missing;
  for (std::size_t i = first; i < end; ++i)
    if (is_missing[i - first]) missing.push_back(&set.images[i]);
  return missing;
}

// Images are written by whoever has rendered them.
class AllRanksWrite {
 public:
  AllRanksWrite() : before_(set_writing(true)) {}
  ~AllRanksWrite() { set_writing(before_); }
  AllRanksWrite(const AllRanksWrite&) = delete;
  AllRanksWrite& operator=(const AllRanksWrite&) = delete;

 private:
  bool before_;
};

}  // namespace

DatasetProgress render_dataset(const Device& device, const DatasetPlan& plan, const std::string& folder,
                               const std::function<void(const DatasetProgress&)>& report,
                               const std::atomic<bool>* cancel, const DatasetPart& part) {
  Ranks& ranks = world();
  Manifest set = plan.manifest;
  require_same_plan(ranks, set.hash);
  check_same(folder, set);
  const std::size_t first = share_begin(set.images.size(), part.index, part.count),
                    end = share_begin(set.images.size(), part.index + 1, part.count);
  // Others may be at work on other parts, and have found the set complete.
  if (ranks.is_first() && (part.count == 1 || !is_there(manifest_file(folder)))) write_sources(plan, folder);
  ranks.meet();

  std::vector<const Manifest::Image*> missing = missing_of(set, folder, first, end, cancel, ranks);
  DatasetProgress progress{end - first - missing.size(), end - first, 0};
  report(progress);
  DatasetRenderer renderer(device, set, folder, cancel);
  const std::int64_t image_paths = static_cast<std::int64_t>(set.size) * set.size * set.spp;
  const auto batch = static_cast<std::size_t>(std::clamp<std::int64_t>(batch_paths / image_paths, 1, 64));
  const auto under_sun = [&](const Manifest::Image* image) {
    return !set.lights[static_cast<std::size_t>(image->light)].environment;
  };
  const auto environments = std::stable_partition(missing.begin(), missing.end(), under_sun);
  const auto render = [&](auto from, auto to) {
    const AllRanksWrite all_write;
    ranks.hand_out(static_cast<std::size_t>(to - from), batch, [&](std::size_t some_first, std::size_t some_end) {
      renderer.render({from + static_cast<std::ptrdiff_t>(some_first), from + static_cast<std::ptrdiff_t>(some_end)});
      progress.done += some_end - some_first;
      progress.rendered += some_end - some_first;
      report(progress);
    });
  };
  render(missing.begin(), environments);
  render(environments, missing.end());
  progress = {end - first, end - first, missing.size()};
  if (part.count > 1) return progress;
  if (ranks.is_first()) complete_dataset(folder, set);
  return progress;
}

}  // namespace itn
