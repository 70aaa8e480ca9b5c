#include "network/dataset/dataset_shapes.h"

#include <algorithm>
#include <utility>

#include "network/dataset/dataset_mesh.h"
#include "network/dataset/dataset_scene.h"
#include "runtime/base/parallel.h"

namespace itn {
namespace {

constexpr std::size_t most_placed = 64;  // on the device at once: all of a set that has but a few

std::size_t bytes_of(const Geometry& g) {
  return sizeof(float) * (g.nodes.size() + g.leaves.size()) + sizeof(PrimitiveRecord) * g.primitives.size() +
         sizeof(std::uint32_t) * g.grid.size();
}

// Each once, those of `there` left out.
template <class There>
std::vector<int> missing_of(std::vector<int> shapes, const There& there) {
  std::sort(shapes.begin(), shapes.end());
  shapes.erase(std::unique(shapes.begin(), shapes.end()), shapes.end());
  shapes.erase(std::remove_if(shapes.begin(), shapes.end(), [&](int shape) { return there.count(shape) > 0; }),
               shapes.end());
  return shapes;
}

}  // namespace

DatasetShapes::DatasetShapes(const Manifest& set, std::string folder, std::size_t most_bytes)
    : set_(set), folder_(std::move(folder)), most_bytes_(most_bytes) {}

DatasetShapes::Made DatasetShapes::make_one(int shape, const BatchRenderer& renderer) const {
  Made made{dataset_mesh(set_.shapes[static_cast<std::size_t>(shape)], folder_), {}};
  made.geometry = renderer.geometry_of(dataset_scene(set_, made.mesh));
  return made;
}

void DatasetShapes::make(const std::vector<int>& shapes, const BatchRenderer& renderer) {
  if (bytes_ > most_bytes_) {
    made_.clear();
    bytes_ = 0;
  }
  const std::vector<int> missing = missing_of(shapes, made_);
  std::vector<Made> made(missing.size());
  parallel_for(missing.size(), [&](std::size_t i) { made[i] = make_one(missing[i], renderer); });
  for (std::size_t i = 0; i < missing.size(); ++i) {
    bytes_ += bytes_of(made[i].geometry);
    made_.emplace(missing[i], std::move(made[i]));
  }
}

std::vector<Rendering> ShapeRenderer::render(const std::vector<Image>& images, int spp, int groups) {
  std::vector<int> shapes;
  for (const Image& image : images) shapes.push_back(image.shape);
  place(shapes);
  std::vector<BatchImage> batch;
  for (const Image& image : images)
    batch.push_back({&image.scene, placed_.at(image.shape), image.seed, 0, image.other_albedos});
  return renderer_.render(batch, spp, groups);
}

void ShapeRenderer::place(const std::vector<int>& shapes) {
  shapes_.make(shapes, renderer_);
  std::vector<int> missing = missing_of(shapes, placed_);
  if (missing.empty()) return;
  if (placed_.size() + missing.size() > most_placed) {
    renderer_.forget_geometries();
    placed_.clear();
    missing = missing_of(shapes, placed_);
  }
  for (const int shape : missing) placed_[shape] = renderer_.add_geometry(shapes_.made(shape).geometry);
}

}  // namespace itn
