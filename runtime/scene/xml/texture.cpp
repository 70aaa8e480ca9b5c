#include "runtime/image/png.h"
#include "runtime/scene/xml/builder.h"
#include "runtime/scene/xml/message.h"

namespace itn {

std::shared_ptr<const Bitmap> load_bitmap(Builder& builder, Properties& owner, const std::string& name, bool raw) {
  const std::string file = owner.file(name);
  std::shared_ptr<const Bitmap>& bitmap = builder.bitmap_of_file[(raw ? "raw " : "srgb ") + file];
  if (!bitmap) {
    try {
      bitmap = std::make_shared<const Bitmap>(read_bitmap(file, raw));
    } catch (const InputError& error) {
      owner.fail_at(name, error.what());
    }
  }
  return bitmap;
}

namespace {

// Mitsuba applies the upper left 3x3 block to (u, v, 1).
std::array<double, 6> parse_to_uv(Properties& properties) {
  const Transform t = properties.transform("to_uv");
  return {t.m[0], t.m[1], t.m[2], t.m[4], t.m[5], t.m[6]};
}

Texture build_bitmap(Builder& builder, const Element& element) {
  if (element.attribute("type") != "bitmap") fail_type(element, {"bitmap"});
  Properties properties = builder.properties(element);
  Texture texture;
  texture.bitmap = load_bitmap(builder, properties, "filename", properties.boolean("raw", false));
  texture.nearest = properties.choice("filter_type", {"bilinear", "nearest"}) == "nearest";
  const std::string wrap = properties.choice("wrap_mode", {"repeat", "mirror", "clamp"});
  texture.wrap = wrap == "repeat"   ? Texture::Wrap::repeat
                 : wrap == "mirror" ? Texture::Wrap::mirror
                                    : Texture::Wrap::clamp;
  texture.to_uv = parse_to_uv(properties);
  properties.finish();
  return texture;
}

}  // namespace

Texture build_texture(Builder& builder, Properties& owner, const std::string& name, double fallback) {
  if (owner.is_object(name)) return build_bitmap(builder, *owner.object("texture", name));
  Texture texture;
  texture.value = owner.color(name, {{fallback, fallback, fallback}}).value;
  for (double v : texture.value)
    if (!(v >= 0 && v <= 1)) owner.fail_at(name, quote(name) + " = " + to_text(v) + " is outside [0, 1]");
  return texture;
}

}  // namespace itn
