// <volume>s of type gridvolume, vdbvolume and texturevolume, and the parameters of media that may be volumes.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "runtime/base/error.h"
#include "runtime/scene/openvdb_file.h"
#include "runtime/scene/transform.h"
#include "runtime/scene/volume_file.h"
#include "runtime/scene/xml/builder.h"
#include "runtime/scene/xml/message.h"

namespace itn {
namespace {

std::shared_ptr<const VoxelGrid> load_grid(Builder& builder, Properties& properties) {
  const std::string file = properties.file("filename");
  std::shared_ptr<const VoxelGrid>& grid = builder.grid_of_file[file];
  if (!grid) {
    try {
      grid = std::make_shared<const VoxelGrid>(read_volume_file(file));
    } catch (const InputError& error) {
      properties.fail_at("filename", error.what());
    }
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
void load_openvdb(Properties& properties, Volume& volume) {
  try {
    PlacedGrid placed = read_openvdb_file(properties.file("filename"), properties.text("grid", "density"));
    volume.to_world = volume.to_world * placed.to_world;
    volume.grid = std::make_shared<const VoxelGrid>(std::move(placed.grid));
  } catch (const InputError& error) {
    properties.fail_at("filename", error.what());
  }
}

// Ours: a picture over x and y of the unit cube, the same along z. So it is a grid of depth 1.
void load_picture(Builder& builder, Properties& properties, Volume& volume) {
  const Element* element = properties.object("texture");
  if (!element) properties.fail_at("", "no <texture>; need one nested bitmap");
  const Texture texture = build_texture(builder, *element);
  if (!texture.model) return;  // a stand-in, which is reported
  if (!texture.bitmap)
    fail(element->where,
         "the picture is a " + quote(element->attribute("type")) + "; need a <texture type=\"bitmap\">");
  if (texture.to_uv != Texture().to_uv)
    fail(element->where, "to_uv does not move the picture of a volume; move the volume by its to_world");
  const Bitmap& bitmap = *texture.bitmap;
  for (const float value : bitmap.data)
    if (!(value >= 0) || !std::isfinite(value))
      fail(element->where, fmt::format("a value of the picture is {}; need numbers from 0 on", value));
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

// How places between voxels are interpolated, and beyond them.
void read_lookup(Properties& properties, Volume& volume) {
  volume.nearest = properties.choice("filter_type", {"trilinear", "nearest"}) == "nearest";
  const std::string wrap = properties.choice("wrap_mode", {"clamp", "repeat", "mirror"});
  volume.wrap = wrap == "clamp" ? Volume::Wrap::clamp : wrap == "repeat" ? Volume::Wrap::repeat : Volume::Wrap::mirror;
}

}  // namespace

Volume read_volume(Builder& builder, const Element& element) {
  Properties properties = builder.properties(element);
  const bool is_openvdb = properties.type() == "vdbvolume", is_picture = properties.type() == "texturevolume";
  if (!is_openvdb && !is_picture && properties.type() != "gridvolume")
    fail_type(element, {"constvolume", "gridvolume", "vdbvolume", "texturevolume"});
  Volume volume;
  volume.to_world = properties.transform("to_world");
  if (is_picture) {
    load_picture(builder, properties, volume);
    properties.finish();
    return volume;
  }
  if (is_openvdb)
    load_openvdb(properties, volume);
  else
    volume.grid = load_grid(builder, properties);
  read_lookup(properties, volume);
  if (!is_openvdb && properties.boolean("use_grid_bbox", false))
    volume.to_world = volume.to_world * box_of_file(properties, *volume.grid);
  // How Mitsuba converts, stores and samples it: they change no value of an RGB render.
  properties.boolean("raw", false);
  properties.boolean("accel", true);
  properties.number("max_value", 0);
  properties.finish();
  return volume;
}

Texture read_medium_parameter(Builder& builder, Properties& properties, const DeclaredParameter& p) {
  Texture value;
  value.value.fill(1);
  if (properties.is_object(p.name) && !properties.is_spectrum(p.name)) {
    const Element* element = properties.object("volume", p.name);
    if (!element)
      properties.fail_at(p.name, quote(p.name) + " is an object of the wrong kind; need a <volume>, <rgb> or <float>");
    value.volume = std::make_shared<const Volume>(build_volume(builder, *element));
    if (!value.is_grid()) return value;  // reported
    const auto [low, high] = std::minmax_element(value.volume->grid->data.begin(), value.volume->grid->data.end());
    if (static_cast<double>(*high) > p.kind.high)
      properties.fail_at(p.name, fmt::format("{}: the values of the grid go from {} to {}; need [{}, {}]",
                                             quote(p.name), *low, *high, p.kind.low, p.kind.high));
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
