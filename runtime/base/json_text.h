// JSON from files that anybody may have written.
#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>

#include "itn/error.h"

namespace itn {

// Throws InputError: brackets nest deeper than anything that is read here (copies and comparisons recurse), or an
// object has a member twice. Says nothing of what is no JSON.
void check_structure(std::string_view json, const std::string& file);

// Throws InputError, which names the file, where it is no JSON.
template <class Json>
Json parse_json(std::string_view text, const std::string& file) {
  check_structure(text, file);
  try {
    return Json::parse(text);
  } catch (const typename Json::exception& error) {
    throw InputError(file + ": is no JSON; " + error.what());
  }
}

// The object of that name within an object, made where there is none. json[a][b] = c makes one too, but where memory
// ends while it does, what it leaves behind crashes when it is destroyed.
template <class Json>
Json& object_in(Json& json, const std::string& name) {
  if (!json.contains(name)) json[name] = Json::object();
  return json[name];
}

// A whole number of that type. Where it is another one, of a fraction, too large or negative, get<Whole>() would make
// another number of it; this throws Json::type_error.
template <class Whole, class Json>
Whole whole(const Json& json) {
  const bool fits = json.is_number_unsigned()  ? std::in_range<Whole>(json.template get<std::uint64_t>())
                    : json.is_number_integer() ? std::in_range<Whole>(json.template get<std::int64_t>())
                                               : false;
  if (!fits) throw Json::type_error::create(302, "need a whole number, got " + json.dump(), nullptr);
  return json.template get<Whole>();
}

}  // namespace itn
