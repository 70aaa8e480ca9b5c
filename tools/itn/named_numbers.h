// Options that give numbers to scene parameters: NAME=VALUE, NAME=LOW,HIGH.
#pragma once
#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace itn::tools {

struct NamedNumbers {
  std::string name;
  std::vector<double> numbers;
};

// The text before the first "=" and the numbers after it; no numbers where one of them is none.
NamedNumbers named_numbers(const std::string& text);

// For CLI::Option::check(): exactly `count` numbers. form: what it should look like, for messages ("NAME=VALUE").
CLI::Validator gives_numbers(std::size_t count, const std::string& form);

}  // namespace itn::tools
