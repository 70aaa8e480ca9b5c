// The help of every command is short: an example at its end, and no option's text has a sentence that nobody finishes.
#include <algorithm>
#include <catch2/catch.hpp>
#include <sstream>

#include "tests/tool/process.h"

namespace {

constexpr std::size_t most_words = 30;
constexpr std::size_t text_column = 30;  // where CLI11 begins a text, on the line of its name or on the next

std::vector<std::string> words_of(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

struct Help {
  std::vector<std::string> texts;     // of options, positionals and sub-commands
  std::vector<std::string> commands;  // names of sub-commands
  std::string example;                // the line after "Example:"
};

Help help_of(const std::vector<std::string>& command) {
  std::vector<std::string> arguments = command;
  arguments.emplace_back("--help");
  const Result result = run_itn(arguments);
  REQUIRE(result.exit_code == 0);
  Help help;
  std::istringstream lines(result.output);
  const std::string indent(text_column, ' ');
  std::string heading;
  for (std::string line; std::getline(lines, line);) {
    if (heading == "Example:" && help.example.empty())
      help.example = line;
    else if (!line.empty() && line[0] != ' ')
      heading = line;
    else if (line.starts_with(indent))
      help.texts.back() = line.substr(text_column);
    else if (line.starts_with("  "))
      help.texts.push_back(line.size() > text_column ? line.substr(text_column) : "");
    if (heading == "Subcommands:" && line.starts_with("  ") && line[2] != ' ')
      help.commands.push_back(words_of(line).front());
  }
  return help;
}

// The most words of a sentence.
std::size_t longest_sentence(const std::string& text) {
  std::size_t longest = 0, count = 0;
  for (const std::string& word : words_of(text)) {
    longest = std::max(longest, ++count);
    if (word.ends_with('.') && !word.ends_with("...")) count = 0;
  }
  return longest;
}

}  // namespace

TEST_CASE("the help of each command has an example, and no sentence of an option has more than 30 words") {
  std::vector<std::vector<std::string>> commands{{}};
  for (const std::string& name : help_of({}).commands) commands.push_back({name});
  CHECK(commands.size() > 14);
  for (const std::vector<std::string>& command : commands) {
    const std::string name = command.empty() ? "itn" : "itn " + command.front();
    CAPTURE(name);
    const Help help = help_of(command);
    CHECK_THAT(help.example, Catch::StartsWith("  " + name + " ") || Catch::Equals("  " + name));
    CHECK(help.texts.size() > 6);
    for (const std::string& text : help.texts) {
      CAPTURE(text);
      CHECK(!text.empty());
      CHECK(longest_sentence(text) <= most_words);
    }
  }
}

TEST_CASE("an example has only options that the command's help lists") {
  for (const std::string& name : help_of({}).commands) {
    CAPTURE(name);
    const std::string help = run_itn({name, "--help"}).output;
    for (const std::string& word : words_of(help_of({name}).example))
      if (word.starts_with("-")) CHECK_THAT(help.substr(0, help.find("Example:")), Catch::Contains(word));
  }
}
