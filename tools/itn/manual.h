// Manual pages and completions, from the options that the commands declare.
#pragma once
#include <string>

namespace CLI {
class App;
}

namespace itn::tools {

// Writes into the folder: man1/itn.1, man1/itn-COMMAND.1, itn.bash, _itn (zsh).
void write_manual(const CLI::App& app, const std::string& folder);

}  // namespace itn::tools
