// Wording of error messages: where, what, what was found, what is allowed.
#pragma once
#include <string>
#include <vector>

#include "itn/error.h"
#include "itn/scene.h"

namespace itn {

std::string to_string(const Location& where);  // "file:line:column"

// An InputError about a place in a scene file.
struct LocatedError : InputError {
  LocatedError(const Location& place, const std::string& message) : InputError(message), where(place) {}
  Location where;
};

[[noreturn]] void fail(const Location& where, const std::string& what);

// `"a", "b" or "c"`; "nothing" when empty.
std::string list_of(const std::vector<std::string>& names);

// `; did you mean "sigma_t"?` when an allowed name is within a third of the length of `name` by edit distance, else "".
std::string suggestion(const std::string& name, const std::vector<std::string>& allowed);

// `; need "a" or "b"` and the suggestion.
std::string need_one_of(const std::string& name, const std::vector<std::string>& allowed);

std::string quote(const std::string& text);
std::string to_text(double value);  // shortest that reads back the same

}  // namespace itn
