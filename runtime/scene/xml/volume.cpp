// <volume>s of type gridvolume, vdbvolume, texturevolume and surfacevolume, and the parameters of media and phase
// functions that may be volumes.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "itn/colour.h"
#include "itn/error.h"
#include "runtime/scene/transform.h"
#include "runtime/scene/volume/openvdb_file.h"
#include "runtime/scene/volume/packed_voxels.h"
#include "runtime/scene/volume/surface_volume.h"
#include "runtime/scene/volume/volume_file.h"
#include "runtime/scene/xml/builder.h"
#include "runtime/scene/xml/message.h"

namespace itn {
namespace {

// Ours: how many bits a voxel of a packed grid has; 0: not asked for.
int read_bits(Properties& properties) {
  if (!properties.has("bits")) return 0;
  const long bits = properties.integer("bits", 0);
  if (bits != 8 && bits != 16 && bits != 32)
    properties.fail_at("bits", fmt::format("bits = {}; need 8, 16 or 32", bits));
  return static_cast<int>(bits);
}

std::shared_ptr<const VoxelGrid> load_grid(Builder& builder, Properties& properties, VoxelValues allowed) {
  const std::string file = properties.file("filename");
  const int bits = read_bits(properties);
  std::shared_ptr<const VoxelGrid>& grid = builder.grid_of_file[{file, bits}];
  try {
    if (!grid) grid = std::make_shared<const VoxelGrid>(read_volume_file(file, VoxelValues::of_any_sign, bits));
    check_values(*grid, file, allowed);
  } catch (const InputError& error) {
    properties.fail_at("filename", error.what());
  }
  return grid;
}

// The box that the file says its voxels fill, as an image of the unit cube.
Transform box_of_file(Properties& properties, const VoxelGrid& grid) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (!(grid.low[axis] < grid.high[axis]) || !std::isfinite(grid.high[axis] - grid.low[axis]))
      properties.fail_at(
          "use_grid_bbox",
          fmt::format("the file's box reaches from {} to {} along axis {}; need one with an extent: leave "
                      "out use_grid_bbox, or mend the file",
                      grid.low[axis], grid.high[axis], "xyz"[axis]));
  return translate(grid.low) * scale(grid.high - grid.low);
}

// Ours: a grid of an OpenVDB file, where the file says that it is.
void load_openvdb(Properties& properties, VoxelValues allowed, Volume& volume) {
  try {
    PlacedGrid placed = read_openvdb_file(properties.file("filename"), properties.text("grid", "density"), allowed,
                                          read_bits(properties));
    volume.to_world = volume.to_world * placed.to_world;
    volume.grid = std::make_shared<const VoxelGrid>(std::move(placed.grid));
  } catch (const InputError& error) {
    properties.fail_at("filename", error.what());
  }
}

// The bitmap inside of a volume; without a model: a stand-in, which is reported.
Texture nested_picture(Builder& builder, Properties& properties, VoxelValues allowed) {
  const Element* element = properties.object("texture");
  if (!element) properties.fail_at("", "no <texture>; need one nested bitmap");
  Texture texture = build_texture(builder, *element);
  if (!texture.model) return texture;
  if (!texture.bitmap)
    fail(element->where,
         "the picture is a " + quote(element->attribute("type")) + "; need a <texture type=\"bitmap\">");
  for (const float value : texture.bitmap->data)
    if ((allowed == VoxelValues::from_zero && !(value >= 0)) || !std::isfinite(value))
      fail(element->where, fmt::format("a value of the picture is {}; need numbers{}", value,
                                       allowed == VoxelValues::from_zero ? " from 0 on" : ""));
  return texture;
}

// Ours: a picture over x and y of the unit cube, the same along z. So it is a grid of depth 1.
void load_picture(Builder& builder, Properties& properties, VoxelValues allowed, Volume& volume) {
  const Texture texture = nested_picture(builder, properties, allowed);
  if (!texture.model) return;
  if (texture.to_uv != Texture().to_uv)
    properties.fail_at("", "to_uv does not move the picture of a volume; move the volume by its to_world");
  const Bitmap& bitmap = *texture.bitmap;
  VoxelGrid grid;
  grid.width = bitmap.width;
  grid.height = bitmap.height;
  grid.depth = 1;
  grid.channels = bitmap.channels;
  grid.data = bitmap.data;
  volume.grid = std::make_shared<const VoxelGrid>(std::move(grid));
  volume.nearest = texture.nearest;
  volume.wrap = texture.wrap == Texture::Wrap::repeat   ? Volume::Wrap::repeat
                : texture.wrap == Texture::Wrap::mirror ? Volume::Wrap::mirror
                                                        : Volume::Wrap::clamp;
}

// Ours: the picture's value at the point of a mesh that is nearest to each place.
void load_surface(Builder& builder, Properties& properties, VoxelValues allowed, Volume& volume) {
  const Texture texture = nested_picture(builder, properties, allowed);
  const Element* shape = properties.object("shape");
  if (!shape) properties.fail_at("", "no <shape>; need the mesh on which the picture lies");
  const PlacedMesh mesh = read_surface(builder, *shape);
  constexpr long most = 512;
  const long resolution = properties.integer("resolution", 64);
  if (resolution < 1 || resolution > most)
    properties.fail_at("resolution",
                       fmt::format("resolution = {}; need 1 to {} voxels along the longest side", resolution, most));
  if (!texture.model) return;
  volume = surface_volume(mesh, texture, static_cast<int>(resolution));
  volume.to_world = translate(mesh.origin) * volume.to_world;
}

// Reads the interpolation between voxels, and the rule for places beyond them.
void read_lookup(Properties& properties, Volume& volume) {
  volume.nearest = properties.choice("filter_type", {"trilinear", "nearest"}) == "nearest";
  const std::string wrap = properties.choice("wrap_mode", {"clamp", "repeat", "mirror"});
  volume.wrap = wrap == "clamp" ? Volume::Wrap::clamp : wrap == "repeat" ? Volume::Wrap::repeat : Volume::Wrap::mirror;
}

}  // namespace

