// The shapes of a data set, made when images need them, and where they are on a renderer's device.
#pragma once
#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "runtime/batch_renderer.h"
#include "runtime/dataset/manifest.h"

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

// On the device.
class PlacedShapes {
 public:
  // Both must outlive it.
  PlacedShapes(BatchRenderer& renderer, DatasetShapes& shapes) : renderer_(renderer), shapes_(shapes) {}

  // Puts the shapes of a batch's images there. Throws as DatasetShapes::make().
  void place(const std::vector<int>& shapes);
  // BatchImage::geometry, of the shapes of the last place().
  int geometry(int shape) const { return placed_.at(shape); }

 private:
  BatchRenderer& renderer_;
  DatasetShapes& shapes_;
  std::map<int, int> placed_;
};

}  // namespace itn
