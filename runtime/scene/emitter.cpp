#include "runtime/scene/emitter.h"

#include <fmt/core.h>

#include <cmath>
#include <numbers>

#include "runtime/error.h"

namespace itn {

namespace {

double luminance(const Rgb& rgb) { return 0.212671 * rgb[0] + 0.715160 * rgb[1] + 0.072169 * rgb[2]; }

// "file:line:column: the envmap emitter"
std::string where(const Emitter& emitter) {
  static const char* const names[] = {"constant", "envmap", "sunsky"};
  const auto& at = emitter.where;
  return fmt::format("{}:{}:{}: {} emitter", at.file, at.line, at.column, names[static_cast<int>(emitter.kind)]);
}

void append_constant(const Emitter& emitter, EmitterRecord& record) {
  record.kind = EMITTER_CONSTANT;
  for (std::size_t c = 0; c < 3; ++c) {
    if (!std::isfinite(emitter.radiance[c]) || emitter.radiance[c] < 0)
      throw InputError(fmt::format("{}: radiance must be finite and not negative; got {} in channel {}", where(emitter),
                                   emitter.radiance[c], c));
    record.radiance[c] = static_cast<float>(emitter.radiance[c]);
  }
  record.sky_weight = static_cast<float>(4 * std::numbers::pi * luminance(emitter.radiance));
}

// The inverse of the upper left 3x3 of to_world, which must be a rotation or a mirrored one.
void set_rotation(const Emitter& emitter, EmitterRecord& record) {
  const auto& m = emitter.to_world.m;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      double product = 0;
      for (std::size_t k = 0; k < 3; ++k) product += m[4 * k + i] * m[4 * k + j];
      if (!(std::abs(product - (i == j ? 1 : 0)) < 1e-4))
        throw InputError(
            fmt::format("{}: to_world scales or shears directions, which has no meaning for distant light; "
                        "need a rotation or a mirrored rotation: remove the scale",
                        where(emitter)));
      record.to_local[3 * i + j] = static_cast<float>(m[4 * j + i]);
    }
}

}  // namespace

void append_emitter(const Emitter& emitter, EmitterRecord& record, std::vector<float>&) {
  record = {};
  set_rotation(emitter, record);
  switch (emitter.kind) {
    case Emitter::Kind::constant:
      append_constant(emitter, record);
      break;
    case Emitter::Kind::envmap:
    case Emitter::Kind::sunsky:
      throw InputError(where(emitter) + " is not supported yet");
  }
}

std::map<std::string, std::string> emitter_definitions(const std::vector<EmitterRecord>& records) {
  std::map<std::string, std::string> definitions;
  for (const auto& record : records) {
    if (record.kind == EMITTER_ENVMAP) definitions.emplace("HAS_ENVMAP", "1");
    if (record.kind == EMITTER_SUNSKY) definitions.emplace("HAS_SUN", "1");
    if (record.complex_sun) definitions.emplace("HAS_COMPLEX_SUN", "1");
  }
  return definitions;
}

}  // namespace itn
