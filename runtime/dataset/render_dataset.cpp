#include "runtime/dataset/render_dataset.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "runtime/batch_renderer.h"
#include "runtime/dataset/dataset_mesh.h"
#include "runtime/dataset/dataset_scene.h"
#include "runtime/dataset/shape_buffers.h"
#include "runtime/error.h"
#include "runtime/image/exr.h"
#include "runtime/scene/mesh_file.h"

namespace itn {
namespace {

constexpr std::int64_t batch_paths = 1 << 22;  // a few seconds: what is lost when the program is killed
constexpr std::size_t most_geometries = 16;    // on the device at once

void create_folder(const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw ResultError(fmt::format("{}: cannot be created; {}", folder, error.message()));
}

// Is the file there, whole, and of this set?
bool is_there(const std::string& file, const Manifest& set) {
  if (!std::filesystem::exists(file)) return false;
  try {
    const ExrImage image = read_exr(file);
    const auto hash = image.header.find("hash");
    return image.width == set.size && image.height == set.size && hash != image.header.end() &&
           hash->second == set.hash;
  } catch (const InputError&) {
    return false;
  }
}

void write_picture(const std::string& file, const Bitmap& picture) {
  using Channels = std::vector<std::string>;
  const Channels channels = picture.channels == 1 ? Channels{"Y"} : Channels{"R", "G", "B"};
  write_exr(file, {picture.width, picture.height, channels, picture.data, {}});
}

void check_same(const std::string& folder, const Manifest& set) {
  if (!std::filesystem::exists(manifest_file(folder))) return;
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
      : set_(set), folder_(std::move(folder)), lights_(set, folder_), renderer_(device, options(cancel)) {}

  // All under the sun or all under environments: then an image's bits do not depend on the others (batch_renderer.h).
  void render(const std::vector<const Manifest::Image*>& images) {
    place(images);
    std::vector<Scene> scenes;
    scenes.reserve(images.size());
    for (const Manifest::Image* image : images) scenes.push_back(scene_of(*image));
    std::vector<BatchImage> batch;
    for (std::size_t i = 0; i < images.size(); ++i)
      batch.push_back({&scenes[i], geometries_.at(images[i]->shape), images[i]->seed, 0});
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
    return dataset_scene(set_, meshes_.at(image.shape), lights_.of(image.light),
                         {image.sigma_t, image.albedo, image.g});
  }

  // Makes sure that the images' shapes are on the device, and their buffers in the folder.
  void place(const std::vector<const Manifest::Image*>& images) {
    std::vector<int> missing;
    for (const Manifest::Image* image : images)
      if (!geometries_.count(image->shape) && std::find(missing.begin(), missing.end(), image->shape) == missing.end())
        missing.push_back(image->shape);
    if (missing.empty()) return;
    if (geometries_.size() + missing.size() > most_geometries) {
      renderer_.forget_geometries();
      geometries_.clear();
      meshes_.clear();
      missing.clear();
      for (const Manifest::Image* image : images)
        if (std::find(missing.begin(), missing.end(), image->shape) == missing.end()) missing.push_back(image->shape);
    }
    for (const int shape : missing) {
      const Manifest::Shape& s = set_.shapes[static_cast<std::size_t>(shape)];
      meshes_[shape] = dataset_mesh(s, folder_);
      const Scene scene = dataset_scene(set_, meshes_[shape], sun_and_sky({0, 0, 1}), {});
      geometries_[shape] = renderer_.add_geometry(scene);
      if (!is_there(path(s.buffers), set_)) write(s, shape_buffers(scene, 0, 1));
    }
  }

  void write(const Manifest::Shape& shape, const ShapeBuffers& buffers) const {
    ExrImage out{set_.size, set_.size, {"normal.X", "normal.Y", "normal.Z", "depth", "mask"}, {}, {}};
    for (std::size_t i = 0; i < buffers.mask.size(); ++i) {
      for (const double n : buffers.normal[i]) out.data.push_back(static_cast<float>(n));
      out.data.push_back(static_cast<float>(buffers.depth[i]));
      out.data.push_back(static_cast<float>(buffers.mask[i]));
    }
    out.header = {{"hash", set_.hash}, {"shape", shape.name}};
    write_exr(path(shape.buffers), out);
  }

  void write(const Manifest::Image& image, const Rendering& rendering) const {
    ExrImage out{set_.size, set_.size, {"Y", "stderr.Y"}, {}, {}};
    for (std::size_t i = 0; i < rendering.mean.size(); ++i) {
      out.data.push_back(rendering.mean[i]);
      out.data.push_back(rendering.stderr_[i]);
    }
    out.header = {
        {"hash", set_.hash},
        {"spp", std::to_string(set_.spp)},
        {"seed", std::to_string(image.seed)},
        {"parameters", fmt::format(R"({{"sigma_t":{},"albedo":{},"g":{}}})", image.sigma_t, image.albedo, image.g)}};
    write_exr(path(image.file), out);
  }

  const Manifest& set_;
  std::string folder_;
  DatasetLights lights_;
  BatchRenderer renderer_;
  std::map<int, std::shared_ptr<const Mesh>> meshes_;  // of the shapes on the device
  std::map<int, int> geometries_;
};

}  // namespace

DatasetProgress render_dataset(const Device& device, const DatasetPlan& plan, const std::string& folder,
                               const std::function<void(const DatasetProgress&)>& report,
                               const std::atomic<bool>* cancel) {
  Manifest set = plan.manifest;
  check_same(folder, set);
  create_folder(folder + "/images");
  create_folder(folder + "/shapes");
  for (std::size_t s = 0; s < set.shapes.size(); ++s)
    if (const auto* mesh = std::get_if<Manifest::FileMesh>(&set.shapes[s].mesh))
      write_ply(folder + "/" + mesh->file, as_dataset_mesh(plan.mesh_files[s]));
  if (!plan.environment_files.empty()) create_folder(folder + "/environments");
  for (const auto& [file, from] : plan.environment_files) write_picture(folder + "/" + file, *read_environment(from));
  write_manifest(folder, set);

  DatasetProgress progress{0, set.images.size(), 0};
  std::vector<const Manifest::Image*> missing;
  for (const Manifest::Image& image : set.images) {
    if (cancel && *cancel) throw Interrupted();
    if (is_there(folder + "/" + image.file, set) &&
        is_there(folder + "/" + set.shapes[static_cast<std::size_t>(image.shape)].buffers, set))
      ++progress.done;
    else
      missing.push_back(&image);
  }
  report(progress);

  DatasetRenderer renderer(device, set, folder, cancel);
  const std::int64_t image_paths = static_cast<std::int64_t>(set.size) * set.size * set.spp;
  const auto batch = static_cast<std::ptrdiff_t>(std::clamp<std::int64_t>(batch_paths / image_paths, 1, 64));
  const auto under_sun = [&](const Manifest::Image* image) {
    return !set.lights[static_cast<std::size_t>(image->light)].environment;
  };
  const auto environments = std::stable_partition(missing.begin(), missing.end(), under_sun);
  for (auto first = missing.begin(); first != missing.end();) {
    const auto end = first + std::min(batch, (first < environments ? environments : missing.end()) - first);
    renderer.render({first, end});
    progress.done += static_cast<std::size_t>(end - first);
    progress.rendered += static_cast<std::size_t>(end - first);
    report(progress);
    first = end;
  }
  set.complete = true;
  write_manifest(folder, set);
  return progress;
}

}  // namespace itn
