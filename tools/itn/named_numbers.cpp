#include "tools/itn/named_numbers.h"

#include <CLI/CLI.hpp>
#include <algorithm>

namespace itn::tools {

NamedNumbers named_numbers(const std::string& text) {
  NamedNumbers result{text.substr(0, text.find('=')), {}};
  const std::string values = text.substr(std::min(text.size(), result.name.size() + 1));
  if (values.ends_with(',')) return result;
  for (const std::string& value : CLI::detail::split(values, ',')) {
    double number = 0;
    if (!CLI::detail::lexical_cast(value, number)) return {result.name, {}};
    result.numbers.push_back(number);
  }
  return result;
}

CLI::Validator gives_numbers(std::size_t count, const std::string& form) {
  const auto check = [count, form](const std::string& text) -> std::string {
    if (named_numbers(text).numbers.size() == count) return "";
    return "got " + text + (count == 1 ? ", need a number: " : ", need numbers: ") + form;
  };
  return CLI::Validator(check, form);
}

}  // namespace itn::tools
