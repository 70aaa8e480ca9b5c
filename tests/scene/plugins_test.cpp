// The list of plugins is that of the readers.
#include "runtime/scene/xml/plugins.h"

#include <catch2/catch.hpp>
#include <set>

#include "itn/error.h"
#include "itn/load_scene.h"

using namespace itn;

namespace {

std::string element(const std::string& tag, const std::string& type, const std::string& content = "") {
  return "<" + tag + " type=\"" + type + "\">" + content + "</" + tag + ">";
}

// A scene with such a plugin where it belongs; that it says no more is an error of another kind.
std::string scene_with(const std::string& tag, const std::string& type) {
  const std::string plugin = element(tag, type);
  std::string body = plugin;
  if (tag == "film" || tag == "sampler") body = element("sensor", "perspective", plugin);
  if (tag == "rfilter") body = element("sensor", "perspective", element("film", "hdrfilm", plugin));
  if (tag == "sensor" && type == "irradiancemeter") body = element("shape", "sphere", plugin);
  if (tag == "emitter" && (type == "area" || type == "directionalarea")) body = element("shape", "sphere", plugin);
  const auto in_medium = [](const std::string& content) {
    return element("shape", "sphere", "<medium type=\"heterogeneous\" name=\"interior\">" + content + "</medium>");
  };
  if (tag == "phase") body = in_medium(plugin);
  if (tag == "medium") body = element("shape", "sphere", "<medium type=\"" + type + "\" name=\"interior\"/>");
  if (tag == "volume") body = in_medium("<volume type=\"" + type + "\" name=\"albedo\"/>");
  if (tag == "texture" || tag == "spectrum")
    body = element("shape", "sphere",
                   element("bsdf", "diffuse", "<" + tag + " type=\"" + type + "\" name=\"reflectance\"/>"));
  return "<scene version=\"3.0.0\">" + body + "</scene>";
}

std::string refusal(const std::string& tag, const std::string& type) {
  try {
    load_scene_text("scene.xml", scene_with(tag, type));
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("each plugin that is listed is read, and no other") {
  for (const PluginFamily& family : plugin_families()) {
    CHECK(family.types.size() == std::set<std::string>(family.types.begin(), family.types.end()).size());
    for (const std::string& type : family.types) {
      INFO(family.tag << " " << type);
      CHECK_THAT(refusal(family.tag, type), !Catch::Contains("unknown type"));
    }
    INFO(family.tag);
    CHECK_THAT(refusal(family.tag, "no_such_plugin"), Catch::Contains("unknown type \"no_such_plugin\""));
  }
}
