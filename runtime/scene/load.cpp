#include "runtime/scene/load.h"

#include "runtime/scene/transform.h"
#include "runtime/scene/xml/builder.h"
#include "runtime/scene/xml/message.h"

namespace itn {

void Builder::warn(const Location& where, const std::string& what) {
  scene.warnings.push_back(to_string(where) + ": " + what);
}

void fail_type(const Element& element, const std::vector<std::string>& allowed) {
  const std::string& type = element.attribute("type");
  fail(element.where, "unknown type " + quote(type) + " of <" + element.tag + ">" + need_one_of(type, allowed));
}

namespace {

void check_version(const Element& root) {
  const std::string& version = root.attribute("version");
  if (version.empty()) fail(root.where, "<scene> has no version; need version=\"3.0.0\"");
  if (version[0] != '3')
    fail(root.where, "<scene version=" + quote(version) + ">; need 3.x.x: convert the file by opening it in Mitsuba 3");
}

}  // namespace

Scene load_scene(const std::string& file, const std::map<std::string, std::string>& definitions) {
  const Document document = read_document(file, definitions);
  check_version(*document.root);
  Builder builder(document);
  builder.scene.file = file;
  warn_of_shears(*document.root, builder.scene.warnings);

  Properties root = builder.properties(*document.root);
  if (const Element* integrator = root.object("integrator")) build_integrator(builder, *integrator);
  for (const Element* element : root.objects("bsdf")) build_bsdf(builder, *element);
  for (const Element* element : root.objects("medium")) build_medium(builder, *element);
  // Textures and phase functions belong to what refers to them; here only their parameters are checked.
  for (const Element* element : root.objects("texture")) build_bitmap(builder, *element);
  Medium unused;
  for (const Element* element : root.objects("phase")) build_phase(builder, *element, unused);
  for (const Element* element : root.objects("emitter")) build_emitter(builder, *element);
  for (const Element* element : root.objects("shape")) build_shape(builder, *element);
  for (const Element* element : root.objects("sensor")) build_sensor(builder, *element);
  root.finish();

  if (builder.scene.sensors.empty())
    fail(document.root->where, "the scene has no sensor; need <sensor type=\"perspective\">");
  if (!builder.scene.environment)
    builder.warn(document.root->where,
                 "the scene has no emitter: the image will be black; add <emitter type=\"constant\"/>");
  return builder.scene;
}

}  // namespace itn
