// Turning elements into the host model, one function a kind of element. Elements may be referenced from several places:
// each becomes one entry of the scene's tables.
#pragma once
#include <map>
#include <memory>
#include <string>

#include "runtime/scene/scene.h"
#include "runtime/scene/xml/document.h"
#include "runtime/scene/xml/properties.h"

namespace itn {

class Builder {
 public:
  explicit Builder(const Document& file) : document(file) {}

  const Document& document;
  Scene scene;
  std::map<const Element*, int> bsdf_of, medium_of;                     // indices of what is built already
  std::map<std::string, std::shared_ptr<const Bitmap>> bitmap_of_file;  // key: path, and "raw" or "srgb"

  Properties properties(const Element& element) const { return Properties(document, element); }
  void warn(const Location& where, const std::string& what);
};

int build_bsdf(Builder& builder, const Element& element);    // index into scene.bsdfs
int build_medium(Builder& builder, const Element& element);  // index into scene.media
void build_emitter(Builder& builder, const Element& element);
void build_shape(Builder& builder, const Element& element);
void build_sensor(Builder& builder, const Element& element);
void build_integrator(Builder& builder, const Element& element);
Texture build_bitmap(Builder& builder, const Element& element);              // <texture>
void build_phase(Builder& builder, const Element& element, Medium& medium);  // <phase>, into the medium
// The parameter `name`: a colour in [0, 1], or a bitmap.
Texture build_texture(Builder& builder, Properties& owner, const std::string& name, double fallback);

// The image that the parameter `name` names; files are read once. `raw`: 8-bit values are linear, not sRGB.
std::shared_ptr<const Bitmap> load_bitmap(Builder& builder, Properties& owner, const std::string& name, bool raw);

// Ends with the message that a type is not known.
[[noreturn]] void fail_type(const Element& element, const std::vector<std::string>& allowed);

}  // namespace itn