Volume read_volume(Builder& builder, const Element& element, VoxelValues allowed) {
  Properties properties = builder.properties(element);
  const bool is_openvdb = properties.type() == "vdbvolume", is_picture = properties.type() == "texturevolume",
             is_surface = properties.type() == "surfacevolume";
  if (!is_openvdb && !is_picture && !is_surface && properties.type() != "gridvolume")
    fail_type(element, {"constvolume", "gridvolume", "vdbvolume", "texturevolume", "surfacevolume"});
  Volume volume;
  if (is_surface) {
    load_surface(builder, properties, allowed, volume);
    properties.finish();
    return volume;
  }
  volume.to_world = properties.transform("to_world");
  if (is_picture) {
    load_picture(builder, properties, allowed, volume);
    properties.finish();
    return volume;
  }
  if (is_openvdb)
    load_openvdb(properties, allowed, volume);
  else
    volume.grid = load_grid(builder, properties, allowed);
  read_lookup(properties, volume);
  if (!is_openvdb && properties.boolean("use_grid_bbox", false))
    volume.to_world = volume.to_world * box_of_file(properties, *volume.grid);
  // Settings of Mitsuba's conversion, storage and sampling: they change no value of an RGB render.
  properties.boolean("raw", false);
  properties.boolean("accel", true);
  properties.number("max_value", 0);
  properties.finish();
  return volume;
}

namespace {

// The volume that a parameter is given as.
Volume volume_of(Builder& builder, Properties& properties, const std::string& name, VoxelValues allowed) {
  const Element* element = properties.object("volume", name);
  if (!element)
    properties.fail_at(name, quote(name) + " is an object of the wrong kind; need a <volume>, <rgb> or <float>");
  return build_volume(builder, *element, allowed);
}

// The range of a parameter as voxels may have it.
std::pair<float, float> range_of_voxels(const ParameterKind& kind) {
  return {static_cast<float>(kind.low + (kind.low_included ? 0 : least_distance_from_bound)),
          static_cast<float>(kind.high - (kind.high_included ? 0 : least_distance_from_bound))};
}

void check_range_of_voxels(Properties& properties, const DeclaredParameter& p, const VoxelGrid& grid) {
  const auto [least, greatest] = range_of(grid);
  const auto [low, high] = range_of_voxels(p.kind);
  if (least < low || greatest > high)
    properties.fail_at(p.name, fmt::format("{}: the values of the grid go from {} to {}; need [{}, {}]", quote(p.name),
                                           least, greatest, low, high));
}

}  // namespace

Texture read_number_volume(Builder& builder, Properties& properties, const DeclaredParameter& p) {
  Texture value;
  if (!properties.is_object(p.name)) {
    value.value.fill(properties.number(p.name, p.fallback));
    check_in_range(properties, p, value.value[0]);
    return value;
  }
  if (properties.is_spectrum(p.name)) {
    value.value = properties.color(p.name, {}, p.kind.quantity).value;
    if (!grey(value.value)) properties.fail_at(p.name, quote(p.name) + " is a colour; need a number");
    check_in_range(properties, p, value.value[0]);
    return value;
  }
  Volume volume = volume_of(builder, properties, p.name, VoxelValues::of_any_sign);
  value.value.fill(p.fallback);
  if (!volume.grid) return value;  // reported
  if (volume.grid->channels != 1)
    properties.fail_at(p.name, fmt::format("{}: the grid has {} channels; need one: it is a number", quote(p.name),
                                           volume.grid->channels));
  check_range_of_voxels(properties, p, *volume.grid);
  value.value.fill(mean_of(*volume.grid));
  value.volume = std::make_shared<const Volume>(std::move(volume));
  return value;
}

Texture read_medium_parameter(Builder& builder, Properties& properties, const DeclaredParameter& p) {
  Texture value;
  value.value.fill(1);
  if (properties.is_object(p.name) && !properties.is_spectrum(p.name)) {
    value.volume = std::make_shared<const Volume>(volume_of(builder, properties, p.name, VoxelValues::from_zero));
    if (value.is_grid()) check_range_of_voxels(properties, p, *value.volume->grid);  // else reported
    return value;
  }
  const Color colour = properties.color(p.name, {{p.fallback, p.fallback, p.fallback}}, p.kind.quantity);
  value.value = colour.value;
  value.by_component = p.kind.by_component && colour.is_rgb;
  for (const double v : value.value) check_in_range(properties, p, v);
  // As in Mitsuba, a constant fills a cube, too: that of its to_world.
  Volume cube;
  if (const Element* element = properties.is_spectrum(p.name) ? properties.object("volume", p.name) : nullptr) {
    Properties own = builder.properties(*element);
    cube.to_world = own.transform("to_world");
  }
  value.volume = std::make_shared<const Volume>(cube);
  return value;
}

}  // namespace itn
