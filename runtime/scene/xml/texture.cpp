#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "itn/bitmap.h"
#include "runtime/scene/volume/packed_voxels.h"
#include "runtime/scene/xml/builder.h"
#include "runtime/scene/xml/message.h"

namespace itn {

namespace {

void check_finite(const Bitmap& bitmap, const std::string& file) {
  for (std::size_t i = 0; i < bitmap.data.size(); ++i) {
    if (std::isfinite(bitmap.data[i])) continue;
    const std::size_t pixel = i / static_cast<std::size_t>(bitmap.channels),
                      width = static_cast<std::size_t>(bitmap.width);
    throw InputError(fmt::format("{}: pixel ({}, {}) is {}; need finite numbers: mend the image", file, pixel % width,
                                 pixel / width, bitmap.data[i]));
  }
}

}  // namespace

std::shared_ptr<const Bitmap> load_bitmap(Builder& builder, Properties& owner, const std::string& name, bool raw) {
  const std::string file = owner.file(name);
  std::shared_ptr<const Bitmap>& bitmap = builder.bitmap_of_file[(raw ? "raw " : "srgb ") + file];
  if (!bitmap) {
    try {
      bitmap = std::make_shared<const Bitmap>(read_bitmap(file, raw));
      check_finite(*bitmap, file);
    } catch (const InputError& error) {
      owner.fail_at(name, error.what());
    }
  }
  return bitmap;
}

namespace {

// (u, v) counts as x and y of a point. Mitsuba drops the z row and column, so a shift belongs into the fourth column.
std::array<double, 6> parse_to_uv(Properties& properties) {
  const Transform t = properties.transform("to_uv");
  if (t.m[2] != 0 || t.m[6] != 0)
    properties.fail_at("to_uv",
                       "to_uv mixes z into u or v; need steps in the plane: translate x and y, scale, rotate z");
  return {t.m[0], t.m[1], t.m[3], t.m[4], t.m[5], t.m[7]};
}

void read_bitmap_texture(Builder& builder, Properties& properties, Texture& texture) {
  texture.bitmap = load_bitmap(builder, properties, "filename", properties.boolean("raw", false));
  texture.nearest = properties.choice("filter_type", {"bilinear", "nearest"}) == "nearest";
  const std::string wrap = properties.choice("wrap_mode", {"repeat", "mirror", "clamp"});
  texture.wrap = wrap == "repeat"   ? Texture::Wrap::repeat
                 : wrap == "mirror" ? Texture::Wrap::mirror
                                    : Texture::Wrap::clamp;
  properties.choice("format", {"auto", "variant", "fp16"});  // how Mitsuba stores it
  properties.boolean("accel", true);
}

void read_mesh_attribute(Properties& properties, Texture& texture) {
  texture.attribute = properties.text("name");
  if (texture.attribute.rfind("vertex_", 0) != 0 && texture.attribute.rfind("face_", 0) != 0)
    properties.fail_at("name", fmt::format("unknown attribute {}; need a name that begins with vertex_ or face_",
                                           quote(texture.attribute)));
  texture.scale = properties.number("scale", 1);
}

// Reads the volume that a texture samples at each place of the surface. A constant becomes a grid of one voxel.
void read_shown_volume(Builder& builder, Properties& properties, Texture& texture) {
  const Element* element = properties.object("volume");
  if (!element) properties.fail_at("volume", "no <volume>; need one nested <volume name=\"volume\">");
  Volume volume;
  VoxelGrid grid;
  if (is_spectrum_type(element->attribute("type"))) {
    const Rgb value = spectrum_plugin(builder.document, *element, Quantity::reflectance, builder.report);
    grid.width = grid.height = grid.depth = 1;
    grid.channels = value[0] == value[1] && value[1] == value[2] ? 1 : 3;
    for (std::size_t c = 0; c < static_cast<std::size_t>(grid.channels); ++c)
      grid.data.push_back(static_cast<float>(value[c]));
  } else {
    volume = build_volume(builder, *element, VoxelValues::from_zero);
    if (!volume.grid) {  // reported
      texture.model = nullptr;
      return;
    }
    if (volume.grid->packed)
      properties.fail_at("volume", "the voxels are packed (bits), which is not rendered on surfaces; take bits away");
    grid = *volume.grid;
  }
  volume.grid = std::make_shared<const VoxelGrid>(std::move(grid));
  texture.volume = std::make_shared<const Volume>(std::move(volume));
}

Rgb read_colour(Properties& properties, const DeclaredColour& colour) {
  if (properties.is_object(colour.name))
    properties.fail_at(colour.name, quote(colour.name) +
                                        " is an object; need a colour, <rgb> or <float>: no texture "
                                        "inside of a texture is rendered");
  const double fallback = colour.fallback;
  const Rgb value = properties.color(colour.name, {{fallback, fallback, fallback}}).value;
  for (const double v : value)
    if (!(v >= colour.kind.low && v <= colour.kind.high))
      properties.fail_at(colour.name,
                         fmt::format("{} = {} is outside [{}, {}{}", quote(colour.name), to_text(v), colour.kind.low,
                                     colour.kind.high, colour.kind.high_included ? ']' : ')'));
  return value;
}

std::vector<std::string> texture_types() {
  std::vector<std::string> types;
  for (const TextureModel& model : texture_models()) types.push_back(model.type);
  return types;
}

void check_range(Properties& owner, const std::string& name, const Texture& texture, double most) {
  for (std::size_t k = 0; k < texture.colours.size(); ++k)
    for (const double v : texture.colours[k])
      if (v > most)
        owner.fail_at(name, fmt::format("{} = {} is outside [0, {}], the range of {}",
                                        quote(texture.model->colours[k].name), to_text(v), most, quote(name)));
  if (texture.volume) {
    const auto [least, greatest] = range_of(*texture.volume->grid);
    if (least < 0 || static_cast<double>(greatest) > most)
      owner.fail_at(name, fmt::format("{}: the values of the volume go from {} to {}; need [0, {}]", quote(name), least,
                                      greatest, most));
  }
  if (!texture.bitmap) return;
  const auto [low, high] = std::minmax_element(texture.bitmap->data.begin(), texture.bitmap->data.end());
  if (*low < 0 || static_cast<double>(*high) > most)
    owner.fail_at(name, fmt::format("{}: the values of the image go from {} to {}; need [0, {}]", quote(name), *low,
                                    *high, most));
}

}  // namespace

Texture read_texture(Builder& builder, const Element& element) {
  Properties properties = builder.properties(element);
  const TextureModel* model = find_texture(properties.type());
  if (!model) fail_type(element, texture_types());
  Texture texture;
  texture.become(*model);
  texture.id = element.id;
  if (model->type == "bitmap") read_bitmap_texture(builder, properties, texture);
  if (model->type == "mesh_attribute") {
    read_mesh_attribute(properties, texture);
    properties.finish();
    return texture;
  }
  if (model->type == "volume") {
    read_shown_volume(builder, properties, texture);
    properties.finish();
    return texture;
  }
  for (std::size_t i = 0; i < model->colours.size(); ++i)
    texture.colours[i] = read_colour(properties, model->colours[i]);
  texture.to_uv = parse_to_uv(properties);
  properties.finish();
  return texture;
}

Texture build_texture(Builder& builder, Properties& owner, const std::string& name, double fallback, double most) {
  if (owner.is_object(name) && !owner.is_spectrum(name)) {
    const Element* element = owner.object("texture", name);
    if (!element)
      owner.fail_at(name, quote(name) + " is an object of the wrong kind; need a <texture>, <rgb> or <float>");
    Texture texture = build_texture(builder, *element);
    check_range(owner, name, texture, most);
    return texture;
  }
  Texture texture;
  texture.value = owner.color(name, {{fallback, fallback, fallback}}).value;
  for (double v : texture.value)
    if (!(v >= 0 && v <= 1)) owner.fail_at(name, quote(name) + " = " + to_text(v) + " is outside [0, 1]");
  return texture;
}

}  // namespace itn
