#include "itn/texture_model.h"

#include <algorithm>

#include "kernels/model/texture/list.h"

namespace itn {
namespace {

#define ITN_COLOUR(name, kind, fallback) model.colours.push_back({#name, parameter_kind::kind, fallback});
#define ITN_TEXTURE(name, PREFIX, type_)                  \
  {                                                       \
    TextureModel model;                                   \
    model.id = TEXTURE_##name;                            \
    model.type = type_;                                   \
    model.traits = PREFIX##_TRAITS;                       \
    PREFIX##_COLOURS(ITN_COLOUR) models.push_back(model); \
  }

std::vector<TextureModel> make_models() {
  std::vector<TextureModel> models;
  TEXTURE_LIST(ITN_TEXTURE)
  return models;
}

}  // namespace

const std::vector<TextureModel>& texture_models() {
  static const std::vector<TextureModel> all = make_models();
  return all;
}

bool texture_has(int id, int trait) {
  const auto& all = texture_models();
  return std::any_of(all.begin(), all.end(),
                     [&](const TextureModel& m) { return m.id == id && (m.traits & trait) != 0; });
}

const TextureModel* find_texture(const std::string& type) {
  const auto& all = texture_models();
  const auto found = std::find_if(all.begin(), all.end(), [&](const TextureModel& m) { return m.type == type; });
  return found == all.end() ? nullptr : &*found;
}

}  // namespace itn
