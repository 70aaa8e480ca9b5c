#include "runtime/base/json_text.h"

#include <fmt/format.h>

namespace itn {

void check_nesting(std::string_view json, const std::string& file) {
  constexpr int deepest = 100;
  int depth = 0;
  bool in_text = false;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (in_text) {
      if (c == '\\') ++i;
      if (c == '"') in_text = false;
    } else if (c == '"') {
      in_text = true;
    } else if (c == '[' || c == '{') {
      if (++depth > deepest)
        throw InputError(fmt::format("{}: byte {}: its lists and objects nest more than {} deep; need at most that",
                                     file, i, deepest));
    } else if (c == ']' || c == '}') {
      --depth;
    }
  }
}

}  // namespace itn
