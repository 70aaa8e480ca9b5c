#include "tools/itn/manual.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <cstring>
#include <utility>
#include <vector>

#include "itn/file.h"
#include "itn/version.h"
#include "tools/itn/common.h"

namespace itn::tools {
namespace {

// The commands that --help lists.
std::vector<const CLI::App*> commands_of(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App* command) { return !command->get_group().empty(); });
}

std::vector<const CLI::Option*> options_of(const CLI::App& app) {
  return app.get_options([](const CLI::Option* option) { return !option->get_group().empty(); });
}

// -o, --output
std::vector<std::string> names_of(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  return names;
}

bool takes_value(const CLI::Option& option) { return option.get_items_expected_max() > 0; }

// The words that may follow an option, if they are a few.
std::vector<std::string> words_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const std::size_t open = type.find('{'), close = type.find('}');
  std::vector<std::string> words;
  if (open == std::string::npos || close == std::string::npos) return words;
  for (const std::string& word : CLI::detail::split(type.substr(open + 1, close - open - 1), ','))
    words.push_back(word.substr(0, word.find("->")));
  return words;
}

std::string replaced(const std::string& text, const std::vector<std::pair<char, std::string>>& with) {
  std::string result;
  for (const char c : text) {
    const auto found = std::find_if(with.begin(), with.end(), [c](const auto& w) { return w.first == c; });
    result += found == with.end() ? std::string(1, c) : found->second;
  }
  return result;
}

// Lines that begin with a dot or an apostrophe would be requests.
std::string roff(const std::string& text) {
  const std::string escaped = replaced(text, {{'\\', "\\e"}, {'-', "\\-"}});
  return !escaped.empty() && (escaped[0] == '.' || escaped[0] == '\'') ? "\\&" + escaped : escaped;
}

std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

std::string value_name(const CLI::Option& option) {
  const std::vector<std::string> words = words_of(option);
  return words.empty() ? first_line(option.get_type_name()) : fmt::format("{}", fmt::join(words, "|"));
}

// The two parts of what add_example() puts at the end of the help.
std::pair<std::string, std::string> note_and_example(const CLI::App& app) {
  const std::string footer = app.get_footer();
  const std::size_t heading = footer.find(example_heading);
  if (heading == std::string::npos) return {footer, ""};
  return {footer.substr(0, heading), CLI::detail::trim_copy(footer.substr(heading + std::strlen(example_heading)))};
}

std::string page(const CLI::App& app, const std::string& name) {
  std::string text =
      fmt::format(".TH {} 1 \"\" \"itn {}\"\n.SH NAME\n{} \\- {}\n.SH SYNOPSIS\n.B {}\n", CLI::detail::to_lower(name),
                  version(), roff(name), roff(first_line(app.get_description())), roff(replaced(name, {{'-', " "}})));
  std::string positionals, options;
  for (const CLI::Option* option : options_of(app)) {
    if (option->get_positional()) {
      text += fmt::format(".I {}\n", roff(option->get_name(true)));
      positionals += fmt::format(".TP\n.I {}\n{}\n", roff(option->get_name(true)), roff(option->get_description()));
      continue;
    }
    std::string names;
    for (const std::string& n : names_of(*option)) names += (names.empty() ? "\\fB" : ", \\fB") + roff(n) + "\\fR";
    if (takes_value(*option)) names += " \\fI" + roff(value_name(*option)) + "\\fR";
    options += fmt::format(".TP\n{}\n{}", names, roff(option->get_description()));
    if (!option->get_default_str().empty()) options += fmt::format(" [{}]", roff(option->get_default_str()));
    options += '\n';
  }
  const std::vector<const CLI::App*> commands = commands_of(app);
  text += commands.empty() ? "[options]\n" : "\\fIcommand\\fR ...\n";
  text += ".SH DESCRIPTION\n";
  for (const std::string& line : CLI::detail::split(app.get_description(), '\n'))
    text += line.empty() ? ".PP\n" : roff(line) + "\n";
  const auto [note, example] = note_and_example(app);
  if (!note.empty()) text += ".PP\n";
  for (const std::string& line : CLI::detail::split(note, '\n')) text += line.empty() ? "" : roff(line) + "\n";
  if (!positionals.empty()) text += ".SH ARGUMENTS\n" + positionals;
  if (!commands.empty()) text += ".SH COMMANDS\n";
  for (const CLI::App* command : commands)
    text += fmt::format(".TP\n.BR itn\\-{} (1)\n{}\n", roff(command->get_name()),
                        roff(first_line(command->get_description())));
  text += ".SH OPTIONS\n" + options;
  if (!example.empty()) text += ".SH EXAMPLES\n.nf\n" + roff(example) + "\n.fi\n";
  text +=
      ".SH EXIT STATUS\n0 done, 1 the check or the result failed, 2 wrong command line, 3 bad input file, 4 device or "
      "OpenCL failure, 130 interrupted.\n.SH SEE ALSO\n";
  return text + (name == "itn" ? "The documentation in /usr/share/doc/itn.\n" : ".BR itn (1)\n");
}

