#include "network/dataset/render_dataset.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include "itn/error.h"
#include "itn/exr.h"
#include "itn/file.h"
#include "network/dataset/dataset_mesh.h"
#include "network/dataset/dataset_scene.h"
#include "network/dataset/dataset_shapes.h"
#include "network/dataset/merge_dataset.h"
#include "network/dataset/shape_buffers.h"
#include "network/dataset/stored_image.h"
#include "runtime/base/parallel.h"
#include "runtime/base/random.h"
#include "runtime/base/ranks.h"
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

std::vector<std::string> channels_of(const Manifest& set) {
  const auto add_light = [&](std::vector<std::string>& names, const std::string& light) {
    for (const char* error : {"", "stderr."})
      for (const std::string& letter : colour_names(set)) names.push_back(light + error + letter);
  };
  std::vector<std::string> names;
  add_light(names, "");
  if (set.flash > 0) add_light(names, "flash.");
  if (set.cameras) names.insert(names.end(), buffer_names.begin(), buffer_names.end());
  return names;
}

class DatasetRenderer {
 public:
  DatasetRenderer(const Device& device, const Manifest& set, std::string folder, const std::atomic<bool>* cancel)
      : set_(set),
        folder_(std::move(folder)),
        lights_(set, folder_),
        shapes_(set, folder_, most_bytes),
        ambient_(device, options(cancel), shapes_),
        channels_(channels_of(set)) {
    if (set.flash > 0) flash_.emplace(device, options(cancel), shapes_);
  }

  // All of one kind_of(): then an image's bits do not depend on the others (batch_renderer.h). Those of the same paths
  // come one after another.
  void render(const std::vector<const Manifest::Image*>& images) {
    std::vector<int> shapes;
    for (const Manifest::Image* image : images) shapes.push_back(image->shape);
    shapes_.make(shapes, ambient_.renderer());
    std::vector<ShapeRenderer::Image> scenes;  // of which each image's is
    std::vector<Place> places;
    for (const Manifest::Image* image : images) {
      const std::span<const Manifest::Image> together = of_same_paths(set_, *image);
      if (scenes.empty() || scenes.back().seed != image->seed) scenes.push_back(traced(together));
      places.push_back({scenes.size() - 1, static_cast<std::size_t>(image - together.data())});
    }
    std::vector<ExrImage> files(images.size());
    for (ExrImage& file : files) file = empty_file(channels_);
    int next = put(ambient_.render(scenes, set_.spp), places, 0, files);
    if (flash_) {
      std::vector<ShapeRenderer::Image> in_dark = scenes;
      for (ShapeRenderer::Image& image : in_dark) {
        image.scene = in_flash(std::move(image.scene), set_.flash);
        image.seed = random_bits(image.seed, stream_flash, 0);
      }
      next = put(flash_->render(in_dark, set_.spp), places, next, files);
    }
    if (set_.cameras)
      parallel_for(images.size(),
                   [&](std::size_t i) { put(buffers_of(*images[i], scenes[places[i].scene].scene), next, files[i]); });
    else
      write_shapes(shapes);
    for (std::size_t i = 0; i < images.size(); ++i) write_stored(folder_, set_, *images[i], std::move(files[i]));
  }

 private:
  static constexpr std::uint64_t stream_flash = 1;

  static RenderOptions options(const std::atomic<bool>* cancel) {
    RenderOptions options;
    options.cancel = cancel;
    return options;
  }

  // The place of an image: the index of its scene's rendering, and there of its albedo among the others, if there are
  // any.
  struct Place {
    std::size_t scene, other;
    const Image& in(const std::vector<Rendering>& renderings) const {
      const Rendering& rendering = renderings[scene];
      return rendering.other_albedos.empty() ? rendering : rendering.other_albedos[other];
    }
  };

