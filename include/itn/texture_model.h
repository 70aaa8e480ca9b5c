// The textures of kernels/model/texture as the host knows them: what each declares of itself.
#pragma once
#include <string>
#include <vector>

#include "itn/parameter_kind.h"

namespace itn {

// A colour that people set.
struct DeclaredColour {
  std::string name;
  ParameterKind kind;
  double fallback = 0;
};

struct TextureModel {
  int id = 0;        // TEXTURE_* of kernels/model/texture/list.h
  std::string type;  // of the element in scene files
  int traits = 0;    // TEXTURE_*
  std::vector<DeclaredColour> colours;
};

const std::vector<TextureModel>& texture_models();

// Does the texture of that number have the trait?
bool texture_has(int id, int trait);

// The texture of that type, or null.
const TextureModel* find_texture(const std::string& type);

}  // namespace itn
