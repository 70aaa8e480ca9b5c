#include "python/src/files.h"

#include <fmt/format.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "itn/error.h"
#include "itn/exr.h"
#include "python/src/arrays.h"
#include "runtime/scene/mesh/mesh_file.h"
#include "runtime/scene/mesh/mesh_topology.h"
#include "runtime/scene/mesh/shape_meshes.h"
#include "runtime/scene/shapes/named_shapes.h"
#include "runtime/scene/shapes/polygonise.h"
#include "runtime/scene/shapes/random_shape.h"

namespace itn::python {
namespace {

using namespace nb::literals;

nb::dict describe(const std::string& name, const std::string& role, const Mesh& mesh) {
  std::vector<float> positions;
  for (const auto& p : mesh.position) positions.insert(positions.end(), p.begin(), p.end());
  std::vector<std::uint32_t> triangles;
  for (const auto& t : mesh.triangle) triangles.insert(triangles.end(), t.begin(), t.end());
  nb::dict result;
  result["name"] = name;
  result["role"] = role;
  result["vertices"] = numpy_array(std::move(positions), {mesh.position.size(), 3});
  result["triangles"] = numpy_array(std::move(triangles), {mesh.triangle.size(), 3});
  result["volume"] = topology(mesh).volume;
  result["genus"] = genus(mesh);
  return result;
}

std::vector<std::string> shape_names() {
  std::vector<std::string> names;
  for (const NamedShape& shape : named_shapes()) names.push_back(shape.name);
  return names;
}

nb::dict named_shape(const std::string& name) {
  for (const NamedShape& shape : named_shapes())
    if (shape.name == name) {
      Mesh mesh;
      {
        const nb::gil_scoped_release release;
        mesh = shape.mesh();
      }
      return describe(name, shape.for_testing ? "test" : "train", mesh);
    }
  throw UsageError(
      fmt::format("shape {}: there is none of that name; need one of: {}", name, fmt::join(shape_names(), ", ")));
}

nb::dict make_random_shape(std::uint64_t seed) {
  Mesh mesh;
  {
    const nb::gil_scoped_release release;
    mesh = random_shape(seed).mesh();
  }
  return describe(fmt::format("random_{}", seed), "random", mesh);
}

using Indices = nb::ndarray<const std::uint32_t, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

void save_mesh(const std::string& file, const FloatArray& vertices, const Indices& triangles) {
  if (vertices.ndim() != 2 || vertices.shape(1) != 3 || triangles.shape(1) != 3)
    throw UsageError("write_mesh: need vertices (n, 3) and triangles (m, 3)");
  Mesh mesh;
  for (std::size_t i = 0; i < vertices.shape(0); ++i) {
    const float* p = vertices.data() + 3 * i;
    mesh.position.push_back({p[0], p[1], p[2]});
  }
  for (std::size_t i = 0; i < triangles.shape(0); ++i)
    mesh.triangle.push_back({triangles(i, 0), triangles(i, 1), triangles(i, 2)});
  check_mesh(mesh, file);
  write_ply(file, mesh);
}

// Returns an array (height, width) for each channel, and the header's texts.
nb::tuple read(const std::string& file) {
  const ExrImage image = read_exr(file);
  nb::dict channels;
  for (std::size_t c = 0; c < image.channels.size(); ++c) {
    std::vector<float> plane;
    for (std::size_t i = c; i < image.data.size(); i += image.channels.size()) plane.push_back(image.data[i]);
    channels[image.channels[c].c_str()] =
        numpy_array(std::move(plane), {static_cast<std::size_t>(image.height), static_cast<std::size_t>(image.width)});
  }
  return nb::make_tuple(channels, image.header);
}

// data: (height, width, channels), the channels in the order of their names.
void write(const std::string& file, const std::vector<std::string>& names, const FloatArray& data,
           const std::map<std::string, std::string>& header) {
  if (data.ndim() != 3 || data.shape(2) != names.size())
    throw UsageError(fmt::format("{}: need an array (height, width, {}), a channel a name", file, names.size()));
  write_exr(file, {static_cast<int>(data.shape(1)), static_cast<int>(data.shape(0)), names, as_vector(data), header});
}

}  // namespace

void bind_files(nb::module_& module) {
  module.def("shape_names", &shape_names);
  module.def("named_shape", &named_shape, "name"_a);
  module.def("random_shape", &make_random_shape, "seed"_a);
  module.def("write_mesh", &save_mesh, "file"_a, "vertices"_a, "triangles"_a);
  module.def("read_exr", &read, "file"_a);
  module.def("write_exr", &write, "file"_a, "names"_a, "data"_a, "header"_a);
}

}  // namespace itn::python