  // The image to trace for images of the same paths: with the highest of their albedos, so that none is noisier than by
  // itself.
  ShapeRenderer::Image traced(std::span<const Manifest::Image> together) {
    const Manifest::Image& first = together.front();
    DatasetMaterial material = material_of(first);
    std::vector<Rgb> albedos;
    for (const Manifest::Image& image : together) {
      const double a = image.albedo;
      albedos.push_back(image.colours ? image.colours->albedo : Rgb{a, a, a});
      material.albedo = std::max(material.albedo, a);
      for (std::size_t c = 0; image.colours && c < 3; ++c)
        material.colours->albedo[c] = std::max(material.colours->albedo[c], albedos.back()[c]);
    }
    if (together.size() == 1) albedos.clear();
    return {dataset_scene(set_, first, shapes_.made(first.shape).mesh, lights_.of(first.light), material), first.shape,
            first.seed, albedos};
  }

  ExrImage empty_file(const std::vector<std::string>& channels) const {
    ExrImage file{set_.size, set_.size, channels, {}, {}};
    file.data.resize(channels.size() * static_cast<std::size_t>(set_.size) * static_cast<std::size_t>(set_.size));
    return file;
  }

  static ShapeBuffers buffers_of(const Manifest::Image& image, const Scene& scene) {
    ShapeBuffers buffers = shape_buffers(scene, 0, 1);
    for (Vec3& normal : buffers.normal) normal = before_camera(image, normal);
    return buffers;
  }

  // Mask of the object: a new one for each image where cameras differ, else one for each shape.
  const std::vector<double>& mask_of(const Manifest::Image& image, const Scene& scene) {
    std::vector<double>& mask = masks_[image.shape];
    if (set_.cameras || mask.empty()) mask = shape_buffers(scene, 0, 1).mask;
    return mask;
  }

  // Writes the shapes that the folder does not have yet.
  void write_shapes(const std::vector<int>& shapes) {
    for (const int shape : shapes) {
      const Manifest::Shape& s = set_.shapes[static_cast<std::size_t>(shape)];
      if (!has_buffers_.insert(shape).second || is_stored(folder_, set_, s)) continue;
      ExrImage file = empty_file({buffer_names.begin(), buffer_names.end()});
      put(buffers_of({}, dataset_scene(set_, shapes_.made(shape).mesh)), 0, file);
      write_stored(folder_, set_, s, std::move(file));
    }
  }

  // Renderings with their errors, from a channel of the files on. Returns the channel after them.
  static int put(const std::vector<Rendering>& renderings, const std::vector<Place>& places, int channel,
                 std::vector<ExrImage>& files) {
    const auto colours = static_cast<std::size_t>(renderings.front().channels);
    for (std::size_t i = 0; i < files.size(); ++i) {
      const Image& image = places[i].in(renderings);
      for (std::size_t k = 0; k < image.mean.size(); ++k) {
        float* pixel = &files[i].data[k / colours * files[i].channels.size() + static_cast<std::size_t>(channel)];
        pixel[k % colours] = image.mean[k];
        pixel[colours + k % colours] = image.stderr_[k];
      }
    }
    return channel + 2 * static_cast<int>(colours);
  }

  static void put(const ShapeBuffers& buffers, int channel, ExrImage& file) {
    for (std::size_t i = 0; i < buffers.mask.size(); ++i) {
      float* pixel = &file.data[i * file.channels.size() + static_cast<std::size_t>(channel)];
      for (const double n : buffers.normal[i]) *pixel++ = static_cast<float>(n);
      *pixel++ = static_cast<float>(buffers.depth[i]);
      *pixel = static_cast<float>(buffers.mask[i]);
    }
  }

  const Manifest& set_;
  std::string folder_;
  DatasetLights lights_;
  DatasetShapes shapes_;
  ShapeRenderer ambient_;
  std::optional<ShapeRenderer> flash_;  // in no other light
  std::vector<std::string> channels_;
  std::set<int> has_buffers_;                 // shapes whose buffers are in the folder
  std::map<int, std::vector<double>> masks_;  // of shapes
};

