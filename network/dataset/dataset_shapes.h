// The shapes of a data set, made when images need them, and what renders scenes of them.
#pragma once
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "network/dataset/manifest.h"
#include "runtime/render/batch_renderer.h"

namespace itn {

// In memory: meshes, and their geometries together with the floor's.
class DatasetShapes {
 public:
  struct Made {
    std::shared_ptr<const Mesh> mesh;
    Geometry geometry;
  };

  // The set must outlive it. most_bytes: geometries beyond are made again when they are asked for again.
  DatasetShapes(const Manifest& set, std::string folder, std::size_t most_bytes);

  // Makes those that are not there, several at a time. Throws InputError: a mesh of the set.
  void make(const std::vector<int>& shapes, const BatchRenderer& renderer);
  // One of the shapes of the last make().
  const Made& made(int shape) const { return made_.at(shape); }

 private:
  Made make_one(int shape, const BatchRenderer& renderer) const;

  const Manifest& set_;
  std::string folder_;
  std::size_t most_bytes_, bytes_ = 0;
  std::map<int, Made> made_;
};

// Renders scenes of the shapes, which it keeps on the device, and always the same kind of scenes.
class ShapeRenderer {
 public:
  struct Image {
    Scene scene;
    int shape = 0;
    std::uint64_t seed = 0;
    std::vector<Rgb> other_albedos = {};
  };

  // All must outlive it.
  ShapeRenderer(const Device& device, const RenderOptions& options, DatasetShapes& shapes)
      : renderer_(device, options), shapes_(shapes) {}

  // As BatchRenderer::render(). Throws also as DatasetShapes::make().
  std::vector<Rendering> render(const std::vector<Image>& images, int spp, int groups = 1);

  const BatchRenderer& renderer() const { return renderer_; }

 private:
  void place(const std::vector<int>& shapes);

  BatchRenderer renderer_;
  DatasetShapes& shapes_;
  std::map<int, int> placed_;  // BatchImage::geometry of a shape
};

}  // namespace itn