// All options, and for those that take one of a few words these words.
std::string bash_case(const CLI::App& command) {
  std::vector<std::string> all;
  std::string values;
  for (const CLI::Option* option : options_of(command)) {
    const std::vector<std::string> names = names_of(*option), words = words_of(*option);
    all.insert(all.end(), names.begin(), names.end());
    if (!names.empty() && !words.empty())
      values += fmt::format("        {}) words=\"{}\" ;;\n", fmt::join(names, "|"), fmt::join(words, " "));
  }
  return fmt::format("    {})\n      options=\"{}\"\n      case $before in\n{}        *) ;;\n      esac ;;\n",
                     command.get_name(), fmt::join(all, " "), values);
}

std::string bash(const CLI::App& app) {
  std::vector<std::string> names;
  std::string cases;
  for (const CLI::App* command : commands_of(app)) {
    names.push_back(command->get_name());
    cases += bash_case(*command);
  }
  return fmt::format(R"(# bash completion of itn; made from its options
_itn() {{
  local current=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD-1]}} options="--help --version" words=""
  if [ "$COMP_CWORD" -eq 1 ]; then
    mapfile -t COMPREPLY < <(compgen -W "{} --help --version" -- "$current")
    return
  fi
  case ${{COMP_WORDS[1]}} in
{}    *) ;;
  esac
  if [ -n "$words" ]; then
    mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current")
  elif [ "${{current:0:1}}" = - ]; then
    mapfile -t COMPREPLY < <(compgen -W "$options" -- "$current")
  else
    mapfile -t COMPREPLY < <(compgen -f -- "$current")
  fi
}}
complete -o filenames -F _itn itn
)",
                     fmt::join(names, " "), cases);
}

// In single quotes, within the brackets of _arguments.
std::string zsh_text(const std::string& text) {
  return replaced(first_line(text), {{'\'', "'\\''"}, {'[', "\\["}, {']', "\\]"}, {':', "\\:"}});
}

std::string zsh(const CLI::App& app) {
  std::string names, cases;
  for (const CLI::App* command : commands_of(app)) {
    names += fmt::format("    '{}:{}'\n", command->get_name(), zsh_text(command->get_description()));
    cases += fmt::format("      {})\n        _arguments \\\n", command->get_name());
    for (const CLI::Option* option : options_of(*command)) {
      const std::vector<std::string> words = words_of(*option);
      for (const std::string& name : names_of(*option)) {
        cases += fmt::format("          '*{}[{}]", name, zsh_text(option->get_description()));
        if (takes_value(*option))
          cases += words.empty() ? ":value:_files" : fmt::format(":value:({})", fmt::join(words, " "));
        cases += "' \\\n";
      }
    }
    cases += "          '*:file:_files' ;;\n";
  }
  return fmt::format(R"(#compdef itn
# zsh completion of itn; made from its options
_itn() {{
  local -a commands
  commands=(
{})
  if (( CURRENT == 2 )); then
    _describe command commands
    _arguments '--help[options]' '--version[version, devices, libraries]'
    return
  fi
  local command=$words[2]
  shift words
  (( CURRENT-- ))
  case $command in
{}  esac
}}
_itn "$@"
)",
                     names, cases);
}

}  // namespace

void write_manual(const CLI::App& app, const std::string& folder) {
  make_folder(folder + "/man1");
  write_file(folder + "/man1/itn.1", page(app, "itn"));
  for (const CLI::App* command : commands_of(app))
    write_file(folder + "/man1/itn-" + command->get_name() + ".1", page(*command, "itn-" + command->get_name()));
  write_file(folder + "/itn.bash", bash(app));
  write_file(folder + "/_itn", zsh(app));
}

}  // namespace itn::tools