// Images of one kind have scenes with the same kinds of BSDFs and light, and as many others of the same paths.
int kind_of(const Manifest& set, const Manifest::Image& image) {
  const Manifest::Light& light = set.lights[static_cast<std::size_t>(image.light)];
  const bool rough = image.boundary ? image.boundary->rough : set.boundary.rough;
  const int together = static_cast<int>(of_same_paths(set, image).size());
  return 4 * together + (light.environment || light.lamps ? 2 : 0) + (rough ? 1 : 0);
}

// Sorts images by kind and shape, and divides them into batches of one kind, which are traced in at most `most` images.
// Batches end where a shape does unless that leaves less than half of them, so that few shapes are made by more than
// one rank. Returns where each ends.
std::vector<std::size_t> batch_ends(const Manifest& set, std::vector<const Manifest::Image*>& images,
                                    std::size_t most) {
  const auto place = [&](const Manifest::Image* image) { return std::pair(kind_of(set, *image), image->shape); };
  std::stable_sort(images.begin(), images.end(), [&](auto* a, auto* b) { return place(a) < place(b); });
  std::vector<std::size_t> ends;
  std::size_t count = 0;  // that are traced for the batch so far
  for (std::size_t end = 1; end <= images.size(); ++end) {
    if (end < images.size() && images[end - 1]->seed == images[end]->seed) continue;  // of the same paths
    ++count;
    if (end < images.size() && count < most) {
      const auto last = place(images[end - 1]), next = place(images[end]);
      if (last.first == next.first && (last.second == next.second || 2 * count < most)) continue;
    }
    ends.push_back(end);
    count = 0;
  }
  return ends;
}

// Writes the plan, and the files that the images need beside their shapes.
void write_sources(const DatasetPlan& plan, const std::string& folder) {
  const Manifest& set = plan.manifest;
  make_folder(folder + "/images");
  if (!set.cameras || !plan.mesh_files.empty()) make_folder(folder + "/shapes");
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

// Every rank checks some of the images. Returns those that are missing, the same on all.
std::vector<const Manifest::Image*> missing_of(const Manifest& set, const std::string& folder, std::size_t first,
                                               std::size_t end, const std::atomic<bool>* cancel, Ranks& ranks) {
  std::vector<std::int64_t> is_missing(end - first);
  std::map<int, bool> has_buffers;  // shapes
  const auto rank = static_cast<std::size_t>(ranks.rank()), count = static_cast<std::size_t>(ranks.count());
  for (std::size_t i = first + rank; i < end; i += count) {
    if (cancel && *cancel) throw Interrupted();
    const Manifest::Image& image = set.images[i];
    const auto [known, is_new] = has_buffers.try_emplace(image.shape, set.cameras);
    if (is_new && !set.cameras)
      known->second = is_stored(folder, set, set.shapes[static_cast<std::size_t>(image.shape)]);
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
  const auto most = static_cast<std::size_t>(std::clamp<std::int64_t>(batch_paths / image_paths, 1, 64));
  const std::vector<std::size_t> ends = batch_ends(set, missing, most);
  const AllRanksWrite all_write;
  ranks.hand_out(ends.size(), 1, [&](std::size_t batch, std::size_t) {
    const auto at = [&](std::size_t image) { return missing.begin() + static_cast<std::ptrdiff_t>(image); };
    const std::vector<const Manifest::Image*> images(at(batch == 0 ? 0 : ends[batch - 1]), at(ends[batch]));
    renderer.render(images);
    progress.done += images.size();
    progress.rendered += images.size();
    report(progress);
  });
  progress = {end - first, end - first, missing.size()};
  if (part.count > 1) return progress;
  if (ranks.is_first()) complete_dataset(folder, set);
  return progress;
}

}  // namespace itn
